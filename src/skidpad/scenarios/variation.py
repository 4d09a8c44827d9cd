"""The scenarios that come with Skidpad: their files, what a seed varies, variants of the cut-in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib.resources import files
from types import MappingProxyType

import msgspec
import numpy as np

from skidpad.core.maths.randomness import stream
from skidpad.core.setup import DT
from skidpad.scenarios.shipped import find_shipped

CUT = 2.5  # deviations
SKILL_SPREAD = 0.15  # of the gains of scripted drivers
EGO_SPEED, CRUISE_SPEED = "EgoSpeed", "CruiseSpeed"
CUT_IN = "ghost_cut_in"
SPAWN_DELAY = 40  # ticks by which the slower spawning holds the ghost back (B-070)


class CutIn(str, Enum):
    """Variants of the cut-in (B-070 to B-079, decision G-3)."""

    ORIGINAL = "original"  # from rest, no delay, the first distance
    UNFIXED = "unfixed"  # from rest, the ghost comes later, the first distance
    FIXED = "fixed"  # from rest, the ghost comes later, the repaired distance


@dataclass(frozen=True, slots=True)
class Spread:
    """Distribution of one parameter around its value in the file."""

    gap: float = 0.0  # uniform, +-, in the parameter's unit
    spread: float = 0.0  # normal, share of the value

    def draw(self, value: float, rng: np.random.Generator) -> float:
        """Returns one value of the distribution."""
        noise = float(np.clip(rng.standard_normal(), -CUT, CUT))
        return value * (1.0 + self.spread * noise) + self.gap * float(rng.uniform(-1.0, 1.0))


# Start from rest towards 50 km/h; the ghost comes from 15 m behind at 86 km/h. Held back by the spawn
# delay it comes from as far as it drives in that time: the ego is faster when they meet (BD-51).
FROM_REST = {"EgoSpeed": 0.0, "CruiseSpeed": 13.9, "GhostSpeed": 24.0, "GhostEndSpeed": 4.0}
GHOST_S = 85.0  # m
FIRST_DISTANCE, REPAIRED_DISTANCE = 12.0, 2.0  # m, chosen as docs/grip.md says (B-074)


def variant_parameters(
    variant: CutIn, v_ghost: float = FROM_REST["GhostSpeed"]
) -> dict[str, float]:
    """Returns the values of the file's parameters that make the variant. v_ghost: m/s."""
    late = 0.0 if variant is CutIn.ORIGINAL else SPAWN_DELAY * DT
    repaired = variant is CutIn.FIXED
    return FROM_REST | {
        "GhostSpeed": v_ghost,
        "GhostS": GHOST_S - late * v_ghost,
        "MergeDistance": REPAIRED_DISTANCE if repaired else FIRST_DISTANCE,
    }


@cache
def variations() -> dict[str, dict[str, Spread]]:
    """Returns what a seed varies, by scenario and parameter."""
    text = (files("skidpad.scenarios") / "variation.yaml").read_bytes()
    return msgspec.yaml.decode(text, type=dict[str, dict[str, Spread]])


def drawn_parameters(
    name: str,
    seed: int,
    variant: CutIn = CutIn.FIXED,
    nominal: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, float]:
    """Returns the parameters of a scenario for a seed; the same for every weather and friction (X-8).

    nominal: values drawn around in place of the file's.
    """
    values = dict(find_shipped(name).parameters)
    if name == CUT_IN:
        values |= variant_parameters(variant)
    values |= nominal
    drawn = {
        parameter: spread.draw(values[parameter], stream(seed, "scenario", name, parameter))
        for parameter, spread in variations()[name].items()
    }
    if name != CUT_IN:  # which starts from rest
        drawn[CRUISE_SPEED] = drawn[EGO_SPEED]
    return values | drawn


def drawn_skill(name: str, seed: int) -> dict[str, float]:
    """Returns the gains of the scripted drivers, by actor, around 1."""
    spread = Spread(spread=SKILL_SPREAD)
    return {
        actor: spread.draw(1.0, stream(seed, "scenario", name, "driver", actor))
        for actor in find_shipped(name).actors
    }
