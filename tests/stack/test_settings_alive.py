"""Each setting has a micro-scenario whose outcome changes when it is toggled (decision M-14)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import asin
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from skidpad.campaign.driving.run_setup import recovery_settings, stage_of
from skidpad.campaign.recipes.matrix import metric_settings
from skidpad.campaign.runs.run import run
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.geometry import Pose
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import NAMES, Settings
from skidpad.core.setup import DT
from skidpad.core.specs import LidarSpec
from skidpad.core.states import ContactEvent, VehicleCommand
from skidpad.core.vocabulary import Control, SemanticClass, SensorLevel
from skidpad.core.weather import Weather
from skidpad.evidence.drive.prepared import prepare
from skidpad.recording.run.log_files import log_hash
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.recovery import Supervisor
from skidpad.stack.adas import AdasStack
from support import makelog
from support.runs import adas_run
from support.stackfakes import (
    BUMPER_DEPTH,
    LANE_WIDTH,
    RED,
    ROOF_DEPTH,
    SPECS,
    ArcMap,
    Car,
    as_segments,
    ego_at,
    frame,
)

Outcome = Callable[[Settings], Any]


class Scenario(NamedTuple):
    """Another value of the setting, and what is seen under given settings."""

    other: Any
    outcome: Outcome


# --- settings of the stack: frames in, commands and reports out


def driven(*scene: dict[str, Any], configuration: int = 2, map: ArcMap | None = None, **also: Any):
    """Commands and reports over hand-drawn frames; `also`: settings that the scene needs."""

    def outcome(settings: Settings) -> Any:
        plain = settings.with_values(also).stack.to_plain()
        options = {"configuration": configuration, "set": plain}
        stack = AdasStack(SPECS, map or ArcMap(), options)
        log = []
        for k, fields in enumerate(scene):
            log.append((stack.tick(seen(k, **fields)), stack.report))
        return log

    return outcome


def seen(k: int, near=None, far=None, v=20.0, x=0.0, y=0.0, **fields: Any):
    """A frame; near and far: cars that only the bumper or only the roof sees."""
    picture = frame(k, ego=ego_at(x, y, 0.0, v), **fields)
    if near is None and far is None:
        return picture
    segments = {
        "depth_bumper": as_segments(near or [], BUMPER_DEPTH),
        "depth_roof": as_segments(far or [], ROOF_DEPTH),
    }
    return replace(picture, segments=segments)


def radar(*points: tuple[float, float]):
    """Points at (range, m to the left), slowly closing."""
    return [(r, asin(left / r), 0.0, -3.0) for r, left in points]


def gone(distance: float, missing: int):
    """A car for six ticks, then nothing."""
    return [{"cars": [Car(distance)]}] * 6 + [{}] * missing


PEDESTRIAN = Car(20.0, label=int(SemanticClass.PEDESTRIAN))
LIGHT = ArcMap(lights=((7, 0, 100.0),))
STOP = {"lights": {7: RED}, "x": 99.0, "v": 0.5}
STACK: dict[str, Scenario] = {
    "bumper_depth_fov_deg": Scenario(90.0, lambda s: pictures(s, "clear-noon", "depth_bumper")),
    "roof_corridor": Scenario(
        "flat_without_lca", driven(*[{"cars": [Car(55.0, 2.9)]}] * 5, configuration=1)
    ),
    "bumper_alone": Scenario(False, driven(*[{"near": [Car(20.0)]}] * 5)),
    "detection_gate": Scenario(70.0, driven(*[{"cars": [Car(65.0)]}] * 5)),
    "safety_persist": Scenario(True, driven(*gone(25.0, 40))),
    "radar_close_check": Scenario("nothing", driven({"radar": radar((15.0, 0.0))})),
    "radar_candidates": Scenario(
        "nearest", driven({"radar": radar((30.0, LANE_WIDTH), (50.0, 0.0))})
    ),
    "rejected_stays_active": Scenario(True, driven({"radar": radar((30.0, LANE_WIDTH))})),
    "aeb_without_acc": Scenario(True, driven(*[{"cars": [Car(8.0)]}] * 5, configuration=0)),
    # A target that is not confirmed comes from the safety memory alone.
    "unconfirmed": Scenario("consume", driven(*gone(8.0, 40), safety_persist=True)),
    "targets": Scenario("vehicles", driven(*[{"cars": [PEDESTRIAN]}] * 5)),
    "cruise": Scenario("published", driven({"v": 41.6}, {"v": 41.7})),
    "light_braking": Scenario(
        "proportional",
        driven({"lights": {7: RED}, "x": 60.0, "v": 12.0}, configuration=4, map=LIGHT),
    ),
    "cap_scope": Scenario(
        "cruise", driven(*[{"cars": [Car(59.0)], "v": 22.5}] * 5, configuration=4)
    ),
    "lookahead": Scenario("fixed", driven({"y": 0.5})),
    "route": Scenario(
        "first_branch", driven({"y": LANE_WIDTH}, map=ArcMap(piece=20.0, forks=True))
    ),
    "radar": Scenario(False, driven({"radar": radar((30.0, 0.0))})),
    "radar_corridor": Scenario("parabola", driven({"radar": radar((30.0, 1.7))})),
    "consistency_guard": Scenario(10.0, driven(*[{"near": [Car(20.0)], "far": [Car(50.0)]}] * 5)),
    "rate_filter": Scenario(True, driven(*[{"cars": [Car(30.0)]}] * 8)),
    "follower": Scenario("distance_pid", driven(*[{"cars": [Car(45.0)]}] * 5)),
    "hsv_required": Scenario(
        True, driven({"lights": {7: RED}, "x": 60.0}, configuration=4, map=LIGHT)
    ),
    "resume_end": Scenario(
        "first_curve", driven(STOP, *[{"x": 150.0, "v": 5.0}] * 310, configuration=3, map=LIGHT)
    ),
    "lazy_lookahead": Scenario(12.0, driven({"y": 0.9}, configuration=1)),
    "lazy_dead_band": Scenario(0.4, driven({"y": 0.9}, configuration=1)),
    "lazy_gain": Scenario(0.9, driven({"y": 0.9}, configuration=1)),
    "steer_smoothing": Scenario(True, driven({"y": 0.5})),
}

# --- settings of other houses: their own functions, or a short drive at object level


def cell(settings: Settings, weather: str = "clear-noon", **changes: Any) -> RunSpec:
    return adas_run(2, weather, settings=settings, seed=3, duration=2.0, **changes)


def short_drive(weather: str | Weather) -> Outcome:
    return lambda settings: log_hash(run(cell(settings, weather)).log)


def flooded_drive(settings: Settings) -> str:
    """A short drive with deep water on every road."""
    roads = sorted(set(load_map("figure8").lanes.road.tolist()))
    water = tuple(SurfacePatch(water_mm=2.0, road=road) for road in roads)
    return log_hash(run(cell(settings, surface=water)).log)


def full_brake(settings: Settings) -> float:
    """Speed after a second of full braking on ice."""
    ready = cell(settings, "icy_30")
    setup = stage_of(ready).setup
    backend = EmbeddedBackend()
    backend.reset(replace(setup, ego=replace(setup.ego, speed=15.0)), ready.seed)
    for _ in range(20):
        backend.step(VehicleCommand(brake=1.0))
    states = backend.truth().states
    speed = float(np.hypot(states.vx[0], states.vy[0]))
    backend.close()
    return speed


def swerve(settings: Settings) -> float:
    """Yaw rate after two seconds of much steer and throttle on ice."""
    ready = cell(settings, "icy_30")
    setup = stage_of(ready).setup
    backend = EmbeddedBackend()
    backend.reset(replace(setup, ego=replace(setup.ego, speed=20.0, collides=False)), ready.seed)
    for _ in range(40):
        backend.step(VehicleCommand(throttle=1.0, steer=0.2))
    rate = float(backend.truth().states.yaw_rate[0])
    backend.close()
    return rate


def tight_bend(settings: Settings) -> float:
    """Roll of an ego that is a lorry after three seconds of much steer."""
    ready = cell(settings)
    setup = stage_of(ready).setup
    backend = EmbeddedBackend()
    backend.reset(
        replace(setup, ego=replace(setup.ego, type="truck", speed=20.0, collides=False)), ready.seed
    )
    for _ in range(60):
        backend.step(VehicleCommand(throttle=0.5, steer=0.3))
    roll = float(backend.truth().states.roll[0])
    backend.close()
    return roll


def wet_transition(settings: Settings) -> float:
    """Friction under a car where the superelevation of a motorway passes through low values, in rain."""
    road_map = load_map("motorway")
    bank = np.abs(np.tan(road_map.samples.bank))
    row = int(np.flatnonzero((bank > 0.005) & (bank < 0.01) & on_road(road_map))[0])
    s = road_map.samples
    place = Pose(s.x[row], s.y[row], s.z[row], yaw=s.heading[row])
    ready = cell(settings, "rain-noon")
    setup = stage_of(ready).setup
    ego = replace(setup.ego, place=place, speed=20.0)
    backend = EmbeddedBackend()
    backend.reset(replace(setup, map="motorway", ego=ego, actors=(), traffic=None), ready.seed)
    backend.step(VehicleCommand())
    found = float(backend.truth().mu[0].mean())
    backend.close()
    return found


def on_road(road_map: RoadMap) -> NDArray[np.bool_]:
    """Which samples lie on lanes that can be driven, outside of junctions."""
    lanes = (road_map.arrays.drivable == 1) & (road_map.lanes.junction == -1)
    return lanes[road_map.samples.lane]


def beside_lorry(settings: Settings) -> float:
    """Yaw of a car that rolls beside the front of a lorry for a second."""
    ready = cell(settings)
    setup = stage_of(ready).setup
    place = figure8().place(setup.ego.place)
    ego = replace(setup.ego, place=place.pose, speed=25.0)
    lorry = replace(ego, name="lorry", type="truck", place=place.pose.moved(-4.0, 3.5))
    backend = EmbeddedBackend()
    backend.reset(replace(setup, ego=ego, actors=(lorry,), traffic=None), ready.seed)
    for _ in range(20):
        backend.step(VehicleCommand())
    yaw = float(backend.truth().states.yaw[0])
    backend.close()
    return yaw


def in_wind(**also: Any) -> Outcome:
    """A short drive in a wind."""
    return lambda s: short_drive("rain-noon")(s.with_values({"wind": True, **also}))


def with_radar(settings: Settings) -> str:
    """A short drive with a radar that has noise and clutter."""
    return short_drive("clear-noon")(settings.with_values({"radar_model": "physical"}))


def pictures(settings: Settings, weather: str, *ids: str) -> list[bytes]:
    """What some cameras show at the start."""
    ready = cell(settings, weather, sensors=SensorLevel.PIXELS)
    backend = EmbeddedBackend()
    images = backend.reset(stage_of(ready).setup, ready.seed).images
    found = []
    for name in ids:
        image = images[name]
        channel = next(c for c in (image.rgb, image.inverse_depth, image.labels) if c is not None)
        found.append(np.ascontiguousarray(channel).tobytes())
    backend.close()
    return found


def picture_while_driving(settings: Settings, camera: str = "rgb_front") -> bytes:
    """What a camera shows after half a second at speed in rain."""
    ready = cell(settings, "rain-noon", sensors=SensorLevel.PIXELS)
    setup = stage_of(ready).setup
    backend = EmbeddedBackend()
    backend.reset(replace(setup, ego=replace(setup.ego, speed=25.0)), ready.seed)
    for _ in range(9):
        backend.step(VehicleCommand(throttle=0.5))
    rgb = backend.step(VehicleCommand(throttle=0.5)).images[camera].rgb
    found = np.ascontiguousarray(rgb).tobytes()
    backend.close()
    return found


@cache
def figure8():
    return load_map("figure8")


def lane_friction(settings: Settings) -> float | None:
    """Friction that a map's materials replace, None where they are not read."""
    return stage_of(cell(settings)).setup.material_base


def lidar(settings: Settings) -> bytes:
    """What a lidar that a stack asks for returns in rain at the start."""
    ready = cell(settings, "rain-noon")
    spec = LidarSpec("lidar", Pose(0.0, 0.0, 2.0), range=80.0)
    setup = stage_of(ready).setup
    setup = replace(setup, specs=(*setup.specs, spec), asked=frozenset({"lidar"}))
    backend = EmbeddedBackend()
    found = backend.reset(setup, ready.seed).extra["lidar"].xyz.tobytes()
    backend.close()
    return found


def physical_lidar(weather: str | Weather, **also: Any) -> Outcome:
    """What a physical lidar returns at the start in a weather."""

    def outcome(settings: Settings) -> bytes:
        ready = cell(settings.with_values({"lidar": "physical", **also}), weather)
        spec = LidarSpec("lidar", Pose(0.0, 0.0, 2.0), range=80.0)
        setup = stage_of(ready).setup
        setup = replace(
            setup,
            ego=replace(setup.ego, speed=30.0),
            specs=(*setup.specs, spec),
            asked=frozenset({"lidar"}),
        )
        backend = EmbeddedBackend()
        found = backend.reset(setup, ready.seed).extra["lidar"].xyz.tobytes()
        backend.close()
        return found

    return outcome


def recovery(settings: Settings) -> list[Any]:
    """A contact with a car standing 10 m ahead, until the ego drives again."""
    start = figure8().ahead(figure8().place(figure8().ego_start), 300.0)
    supervisor = Supervisor(figure8(), recovery_settings(settings.traffic), DT)
    table = makelog.actor_table(2)
    poses = [start.pose, start.pose.moved(10.0, 0.0)]
    rows = [{"x": p.x, "y": p.y, "z": p.z, "yaw": p.yaw} for p in poses]
    hit = ContactEvent(0, -1, "guardrail", 1000.0, 5.0, 0.0, 0.0)
    log = []
    for k in range(90):
        contacts = (hit,) if k == 0 else ()
        phase = supervisor.observe(makelog.world(k, rows, table, contacts))
        log.append((phase, supervisor.act(VehicleCommand())))
    return log


def lead_truth(settings: Settings) -> int:
    """Which actor is the true lead when the only car is 30 m behind."""
    start = figure8().ahead(figure8().place(figure8().ego_start), 300.0)
    behind: Pose = figure8().behind(start, 30.0).pose
    rows = [{"x": p.x, "y": p.y, "z": p.z, "yaw": p.yaw} for p in (start.pose, behind)]
    log = makelog.drive(1, lambda _k: rows)
    return int(prepare(log, figure8(), metric_settings(cell(settings))).lead.actor[0])


OTHERS: dict[str, Scenario] = {
    "grip": Scenario("none", short_drive("rain-noon")),
    "range": Scenario("none", lambda s: pictures(s, "rain-noon", "depth_roof", "semantic_roof")),
    "mu_ref": Scenario(0.3, short_drive("clear-noon")),
    "tyres": Scenario("summer_1.6mm", short_drive("icy_30")),
    "tyre_stiffness": Scenario(True, short_drive("rain-noon")),
    "water_drag": Scenario(True, short_drive("rain-noon")),
    "sheet_flow": Scenario(True, wet_transition),
    "lidar": Scenario("physical", lidar),
    "lidar_fog": Scenario("advection", physical_lidar(Weather(fog_density=90.0))),
    "lidar_wet_ground": Scenario(True, physical_lidar("rain-noon")),
    "lidar_dirt": Scenario(0.5, physical_lidar("rain-noon")),
    "lidar_drops_s": Scenario(5.0, physical_lidar("rain-noon")),
    "spray": Scenario(True, physical_lidar("rain-noon")),
    "radar_model": Scenario("physical", short_drive("clear-noon")),
    "radar_multipath": Scenario(True, with_radar),
    "radar_interference": Scenario(0.5, lambda s: stage_of(cell(s)).setup.radar_interference),
    "radar_output": Scenario("tracks", with_radar),
    "lane_material": Scenario(True, lane_friction),
    "esc": Scenario(False, short_drive("icy_30")),
    "anti_lock": Scenario("wheel_speeds", full_brake),
    "stability": Scenario("wheel_speeds", swerve),
    "roll_over": Scenario(True, tight_bend),
    "wakes": Scenario(True, beside_lorry),
    "wind": Scenario(True, short_drive("rain-noon")),
    "wind_speed": Scenario(12.0, in_wind()),
    "wind_direction_deg": Scenario(0.0, in_wind(wind_speed=12.0)),
    "wind_gusts": Scenario(0.3, in_wind(wind_speed=12.0)),
    "camera": Scenario(False, lambda s: pictures(s, "rain-noon", "rgb_front")),
    "camera_haze": Scenario(True, lambda s: pictures(s, "rain-noon", "rgb_front")),
    "camera_exposure": Scenario(True, lambda s: pictures(s, "rain-noon", "rgb_front")),
    "camera_drops": Scenario(True, picture_while_driving),
    "camera_spray": Scenario(True, lambda s: picture_while_driving(s, "rgb_rear")),
    "night_rain": Scenario("rain_only", lambda s: pictures(s, "rain-night", "rgb_front")),
    "headways": Scenario("field", short_drive("clear-noon")),
    "drivers": Scenario(False, short_drive("rain-noon")),
    "drivers_patches": Scenario(True, flooded_drive),
    "initial_limit_kmh": Scenario(30.0, short_drive("clear-noon")),
    "traffic_positions": Scenario("table", short_drive("clear-noon")),
    "relocation": Scenario("standing", recovery),
    "clearance": Scenario("listing", recovery),
    "lane_truth": Scenario("same_road", lead_truth),
}
SCENARIOS = STACK | OTHERS


@pytest.mark.req("M-14")
def test_every_setting_has_a_scenario():
    assert set(SCENARIOS) == set(NAMES)


@pytest.mark.req("M-14", "A-051", "A-058", "A-059", "A-062", "A-082", "A-177")
@pytest.mark.parametrize("name", NAMES)
def test_the_outcome_changes_with_the_setting_and_only_with_it(name):
    other, outcome = SCENARIOS[name]
    default = Settings()
    toggled = default.with_values({name: other})
    assert toggled != default
    first = outcome(default)
    assert first == outcome(default), "the scenario itself is repeatable"
    assert first != outcome(toggled)


@pytest.mark.req("A-013")
@pytest.mark.parametrize("configuration", range(5))
def test_no_configuration_hands_the_ego_to_the_traffic(configuration):
    assert stage_of(adas_run(configuration)).setup.ego.driver is Control.SCRIPTED
