"""A driver that sees: `--stack camera`. Three forward cameras and the speedometer, nothing else.

The network says where the lane runs and who is in it; controllers of our stack do the rest: lane
centring by a point ahead, cruise, following and emergency braking by the seven tiers. It reads
neither map nor pose, knows no limits, signs or lights, and stays in its lane.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from math import atan2, nan
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import require_choice, require_range
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.run import Function
from skidpad.core.settings.stack import StackSettings
from skidpad.core.setup import DT
from skidpad.core.specs import SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import Tier
from skidpad.roads.queries import RoadMap
from skidpad.stack.camera.codes import AHEAD, Label, mosaic
from skidpad.stack.camera.eyes import CAMERAS, images_of
from skidpad.stack.camera.network import read_mosaic
from skidpad.stack.control.bends import bend_speed, slow_for_bend
from skidpad.stack.control.steering import (
    lookahead_distance,
    smooth,
    steer_command,
    steering_rules,
)
from skidpad.stack.control.tiers import Situation, begin_tiers, decide, tier_rules, time_gap
from skidpad.stack.memory import new_memory

CRUISE_KMH = 80.0
SAMPLES = 5  # of which the median counts, as in the published fusion
CONFIRMED = 3  # of them that must hold somebody
NEARER = 0.5  # of lane centring's look-ahead, which cuts bends by 0.5 m; a path is surest near
REST = 0.2  # share of the old path that remains: 0.03 s at 20 Hz
Picture = NDArray[np.uint8]
FUNCTIONS = frozenset({Function.ACC, Function.LCA})


class CameraDriver:
    """Deterministic: its commands depend on the images and speeds that it was given alone."""

    report: StackReport

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        """settings: `cruise_kmh` alone, optional."""
        del specs, map
        for key in settings:
            require_choice("camera driver option", key, ("cruise_kmh",))
        self.cruise_kmh = float(settings.get("cruise_kmh", CRUISE_KMH))
        require_range("cruise_kmh", self.cruise_kmh, 1.0, 400.0)
        self.tiers, self.memory = tier_rules(FUNCTIONS, StackSettings(), DT), new_memory()
        begin_tiers(self.memory[0], self.tiers)
        smoothed = StackSettings(steer_smoothing=True)
        self.steering = steering_rules(FUNCTIONS, smoothed, DT)
        self.gaps: deque[float | None] = deque(maxlen=SAMPLES)
        self.offsets: Floats | None = None
        self.report = StackReport()

    @property
    def mode(self) -> str:
        """Returns the tier that won, in lower case; empty text before the first tick."""
        return "" if self.report.tier is None else self.report.tier.name.lower()

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the driver's three cameras."""
        return CAMERAS

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the command of one tick from the three images and the own speed; renews `report`."""
        label = read_mosaic(self.picture(frame))
        v = frame.ego.speed
        offsets, gap = self._path(label), self._gap(label)
        bend = curvature(offsets)
        allowed = bend_speed(bend)
        cruise = min(self.cruise_kmh, kmh_from_mps(allowed))
        distance = nan if gap is None else gap
        seconds = time_gap(distance, v)
        request = decide(
            self.memory[0],
            self.tiers,
            Situation(v, kmh_from_mps(v), distance, seconds, True, nan, cruise, cruise),
        )
        request = slow_for_bend(request, v, allowed)
        self.report = StackReport(
            tier=Tier(request.tier),
            detected=gap is not None,
            distance=gap,
            time_gap=None if gap is None else seconds,
            v_target=cruise / 3.6,
            curvature=bend,
        )
        steer = smooth(self.memory[0], self.steering, steer_of(offsets, v))
        return VehicleCommand(request.throttle, request.brake, steer, request.handbrake)

    def picture(self, frame: SensorFrame) -> Picture:
        """Returns the picture that the network is shown."""
        return mosaic(images_of(frame.extra))

    def _path(self, label: Label) -> Floats:
        """Returns the offsets in m of the lane ahead at AHEAD, a little smoothed."""
        fresh = np.array(label.offsets)
        self.offsets = fresh if self.offsets is None else REST * self.offsets + (1 - REST) * fresh
        return self.offsets

    def _gap(self, label: Label) -> float | None:
        """Notes the label's gap and returns the median in m of the last SAMPLES.

        None with less than CONFIRMED.
        """
        self.gaps.append(label.gap)
        known = [gap for gap in self.gaps if gap is not None]
        return median(known) if len(known) >= CONFIRMED else None


def steer_of(offsets: Floats, v: float) -> float:
    """Returns steer in [-1, 1] towards the lane's middle; offsets in m at AHEAD, v in m/s (A-142, A-146)."""
    v_kmh = kmh_from_mps(v)
    distance = min(NEARER * lookahead_distance(v_kmh), AHEAD[-1])
    left = float(np.interp(distance, AHEAD, offsets))
    return steer_command(atan2(left, distance), v_kmh)


def curvature(offsets: Floats) -> float:
    """Returns the 1/m of the parabola through offsets in m at AHEAD, by least squares; left positive."""
    return 2.0 * float(np.polyfit(AHEAD, offsets, 2)[0])
