"""Drivers differ: desired speed, headway and acceleration, one stream per driver (C-11).

In the stratum of risky drivers the least of two published distributions is drawn more often than it
occurs, and each driver has the weight that makes up for it: p / q, by which what happens with him
counts as often as among natural drivers (importance sampling, which Zhao et al. 2017, IEEE T-ITS,
10.1109/TITS.2016.2582208, brought to cut-ins).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from skidpad.core.maths.randomness import stream
from skidpad.core.vocabulary import Headways, Stratum

# Taieb-Maimon and Shinar (2001), Human Factors 43(1): at 50 to 100 km/h drivers follow at 0.98 s when
# told to keep a comfortable distance and at 0.66 s when told to keep the smallest safe one. Log-normal
# with the first as median; the second is put one deviation below it (ours).
HEADWAY_MEDIAN, HEADWAY_SIGMA = 0.98, 0.4  # s, of the logarithm
HEADWAY_RANGE = (0.5, 3.0)  # s
# Of the field (`campaign/bench/headways.csv`, rows to fit): log-normal gaps of followers on motorways
# (Al-Obaedi 2019: mean 1.10 s, deviation 0.42 s) and headways on streets (Michael, Leeming and Dwyer
# 2000: 7.3 % below 1 s, 50.6 % below 2 s).
FIELD_FAST, FIELD_TOWN = (1.028, 0.369), (1.986, 0.472)  # s, and of the logarithm
FIELD_RANGE = (0.3, 6.0)  # s
GOLDEN_SHARE = 0.6180339887498949  # of one, from the quantile of one driver to that of the next
# Free speeds are normal with a coefficient of variation near 0.1 (Highway Capacity Manual 2010).
SPEED_SIGMA, SPEED_RANGE = 0.10, (0.75, 1.25)
# Kesting, Treiber and Helbing (2010) vary the IDM's acceleration by 20 to 30 %.
ACCELERATION_SIGMA, ACCELERATION_RANGE = 0.25, (0.5, 1.6)

# Gaps left to the new follower by 3172 cut-ins between drivers: median 9.57 m, 51.8 % below 10 m
# (Alhuraish, Wang and Zhou 2026, arXiv 2605.01485, abstract). A log-normal through both has a
# deviation of ln(10 / 9.57) / 0.0451 = 0.97.
GAP_MEDIAN, GAP_SIGMA = 9.57, 0.97  # m, of the logarithm
GAP_RANGE = (1.0, 60.0)  # m
IMPOSED = 8.0  # m/s^2 that others may have to brake for who cuts in: the hardest (assumed)
EAGER = 20.0  # times as many changes without a reason, so that there are cut-ins (assumed)
# Layers of the proposal: a share of draws from the least part of the distribution. Weights are 2 in
# the body, 1/3 in the least tenth (gaps: 2/11) and 1/28 in the least hundredth.
Layers = tuple[tuple[float, float], ...]  # part, share
HEADWAY_LAYERS: Layers = ((1.0, 0.5), (0.1, 0.25), (0.01, 0.25))
GAP_LAYERS: Layers = ((1.0, 0.5), (0.1, 0.5))  # a hundredth of all gaps lies below 1 m: contacts
HEADWAY_LEAST = 0.25  # s, of risky drivers; the least hundredth lies below 0.39 s


@dataclass(frozen=True, slots=True)
class Character:
    """What a risky driver does, as quantiles of the published distributions, and the weights p / q."""

    u_headway: float
    u_gap: float
    of_headway: float  # weight of what hangs on how closely he follows
    of_gap: float  # of what hangs on how closely he cuts in


def risky_character(seed: int, id: int) -> Character:
    """Returns the character of driver `id` in the stratum of risky drivers."""
    rng = stream(seed, "traffic", "risky", id)
    draws = rng.random(4).tolist()
    u_headway, of_headway = tail_draw(HEADWAY_LAYERS, *draws[:2])
    u_gap, of_gap = tail_draw(GAP_LAYERS, *draws[2:])
    return Character(u_headway, u_gap, of_headway, of_gap)


def tail_draw(layers: Layers, which: float, where: float) -> tuple[float, float]:
    """Returns a quantile in [0, 1) from two uniform numbers, and its weight p / q.

    q is the mixture of p within each layer's part by the layers' shares: no weight exceeds one over
    the share of the whole.
    """
    part, until = layers[-1][0], 0.0
    for layer, share in layers:
        until += share
        if which < until:
            part = layer
            break
    u = where * part
    return u, 1.0 / sum(share / layer for layer, share in layers if u < layer)


def vary(
    traits: NDArray[np.void],
    ids: Sequence[int],
    seed: int,
    stratum: Stratum = Stratum.NATURAL,
    headways: Headways = Headways.COMFORT,
) -> None:
    """Gives every driver (row of TRAIT) a character of its own, in place.

    Headways of the field are spread evenly over ids (a Kronecker sequence from a start drawn per run):
    twenty drivers stand for the whole distribution, its ends included.
    """
    first = float(stream(seed, "traffic", "headways").random())
    for id, trait in zip(ids, traits, strict=True):
        draw = stream(seed, "traffic", "character", id).standard_normal(3).tolist()
        if headways is Headways.FIELD:
            draw[0] = _normal((first + id * GOLDEN_SHARE) % 1.0)
        if stratum is Stratum.RISKY:
            risky = risky_character(seed, id)
            draw[0] = _normal(risky.u_headway)
            gap = GAP_MEDIAN * np.exp(GAP_SIGMA * _normal(risky.u_gap))
            trait["room"] = np.clip(gap, *GAP_RANGE)
            trait["imposed"], trait["eager"] = IMPOSED, EAGER
        least = HEADWAY_LEAST if stratum is Stratum.RISKY else HEADWAY_RANGE[0]
        if headways is Headways.FIELD:
            trait["is_exact"] = True
            for name, (median, sigma) in (("headway", FIELD_FAST), ("headway_town", FIELD_TOWN)):
                trait[name] = np.clip(median * np.exp(sigma * draw[0]), *FIELD_RANGE)
        else:
            headway = HEADWAY_MEDIAN * np.exp(HEADWAY_SIGMA * draw[0])
            trait["headway"] = trait["headway_town"] = np.clip(headway, least, HEADWAY_RANGE[1])
        trait["factor"] *= np.clip(1.0 + SPEED_SIGMA * draw[1], *SPEED_RANGE)
        trait["a_max"] *= np.clip(1.0 + ACCELERATION_SIGMA * draw[2], *ACCELERATION_RANGE)


def _normal(u: float) -> float:
    """Returns the standard normal quantile of u in 0..1, finite at both ends."""
    return NormalDist().inv_cdf(min(max(u, 1e-9), 1.0 - 1e-9))
