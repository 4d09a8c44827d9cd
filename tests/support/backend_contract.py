"""What every backend must do (decision L-4): checks that take a way to make a backend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.frames import Frame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.setup import ActorCommand, ActorSetup, Setup
from skidpad.core.specs import CameraSpec, LidarSpec, PointSensorSpec
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import (
    Control,
    GripModel,
    LightState,
    RangeModel,
    SemanticClass,
    SensorLevel,
)
from skidpad.core.weather import Weather
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import load_map
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.simulation.backend import Backend

Make = Callable[[], Backend]
MAP = load_map("figure8")
assert MAP.ego_start is not None
START = MAP.place(MAP.ego_start)
ALONE = Setup(
    map="figure8",
    weather=Weather(),
    specs=twelve_sensors(),
    ego=ActorSetup(name="ego", type=EGO_TYPE, place=MAP.ego_start, driver=Control.SCRIPTED),
    level=SensorLevel.OBJECTS,
)


def lead(distance: float, kind: str = "hatchback") -> ActorSetup:
    place = MAP.ahead(START, distance)
    assert place is not None
    return ActorSetup(name="lead", type=kind, place=place.pose, driver=Control.SCRIPTED)


def must_be_reset_and_closes_twice(make: Make) -> None:
    backend = make()
    with pytest.raises(BackendError, match="not reset"):
        backend.step(VehicleCommand())
    backend.reset(ALONE, 0)
    backend.close()
    backend.close()
    with pytest.raises(BackendError):
        backend.truth()


def begins_at_its_place_and_follows_commands(make: Make) -> None:
    backend = make()
    frame = backend.reset(ALONE, 0)
    assert frame.tick == 0
    assert (frame.ego.pose.x, frame.ego.pose.y) == pytest.approx((START.x, START.y), abs=0.02)
    assert frame.ego.speed == pytest.approx(0.0, abs=0.05)
    for k in range(60):
        frame = backend.step(VehicleCommand(throttle=0.6))
        assert frame.tick == k + 1 == backend.truth().tick
    assert 5.0 < frame.ego.speed < 20.0
    assert frame.ego.gear >= 1
    assert frame.ego.pose.x - START.x > 5.0
    straight = frame.ego.pose
    for _ in range(20):
        frame = backend.step(VehicleCommand(throttle=0.3, steer=0.05))
    assert frame.ego.yaw_rate > 0.01
    assert frame.ego.pose.yaw > straight.yaw + 0.01
    assert frame.ego.pose.y > straight.y + 0.05
    assert frame.ego.ay > 0.1
    assert backend.truth().commands[0] == pytest.approx((0.3, 0.0, 0.05, 0.0, 0.0))
    backend.close()


def relocates_at_once(make: Make) -> None:
    backend = make()
    backend.reset(ALONE, 0)
    target = MAP.ahead(START, 200.0)
    assert target is not None
    backend.relocate(replace(target.pose, z=target.z + 0.5), 5.5)
    states = backend.truth().states
    assert (states.x[0], states.y[0]) == pytest.approx((target.x, target.y))
    assert states.z[0] == pytest.approx(target.z, abs=0.02)
    frame = backend.step(VehicleCommand())
    assert frame.ego.speed == pytest.approx(5.5, abs=0.3)
    assert frame.invasions == ()
    assert frame.ego.pose.x == pytest.approx(target.x + 5.5 * 0.05, abs=0.05)
    backend.close()


def gives_the_initial_speed(make: Make) -> None:
    backend = make()
    backend.reset(replace(ALONE, ego=replace(ALONE.ego, speed=15.0)), 0)
    assert np.hypot(backend.truth().states.vx[0], backend.truth().states.vy[0]) == pytest.approx(15)
    frame = backend.step(VehicleCommand())
    assert frame.ego.speed == pytest.approx(15.0, abs=0.2)
    backend.close()


def moves_actors_as_told(make: Make) -> None:
    backend = make()
    walker = ActorSetup(
        name="walker",
        type="pedestrian",
        place=replace(START.pose.moved(40.0, 5.0)),
        driver=Control.SCRIPTED,
    )
    backend.reset(replace(ALONE, actors=(lead(30.0), walker)), 0)
    table = backend.truth().table
    row, other = table.names.index("lead"), table.names.index("walker")
    start = backend.truth().states.pose(row)
    backend.step(VehicleCommand(), [ActorCommand("lead", place=start.moved(1.0), speed=20.0)])
    states = backend.truth().states
    assert (states.x[row], states.y[row]) == pytest.approx(
        (start.moved(1.0).x, start.moved(1.0).y), abs=0.05
    )
    assert np.hypot(states.vx[row], states.vy[row]) == pytest.approx(20.0, abs=0.5)
    backend.step(VehicleCommand(), [ActorCommand("lead", command=VehicleCommand(brake=1.0))])
    assert np.hypot(states.vx[row], states.vy[row]) < 20.0
    backend.step(VehicleCommand(), [ActorCommand("walker", place=start.moved(12.0, 3.0))])
    assert states.x[other] == pytest.approx(start.moved(12.0, 3.0).x, abs=0.05)
    backend.step(VehicleCommand(), [ActorCommand("walker", present=False)])
    assert not backend.truth().states.present[other]
    with pytest.raises(ConfigError, match="no actor 'ghost'"):
        backend.step(VehicleCommand(), [ActorCommand("ghost", present=True)])
    backend.close()


def a_contact_begins_once(make: Make) -> None:
    backend = make()
    ego = replace(ALONE.ego, speed=15.0)
    backend.reset(replace(ALONE, ego=ego, actors=(lead(20.0),)), 0)
    events = []
    for _ in range(60):
        events += backend.step(VehicleCommand()).contacts
    assert [e.actor for e in events] == [1]
    assert events[0].impulse > 0.0
    assert events[0].v_closing == pytest.approx(15.0, abs=1.5)
    assert np.hypot(backend.truth().states.vx[1], backend.truth().states.vy[1]) > 1.0
    backend.close()


def drifting_over_a_marking_is_one_invasion(make: Make) -> None:
    backend = make()
    backend.reset(replace(ALONE, ego=replace(ALONE.ego, speed=20.0)), 0)
    events = []
    for k in range(52):
        steer = 0.012 if k < 25 else -0.012
        events += backend.step(VehicleCommand(throttle=0.3, steer=steer)).invasions
    assert [e.marking for e in events] == ["broken"]
    assert events[0].road == START.road
    backend.close()


def delivers_the_twelve_sensors(make: Make) -> None:
    """A-018: sizes and modalities; row 0 is the top: sky above, road below."""
    backend = make()
    setup = replace(ALONE, level=SensorLevel.PIXELS, render_all=True, actors=(lead(25.0),))
    frame = backend.reset(setup, 0)
    assert [s.id for s in setup.specs if isinstance(s, CameraSpec)] == list(frame.images)
    for spec in setup.specs:
        if isinstance(spec, CameraSpec):
            image = frame.images[spec.id]
            arrays = (image.inverse_depth, image.labels, image.rgb)
            there = [a for a in arrays if a is not None]
            assert [a.shape[:2] for a in there] == [(spec.height, spec.width)]
    labels = frame.images["semantic_roof"].labels
    assert labels is not None
    assert (labels[5] == 11).mean() > 0.9
    assert np.isin(labels[-5], (1, 24)).mean() > 0.9
    column = frame.images["depth_roof"].depth()[:, 400]
    gap = 25.0 - 1.5 - 4.3 / 2.0
    assert np.nanmin(np.abs(column - gap)) < 0.3
    frame = backend.step(VehicleCommand())
    assert len(frame.radar.range) > 10
    assert (np.abs(frame.radar.azimuth) <= np.radians(15.1)).all()
    backend.close()


def keeps_no_frame_beyond_its_tick(make: Make) -> None:
    """X-11: an image that nobody read in its tick is gone."""
    backend = make()
    stale = backend.reset(replace(ALONE, level=SensorLevel.PIXELS), 0).images
    backend.step(VehicleCommand())
    with pytest.raises(BackendError, match="valid until the next step"):
        stale["semantic_roof"]
    backend.close()


def gives_the_stack_what_it_asked_for(make: Make) -> None:
    """L-3: by id in `frame.extra`, and right against the truth by a second route."""
    backend = make()
    mount = Pose(0.4, 0.2, 1.8, yaw=0.3)
    specs = (
        PointSensorSpec("gps", "gnss", mount),
        PointSensorSpec("imu", "imu"),
        PointSensorSpec("speed", "speedometer"),
        LidarSpec("lidar", mount, channels=32, range=60.0, points_per_second=300_000),
    )
    ids = [s.id for s in specs]
    setup = replace(
        ALONE,
        specs=(*ALONE.specs, *specs),
        asked=frozenset(ids),
        ego=replace(ALONE.ego, speed=15.0),
        actors=(lead(14.0),),
    )
    frame = backend.reset(setup, 0)
    for _ in range(3):
        backend.step(VehicleCommand(throttle=0.4, steer=0.02))
    before = backend.truth().states.copy()
    frame = backend.step(VehicleCommand(throttle=0.4, steer=0.02))
    assert list(frame.extra) == ids
    now = backend.truth().states
    here = now.pose(0)
    antenna = here.moved(0.4, 0.2)
    fix, radius, (lat, lon) = frame.extra["gps"], 6_378_137.0, (48.1, 11.5)  # of figure8's header
    north = np.radians(fix.latitude - lat) * radius
    east = np.radians(fix.longitude - lon) * radius * np.cos(np.radians(lat))
    assert (east, north) == pytest.approx((antenna.x, antenna.y), rel=1e-3, abs=0.05)
    assert fix.altitude == pytest.approx(here.z + 1.8, abs=0.05)
    felt, dt = frame.extra["imu"], setup.dt
    assert felt.rate[2] == pytest.approx((now.yaw[0] - before.yaw[0]) / dt, abs=0.02)
    change = np.array([now.vx[0] - before.vx[0], now.vy[0] - before.vy[0]]) / dt
    left = np.array([-np.sin(here.yaw), np.cos(here.yaw)])
    assert felt.force[1] == pytest.approx(change @ left, abs=0.4)
    assert np.linalg.norm(felt.force) == pytest.approx(9.81, abs=0.5)
    assert felt.compass == pytest.approx((np.pi / 2 - here.yaw) % (2 * np.pi))
    moved = np.hypot(now.x[0] - before.x[0], now.y[0] - before.y[0])
    assert frame.extra["speed"] == pytest.approx(moved / dt, abs=0.3)
    met = lidar_in_box(backend, frame, setup, mount, 1)
    frame = backend.step(VehicleCommand())  # the other half of a turn
    assert met + lidar_in_box(backend, frame, setup, mount, 1) > 20
    stale = frame.extra
    backend.step(VehicleCommand())
    with pytest.raises(BackendError, match="valid until the next step"):
        stale["gps"]
    backend.close()


def lidar_in_box(backend: Backend, frame: Frame, setup: Setup, mount: Pose, actor: int) -> int:
    """How many returns name the actor; all of them lie on its box, and no others do."""
    points, states = frame.extra["lidar"], backend.truth().states
    assert len(points.xyz) > 1000
    assert {len(column) for column in points} == {len(points.xyz)}
    eye, box = states.pose(0) @ mount, states.pose(actor)
    world = points.xyz @ eye.rotation().T + (eye.x, eye.y, eye.z)
    inside = (world - (box.x, box.y, box.z)) @ box.rotation()
    table = backend.truth().table
    half = np.array([table.length[actor] / 2.0, table.width[actor] / 2.0])
    over = (np.abs(inside[:, :2]) - half).max(axis=1)
    named = points.instance == actor + 1
    assert over[named].max(initial=0.0) < 0.15
    assert not (~named & (over < -0.2) & (inside[:, 2] > 0.4) & (inside[:, 2] < 1.2)).any()
    road = np.isin(points.label, (SemanticClass.ROAD, SemanticClass.ROAD_LINE))
    ground = world[road][::50]
    below = [MAP.project(x, y, z, driving=False) for x, y, z in ground.tolist()]
    apart = [abs(p.z - z) for p, z in zip(below, ground[:, 2], strict=True) if p is not None]
    assert len(apart) > 5
    assert max(apart) < 0.15
    return int(named.sum())


def goes_on_in_another_weather(make: Make) -> None:
    backend = make()
    backend.reset(ALONE, 0)
    for k in range(1, 21):
        if k == 10:
            night = replace(Weather(), sun_altitude_deg=-30.0, precipitation=60.0, wetness=80.0)
            backend.change(Outside(weather=night, grip=GripModel.NONE, range_model=RangeModel.NONE))
        frame = backend.step(VehicleCommand(throttle=0.6))
        assert frame.tick == k
    assert frame.ego.speed > 1.0
    backend.close()


def shows_lights_as_held(make: Make) -> None:
    backend = make()
    backend.reset(ALONE, 0)
    for state in (LightState.GREEN, LightState.YELLOW, LightState.RED):
        id = min(backend.truth().lights)
        backend.change(
            Outside(
                weather=Weather(), grip=GripModel.NONE, range_model=RangeModel.NONE,
                lights=((id, state), (77, state)),
            )
        )  # fmt: skip
        for _ in range(2):  # the server shows it a tick later
            frame = backend.step(VehicleCommand())
        assert frame.lights[id] is backend.truth().lights[id] is state
    backend.close()


CHECKS: tuple[Callable[[Make], None], ...] = (
    must_be_reset_and_closes_twice,
    begins_at_its_place_and_follows_commands,
    relocates_at_once,
    gives_the_initial_speed,
    moves_actors_as_told,
    a_contact_begins_once,
    drifting_over_a_marking_is_one_invasion,
    delivers_the_twelve_sensors,
    keeps_no_frame_beyond_its_tick,
    gives_the_stack_what_it_asked_for,
    goes_on_in_another_weather,
    shows_lights_as_held,
)
