"""Drivers differ: desired speed, headway and acceleration, one stream per driver (C-11)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.core.randomness import stream

# Taieb-Maimon and Shinar (2001), Human Factors 43(1): at 50 to 100 km/h drivers follow at 0.98 s when
# told to keep a comfortable distance and at 0.66 s when told to keep the smallest safe one. Log-normal
# with the first as median; the second is put one deviation below it (ours).
HEADWAY_MEDIAN, HEADWAY_SIGMA = 0.98, 0.4  # s, of the logarithm
HEADWAY_RANGE = (0.5, 3.0)  # s
# Free speeds are normal with a coefficient of variation near 0.1 (Highway Capacity Manual 2010).
SPEED_SIGMA, SPEED_RANGE = 0.10, (0.75, 1.25)
# Kesting, Treiber and Helbing (2010) vary the IDM's acceleration by 20 to 30 %.
ACCELERATION_SIGMA, ACCELERATION_RANGE = 0.25, (0.5, 1.6)


def vary(traits: NDArray[np.void], ids: Sequence[int], seed: int) -> None:
    """Give every driver (row of TRAIT) a character of its own."""
    for id, trait in zip(ids, traits, strict=True):
        draw = stream(seed, "traffic", "character", id).standard_normal(3).tolist()
        headway = HEADWAY_MEDIAN * np.exp(HEADWAY_SIGMA * draw[0])
        trait["headway"] = np.clip(headway, *HEADWAY_RANGE)
        trait["factor"] *= np.clip(1.0 + SPEED_SIGMA * draw[1], *SPEED_RANGE)
        trait["a_max"] *= np.clip(1.0 + ACCELERATION_SIGMA * draw[2], *ACCELERATION_RANGE)
