"""Our stack with one thing changed that is no setting: what studies compare it with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, pi, sqrt
from typing import Any

import numpy as np

from skidpad.core.frames import RadarPoints, Segments, SensorFrame
from skidpad.core.maths.randomness import stream
from skidpad.core.specs import SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import Tier
from skidpad.roads.queries import RoadMap
from skidpad.stack.adas import AdasStack

DROPOUT_S = 1.0  # length of one stretch without sensing (F-08)
MISS_S = 0.5  # length of one miss; assumed, as sources count frames and not how long misses last
DRIFT_S = 0.5  # time over which an error of depth stays alike; assumed
LONGEST = 200_000  # ticks for which stretches are drawn; they repeat after it
HELD_IN = (Tier.HARD_STOP, Tier.STOPPED_TOO_CLOSE, Tier.EMERGENCY)


class Changed:
    """Wraps our stack, for subclasses that change what it sees or does."""

    report: StackReport

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        plain = dict(settings)
        self.change = plain.pop("change", {})
        self.stack = AdasStack(specs, map, plain)
        self.report = self.stack.report

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Drives as the stack does, and keeps its report."""
        command = self.stack.tick(frame)
        self.report = self.stack.report
        return command


class Coastless(Changed):
    """Changes our stack so that it pulls away as soon as its lead is lost (F-18)."""

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        super().__init__(specs, map, settings)
        rules = self.stack.rules
        self.stack.follow_rules(rules._replace(tiers=rules.tiers._replace(coast_ticks=0)))


class Handbraked(Changed):
    """Changes our stack so that it pulls the handbrake in tiers 1 to 3, at any speed (F-29)."""

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Drives, and pulls the handbrake in some tiers."""
        command = super().tick(frame)
        return replace(command, handbrake=True) if self.report.tier in HELD_IN else command


class Blinking(Changed):
    """Changes our stack so that it gets empty sensor frames for stretches of a second (F-08)."""

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        super().__init__(specs, map, settings)
        seed, share = self.change["seed"], self.change["dropout"]
        self.blind = stretches(seed, "dropout", share, DROPOUT_S / self.stack.config.dt)

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Drives, without sensors in the ticks that are blind."""
        if self.blind[frame.tick % self.blind.size]:
            frame = replace(frame, images={}, segments={}, radar=RadarPoints.none())
        return super().tick(frame)


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """How much worse cameras see; nothing by default."""

    depth_error: float = 0.0  # mean of |error| / depth
    missed: float = 0.0  # share of time in which a camera misses every road user
    range_share: float = 1.0  # of the range in which the stack reads depth


# Misses: vehicles missed on ordinary video by night, 17 of 385, against 3 of 343 by day; Fu et al.
# (2017), Journal of Advanced Transportation, 5142732, table 4. A roadside camera, not a moving one.
# Range: "at least a 60% reduction in detection range at 40 mm/h", long- and short-range cameras; Cowan
# and Stowe (2024), Investigation of ADAS/ADS sensor and system response to rainfall rate, Virginia
# Tech Transportation Institute, abstract. Depth: mean relative errors of 0.17 of a network that was
# trained for it, nuScenes by night 0.1713, DrivingStereo in rain 0.1707; Yan et al. (2025), arXiv
# 2503.20211, taken from a summary and not from its table, so both count as assumptions.
NOISE = {
    "exact": Noise(),
    "night": Noise(depth_error=0.17, missed=17.0 / 385.0),
    "rain": Noise(depth_error=0.17, range_share=0.4),
}
DEPTH_READ = 80.0  # m, the farthest depth that any tier reads
SIGMA_PER_MEAN = sqrt(pi / 2.0)  # of a normal deviate: standard deviation over mean of its size


class Noisy(Changed):
    """Changes our stack so that cameras err as measured at night or in rain; objects only.

    For A-230, F-12 and F-13.
    """

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        super().__init__(specs, map, settings)
        self.noise, self.seed = Noise(**self.change["noise"]), int(self.change["seed"])
        self.keep = exp(-self.stack.config.dt / DRIFT_S)
        self.errors: dict[str, float] = {}
        self.misses = {}
        self.draws = {}
        for spec in specs:
            length = MISS_S / self.stack.config.dt
            name = f"{spec.id}/missed"
            self.misses[spec.id] = stretches(self.seed, name, self.noise.missed, length)
            self.draws[spec.id] = stream(self.seed, "study", spec.id, "depth")

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Drives by the segments that the noise leaves, with a depth error."""
        seen = {id: self._disturb_segments(id, s, frame.tick) for id, s in frame.segments.items()}
        return super().tick(replace(frame, segments=seen))

    def _disturb_segments(self, id: str, segments: Segments, tick: int) -> Segments:
        """Returns a copy of a camera's segments with an error of depth; empty in a missed tick.

        Segments beyond `range_share` of DEPTH_READ are left out (from 1 on, none). id: of the camera.
        Each call draws the next error: call it once per tick and camera.
        """
        factor = self._factor(id)
        keep = segments.depth <= self.noise.range_share * DEPTH_READ
        if self.noise.range_share >= 1.0:
            keep[:] = True
        missed = self.misses[id]
        if missed[tick % missed.size]:
            keep[:] = False
        kept = Segments._make(column[keep] for column in segments)
        return kept._replace(depth=(kept.depth * np.float32(factor)).astype(np.float32))

    def _factor(self, id: str) -> float:
        """Draws and returns the drifting factor on depth of a camera, at least 0.05 (Gauss-Markov)."""
        drawn = float(self.draws[id].standard_normal())
        before = self.errors.get(id)
        fresh = drawn if before is None else self.keep * before + sqrt(1 - self.keep**2) * drawn
        self.errors[id] = fresh
        return max(1.0 + SIGMA_PER_MEAN * self.noise.depth_error * fresh, 0.05)


def stretches(
    seed: int, name: str, share: float, length: float
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Returns (LONGEST,) True in stretches of `length` ticks that fill about `share` of time."""
    n = max(1, round(length))
    begins = stream(seed, "study", name).random(LONGEST) < share / n
    reach = np.convolve(begins, np.ones(n))[:LONGEST]
    within: np.ndarray[Any, np.dtype[np.bool_]] = reach > 0.5
    return within
