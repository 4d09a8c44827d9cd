"""How far a car ahead is seen, by an object level, an eye and a network: `python tools/sight_check.py FILE`.

Writes docs/sight-check.csv, a table of docs/rendering.md: the limit of the object level, an eye after
Adrian, and the camera driver's network on pixels, in eight weathers. Nothing here is read by the product.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from math import cos, inf, log10, pi, sin, sqrt
from pathlib import Path
from statistics import median

import numpy as np

from skidpad.core.setup import DT
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.weather import Weather
from skidpad.evidence.statistics import clopper_pearson, median_time
from skidpad.physics.camera import contrast_at
from skidpad.physics.optics import (
    CONTRAST_CAR,
    HEADLIGHT_CANDELA,
    daylight,
    label_range,
    sight,
    transmission,
)
from skidpad.physics.presets import preset
from skidpad.physics.types import EGO_TYPE, vehicle_types
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import LanePoint
from skidpad.sensors.object_level.objects import SIGHT, ObjectSuite
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite
from skidpad.stack.camera.codes import SEEN, mosaic
from skidpad.stack.camera.driver import CONFIRMED, SAMPLES
from skidpad.stack.camera.eyes import CAMERAS, images_of
from skidpad.stack.camera.network import read_mosaic

WEATHERS = {
    "clear-noon": preset("clear-noon"),
    "rain_20": preset("rain_20"),
    "rain-noon": preset("rain-noon"),
    "fog, 1 km": Weather(fog_density=50.0),
    "fog, 224 m": Weather(fog_density=75.0),
    "fog, 50 m": Weather(fog_density=100.0),
    "clear-night": preset("clear-night"),
    "rain-night": preset("rain-night"),
}
LEVELS = (1, 7, 21)  # of visibility; docs/rendering.md says whose
CAR = sqrt(4.0 / pi * 1.8 * 1.5)  # m, diameter of a disc as large as a car's rear
LARGEST = 60.0  # arc minutes, larger targets count as this; validity of the time factor
ROAD = 0.1  # reflectance of road and of a dark car: assumption
NIGHT_ADAPTATION = 0.1  # cd/m^2, of a road lit by a low beam: assumption
AGE, GLANCE, PROBABLE = 30.0, 0.2, 2.6  # years; s; k of the plots of that repository after Adrian
NIGHT_LUX = 10.0  # less daylight is night, as in `optics.label_range`
APPROACHES, FARTHEST, NEAREST, STEP = 20, 90.0, 6.0, 3.0  # gaps in m, bumper to bumper
EMPTY_LOOKS = 10  # at a road without anybody
NEAR_ENOUGH = 0.3  # of the gap: a gap that is told farther off is no detection


def eye_threshold(background: float, arc_minutes: float, is_darker: bool) -> float:
    """Difference in cd/m^2 that an eye of AGE just sees in GLANCE s (Adrian 1989).

    background: cd/m^2, at least 0.00418; read in a MATLAB function of TU Berlin.
    """
    size, log_b = min(arc_minutes, LARGEST), log10(background)
    if background >= 0.6:
        ricco = log10(4.1925 * background**0.1556) + 0.1684 * background**0.5867
        weber = 0.05946 * background**0.466
    else:
        ricco = 10.0 ** (-0.072 + 0.3372 * log_b + 0.0866 * log_b**2)
        weber = 10.0 ** (-1.256 + 0.319 * log_b)
    found = PROBABLE * (ricco / size + weber) ** 2
    if is_darker:
        factor = 0.125 if background >= 0.1 else 0.075
        m = 10.0 ** -(10.0 ** -(factor * (log_b + 1.0) ** 2 + 0.0245))
        found *= 1.0 - m * size ** (-0.6 * background**-0.1488) / (2.4 * found)
    if size < LARGEST:
        a, b = log10(size) + 0.523, log_b + 6.0
        by_size = 0.36 - 0.0972 * a * a / (a * a - 2.513 * a + 2.7895)
        by_light = 0.355 - 0.1217 * b * b / (b * b - 10.4 * b + 52.28)
        found *= (sqrt(by_size**2 + by_light**2) / 2.1 + GLANCE) / GLANCE
    return float(found * ((AGE - 19.0) ** 2 / 2160.0 + 0.99))


def visibility_level(weather: Weather, distance: float) -> float:
    """Difference of luminance of a car at `distance` m over the one that is just seen."""
    arc_minutes = 60.0 * np.degrees(CAR / distance)
    lux = daylight(weather)
    if lux >= NIGHT_LUX:
        background = lux * ROAD / pi
        contrast = contrast_at(CONTRAST_CAR, weather, distance)
        return float(contrast * background / eye_threshold(background, arc_minutes, True))
    left = transmission(weather, distance)
    lit = HEADLIGHT_CANDELA / distance**2 * left * ROAD / pi
    return float(lit * left / eye_threshold(NIGHT_ADAPTATION, arc_minutes, False))


def eye_range(weather: Weather, level: float) -> float:
    """Distance in m to which a car has this level of visibility."""
    low, high = 1.0, 50_000.0
    for _ in range(60):
        middle = sqrt(low * high)
        low, high = (middle, high) if visibility_level(weather, middle) > level else (low, middle)
    return low


class Approach:
    """An ego that stands in its lane on the straight map, and one other body ahead of it."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        kinds = vehicle_types()
        cars = sorted(n for n, t in kinds.items() if t.kind == "car")
        types = (EGO_TYPE, str(rng.choice(cars)))
        chosen = [kinds[t] for t in types]
        self.map = load_map("straight")
        self.table = ActorTable(
            ("ego", "lead"), types,
            np.array([t.actor_kind for t in chosen], dtype=np.uint8),
            np.array([t.length for t in chosen]), np.array([t.width for t in chosen]),
            np.array([t.height for t in chosen]), rng.integers(0, 256, (2, 3)).astype(np.uint8),
        )  # fmt: skip
        rows = [
            k for k in range(0, len(self.map.samples.lane), 97)
            if self.map.lanes.kind[self.map.samples.lane[k]] == LaneKind.DRIVING
            and self.map.ahead(self._at(k), SIGHT + 20.0) is not None
        ]  # fmt: skip
        self.place = self._at(int(rng.choice(rows)))
        self.offset = float(rng.normal(0.0, 0.2))
        self.seed = seed

    def _at(self, row: int) -> LanePoint:
        return self.map.at(int(self.map.samples.lane[row]), float(self.map.samples.s[row]))

    def states(self, gap: float | None) -> ActorStates:
        """Both bodies, `gap` m between them; None: nobody is ahead."""
        states = ActorStates.empty(2)
        far = 0.0 if gap is None else gap + 0.5 * float(self.table.length.sum())
        for i, distance, offset in ((0, 0.0, self.offset), (1, far, 0.0)):
            point = self.map.ahead(self.place, distance)
            assert point is not None
            states.x[i] = point.x - offset * sin(point.heading)
            states.y[i] = point.y + offset * cos(point.heading)
            states.z[i], states.yaw[i], states.present[i] = point.z, point.heading, True
        states.present[1] = gap is not None
        return states

    def told(self, weather: Weather, gaps: Sequence[float | None]) -> list[float]:
        """Median in m of SAMPLES looks at each gap, as the driver takes it; inf where too few tell one."""
        suite = PixelSuite(
            self.map, self.table, CAMERAS, weather, PixelSettings(seed=self.seed, dt=DT)
        )
        found = []
        for k, gap in enumerate(gaps):
            states, known = self.states(gap), []
            for look in range(SAMPLES):
                seen = suite.observe(k * SAMPLES + look, states, {})
                label = read_mosaic(mosaic(images_of(seen.images)))
                known += [] if label.gap is None else [label.gap]
            found.append(median(known) if len(known) >= CONFIRMED else inf)
        return found

    def finds(self, weather: Weather, gaps: Sequence[float]) -> list[bool]:
        """Whether somebody is told at each gap, and within NEAR_ENOUGH of where they are."""
        told = self.told(weather, gaps)
        return [abs(t - g) <= NEAR_ENOUGH * g for t, g in zip(told, gaps, strict=True)]

    def is_fooled(self, weather: Weather, looks: int) -> bool:
        """Whether the driver takes an empty road for occupied within SEEN in one of `looks` tries."""
        return min(self.told(weather, [None] * looks)) <= SEEN


def gaps_of_approach() -> list[float]:
    """Gaps in m from far to near."""
    return [float(g) for g in np.arange(FARTHEST, NEAREST - 1e-9, -STEP)]


def held_from(gaps: list[float], found: list[bool]) -> float:
    """Gap from which on every look finds somebody; 0 where the last one does not."""
    held = 0.0
    for gap, seen in zip(reversed(gaps), reversed(found), strict=True):
        if not seen:
            break
        held = gap
    return held


def object_range(weather: Weather) -> float:
    """Distance in m at which the object level first gives a depth camera something of a car."""
    approach = Approach(1)
    specs = twelve_sensors()
    suite = ObjectSuite(approach.map.roadside, approach.table, specs, 0, DT, weather)
    for gap in np.arange(SIGHT + 5.0, NEAREST, -0.5):
        if any(len(s.depth) for s in suite.segments(approach.states(float(gap))).values()):
            return float(gap)
    return 0.0


def row_of(name: str, weather: Weather) -> dict[str, str]:
    """One weather."""
    gaps, held, first, empty = gaps_of_approach(), [], [], 0
    for seed in range(1, APPROACHES + 1):
        approach = Approach(seed)
        found = approach.finds(weather, gaps)
        held.append(held_from(gaps, found))
        first.append(next((g for g, seen in zip(gaps, found, strict=True) if seen), 0.0))
        empty += approach.is_fooled(weather, EMPTY_LOOKS)
    row = {"weather": name, "optical_range_m": f"{sight(weather):.0f}"}
    row["contrast_limit_m"] = f"{label_range(weather):.0f}"
    row["object_level_m"] = f"{object_range(weather):.1f}"
    for level in LEVELS:
        row[f"eye_level_{level}_m"] = f"{eye_range(weather, level):.0f}"
    for kind, values in (("network_first", first), ("network_held", held)):
        keys = (f"{kind}_m", f"{kind}_low_m", f"{kind}_high_m")
        centre, limits = median_time(values, FARTHEST)
        assert limits is not None
        row |= dict(zip(keys, (f"{v:.1f}" for v in (centre, *limits)), strict=True))
    row["false_alarms_of_20"] = str(empty)
    low, high = clopper_pearson(empty, APPROACHES)
    row["false_alarm_low"], row["false_alarm_high"] = f"{low:.2f}", f"{high:.2f}"
    return row


if __name__ == "__main__":
    rows = []
    for name, weather in WEATHERS.items():
        rows.append(row_of(name, weather))
        print(rows[-1], flush=True)
    with Path(sys.argv[1]).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
