"""Pixels and objects in lockstep: the same drive, seen at both levels (decision M-3)."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from skidpad.campaign.cells import Cell, Driver
from skidpad.campaign.drive import prepare, run_cell
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.setup import DT
from skidpad.core.specs import RadarSpec
from skidpad.core.states import StackReport, WorldTruth
from skidpad.core.vocabulary import DetectionStatus, SensorLevel, Supervision, Tier
from skidpad.physics.presets import find_weather
from skidpad.sensors.object_radar import RadarDirections
from skidpad.sensors.radar import Radar, aim
from skidpad.sensors.twelve import twelve_sensors
from skidpad.simulation.embedded.sensing import Objects
from skidpad.stack.adas import AdasStack
from skidpad.stack.configurations import functions_of
from skidpad.stack.settings import load_profile

SEEING = (DetectionStatus.FUSION_DETECT, DetectionStatus.FUSION_PERSIST)
TO_A_LEAD = frozenset(
    {
        Tier.HARD_STOP,
        Tier.STOPPED_TOO_CLOSE,
        Tier.EMERGENCY,
        Tier.STOPPED_BEHIND_CAR,
        Tier.APPROACH,
        Tier.ACC_HOLD,
        Tier.ACC_OPEN,
        Tier.ACC_CLOSE,
    }
)
HARD = frozenset({Tier.HARD_STOP, Tier.STOPPED_TOO_CLOSE, Tier.EMERGENCY})
Reports = list[tuple[StackReport, StackReport]]  # of pixels and of objects, tick by tick


class Shadow:
    """A second stack that sees the drive of the first through the object level.

    own_radar: the object level's radar; else it hears the points of the pixel level.
    """

    def __init__(self, cell: Cell, own_radar: bool = True) -> None:
        ready = prepare(replace(cell, level=SensorLevel.OBJECTS))
        self.ready, self.seed, self.own_radar = ready, cell.seed, own_radar
        self.suite: Objects | None = None
        plain = {
            "functions": sorted(f.value for f in cell.driver.functions),
            "profile": cell.profile,
        }
        self.stack = AdasStack(ready.setup.specs, ready.map, plain)
        self.rows: Reports = []

    def see(self, frame: SensorFrame, truth: WorldTruth, report: StackReport | None) -> None:
        if self.suite is None:
            self.suite = Objects(self.ready.map, truth.table, self.ready.setup, self.seed)
        seen = self.suite.read(frame.tick, truth.states, frame.lights, None)
        radar = seen.radar if self.own_radar else frame.radar
        self.stack.tick(replace(frame, images={}, segments=seen.segments, radar=radar))
        if frame.supervision is Supervision.NONE:
            assert report is not None
            self.rows.append((report, self.stack.report))


@lru_cache(maxsize=2)
def in_lockstep(number: int, weather: str, seed: int) -> tuple[Reports, Reports]:
    """One drive on pixels, seen by two shadows: with the radar of their level, and with its own."""
    cell = Cell(
        driver=Driver(label=str(number), functions=functions_of(number)),
        weather=find_weather(weather),
        seed=seed,
        profile="recommended",
        settings=load_profile("recommended"),
        duration=36.0,
    )
    shadows = Shadow(cell), Shadow(cell, own_radar=False)
    run_cell(cell, watchers=shadows)
    return shadows[0].rows, shadows[1].rows


def first_events(rows: Reports, tiers: frozenset[Tier]) -> tuple[int, int]:
    """Tick at which one of the tiers acts for the first time, at pixel and at object level."""
    pixels, objects = (
        next(k for k, both in enumerate(rows) if both[level].tier in tiers) for level in (0, 1)
    )
    return pixels, objects


CITY, OPEN_ROAD = (4, "clear-noon", 2), (1, "rain-night", 1)  # configuration, weather, seed


@pytest.mark.req("M-3")
def test_both_levels_read_the_same_distances() -> None:
    rows, _ = in_lockstep(*CITY)
    both = [(p.fused, o.fused) for p, o in rows if p.fused is not None and o.fused is not None]
    assert len(both) > 100
    difference = np.abs(np.subtract(*zip(*both, strict=True)))
    assert np.median(difference) <= 0.3
    detected = np.array([(p.status in SEEING, o.status in SEEING) for p, o in rows])
    agreement = np.mean(detected[:, 0] == detected[:, 1])
    print(f"median {np.median(difference):.3f} m, agreement {agreement:.3f}")
    assert agreement >= 0.97


@pytest.mark.req("M-3")
@pytest.mark.parametrize("tiers", [TO_A_LEAD, HARD], ids=["any tier", "hard braking"])
@pytest.mark.parametrize("drive", [CITY, OPEN_ROAD], ids=["city", "open road"])
def test_with_one_radar_both_levels_react_within_three_ticks(
    drive: tuple[int, str, int], tiers: frozenset[Tier]
) -> None:
    _, same_radar = in_lockstep(*drive)
    pixels, objects = first_events(same_radar, tiers)
    assert abs(pixels - objects) <= 3, (pixels, objects)


@pytest.mark.req("M-3")
@pytest.mark.parametrize("tiers", [TO_A_LEAD, HARD], ids=["any tier", "hard braking"])
@pytest.mark.xfail(
    strict=True,
    raises=AssertionError,
    reason="the object radar spreads its rays over the field, that of the pixel level crowds them "
    "at the axis, so it meets a distant lead more seldom (docs/limits.md)",
)
def test_with_its_own_radar_the_object_level_reacts_within_three_ticks(
    tiers: frozenset[Tier],
) -> None:
    own_radar, _ = in_lockstep(*OPEN_ROAD)
    pixels, objects = first_events(own_radar, tiers)
    assert abs(pixels - objects) <= 3, (pixels, objects)


@pytest.mark.req("M-3")
def test_how_far_apart_the_rays_of_both_radars_are_as_documented() -> None:
    """Share of rays within 3 deg of the axis, of a field of 30 by 30 deg."""
    spec = next(s for s in twelve_sensors() if isinstance(s, RadarSpec))
    spread = np.concatenate([RadarDirections(spec, 1, DT).at(k) for k in range(200)])
    inner = np.mean(np.hypot(*np.tan(spread).T) < np.tan(np.radians(3.0)))
    assert inner == pytest.approx(np.pi * 3.0**2 / 30.0**2, rel=0.1)  # by area: 3 %
    radar = Radar(spec, 1, DT, np.inf)
    view, radii = radar.view(Pose(0.0, 0.0)), []
    for tick in range(200):
        aim(radar._key, tick, *radar._half, view, radar._rays)
        u = (radar._rays.column - view.cx) / view.focal
        v = (radar._rays.row - view.cy) / view.focal
        radii.append(np.hypot(u, v))
    inner = np.mean(np.concatenate(radii) < np.tan(np.radians(3.0)))
    assert inner == pytest.approx(3.0 / 15.0, rel=0.1)  # by radius: 20 %
