"""The embedded backend: determinism, fresh resets, scripted actors, overpass, events."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorCommand, ActorSetup, Setup, TrafficSetup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control, SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import load_map
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.world.interventions import set_grounded

MAP = load_map("figure8")
assert MAP.ego_start is not None
EGO = ActorSetup(name="ego", type=EGO_TYPE, place=MAP.ego_start, driver=Control.SCRIPTED)
START = MAP.place(MAP.ego_start)
SETUP = Setup(
    map="figure8",
    weather=Weather(),
    specs=twelve_sensors(),
    ego=EGO,
    traffic=TrafficSetup(),
    level=SensorLevel.OBJECTS,
)
ALONE = replace(SETUP, traffic=None)
GO = VehicleCommand(throttle=0.5)


def trace(backend: EmbeddedBackend, setup: Setup, seed: int, ticks: int = 120) -> str:
    """Hex of all states and radar points over a drive."""
    import hashlib

    digest = hashlib.sha256()
    frame = backend.reset(setup, seed)
    for _ in range(ticks):
        for column in (*backend.truth().states, *frame.radar):
            digest.update(column.tobytes())
        frame = backend.step(GO)
    return digest.hexdigest()


@pytest.mark.req("X-8", "X-12")
def test_a_used_backend_repeats_what_a_fresh_one_does() -> None:
    used = EmbeddedBackend()
    trace(used, SETUP, seed=7, ticks=30)
    first = trace(used, SETUP, seed=3)
    assert first == trace(EmbeddedBackend(), SETUP, seed=3)
    assert first != trace(EmbeddedBackend(), SETUP, seed=4)


def test_readings_without_sensors_are_empty_and_stay_so() -> None:
    frame = EmbeddedBackend().reset(replace(ALONE, specs=()), 1)
    assert not frame.images
    assert not frame.segments
    assert [(len(column), column.dtype) for column in frame.radar] == [(0, np.float32)] * 4
    with pytest.raises(TypeError):
        frame.segments["depth_roof"] = None  # type: ignore[index]


@pytest.mark.req("X-8", "X-12")
def test_another_process_gives_the_same_bytes() -> None:
    program = (
        "import sys, json; sys.path.insert(0, sys.argv[1]);"
        "from tests.simulation.embedded.test_engine import *;"
        "print(json.dumps(trace(EmbeddedBackend(), SETUP, 3)))"
    )
    root = str(__import__("pathlib").Path(__file__).parents[3])
    out = subprocess.run(
        [sys.executable, "-c", program, root], capture_output=True, text=True, check=True, cwd=root
    )
    assert json.loads(out.stdout) == trace(EmbeddedBackend(), SETUP, 3)


@pytest.mark.req("M-2")
def test_a_seed_varies_gaps_and_light_phases() -> None:
    backend = EmbeddedBackend()
    backend.reset(SETUP, 1)
    x, lights = backend.truth().states.x.copy(), backend.world.lights.by_row.copy()
    phases = [lights]
    for seed in range(2, 8):
        backend.reset(SETUP, seed)
        phases.append(backend.world.lights.by_row.copy())
    moved = np.abs(backend.truth().states.x - x)
    assert moved[0] == 0.0
    assert 0.0 < moved[1:].max() <= 6.5
    assert len({p.tobytes() for p in phases}) > 1


def test_a_backend_must_be_reset_first_and_closes_twice() -> None:
    backend = EmbeddedBackend()
    with pytest.raises(BackendError, match="not reset"):
        backend.step(GO)
    backend.reset(ALONE, 0)
    backend.close()
    backend.close()
    with pytest.raises(BackendError):
        backend.truth()


def test_the_ego_follows_its_commands_and_wheels_turn() -> None:
    backend = EmbeddedBackend()
    backend.reset(ALONE, 0)
    for _ in range(100):
        frame = backend.step(VehicleCommand(throttle=1.0))
    assert 10.0 < frame.ego.speed < 45.0
    assert frame.ego.gear >= 2
    assert frame.ego.wheel_speeds == pytest.approx([frame.ego.speed] * 4, rel=0.1)
    travelled = frame.ego.pose.x - START.x, frame.ego.pose.y - START.y
    assert np.hypot(*travelled) > 20.0


def test_relocation_takes_place_and_speed_at_once() -> None:
    backend = EmbeddedBackend()
    backend.reset(ALONE, 0)
    target = MAP.ahead(START, 200.0)
    assert target is not None
    backend.relocate(replace(target.pose, z=target.z + 0.5), 5.5)
    truth = backend.truth()
    assert (truth.states.x[0], truth.states.y[0]) == (target.x, target.y)
    assert truth.states.z[0] == pytest.approx(target.z, abs=0.02)
    frame = backend.step(VehicleCommand())
    assert frame.ego.speed == pytest.approx(5.5, abs=0.3)
    assert frame.invasions == ()


def lead_at(distance: float, kind: str = "hatchback", speed: float = 0.0) -> ActorSetup:
    place = MAP.ahead(START, distance)
    assert place is not None
    return ActorSetup(
        name="lead", type=kind, place=place.pose, speed=speed, driver=Control.SCRIPTED
    )


@pytest.mark.req("A-029")
@pytest.mark.parametrize("kind", ["hatchback", "pedestrian", "box"])
def test_a_contact_begins_once_and_pushes_both(kind: str) -> None:
    backend = EmbeddedBackend()
    backend.reset(replace(ALONE, ego=replace(EGO, speed=15.0), actors=(lead_at(20.0, kind),)), 0)
    events = []
    for _ in range(60):
        events += backend.step(VehicleCommand()).contacts
    assert len([e for e in events if e.actor == 1]) == 1
    assert events[0].v_closing == pytest.approx(15.0, abs=1.5)
    assert events[0].impulse > 0.0
    assert np.hypot(backend.truth().states.vx[1], backend.truth().states.vy[1]) > 1.0


@pytest.mark.req("M-12")
def test_cars_that_cross_on_two_levels_do_not_touch() -> None:
    backend = EmbeddedBackend()
    backend.reset(replace(ALONE, ego=replace(EGO, speed=15.0), actors=(lead_at(20.0),)), 0)
    above = backend.truth().states.pose(1)
    hold = ActorCommand("lead", place=replace(above, z=above.z + 8.0), speed=0.0)
    set_grounded(backend.world, 1, False)  # the car above keeps its height without a bridge
    for _ in range(60):
        backend.world.states.z[1] = above.z + 8.0
        frame = backend.step(VehicleCommand(), [hold])
        assert frame.contacts == ()
    assert backend.truth().states.x[0] != pytest.approx(above.x, abs=1.0)


def test_players_move_actors_by_place_command_and_presence() -> None:
    backend = EmbeddedBackend()
    backend.reset(
        replace(
            ALONE,
            actors=(
                lead_at(30.0),
                ActorSetup(
                    name="walker",
                    type="pedestrian",
                    place=Pose(START.x + 40.0, START.y + 5.0),
                    driver=Control.SCRIPTED,
                ),
            ),
        ),
        0,
    )
    start = backend.truth().states.pose(1)
    backend.step(VehicleCommand(), [ActorCommand("lead", place=start.moved(1.0), speed=20.0)])
    states = backend.truth().states
    assert (states.x[1], states.y[1]) == pytest.approx((start.moved(1.0).x, start.moved(1.0).y))
    assert np.hypot(states.vx[1], states.vy[1]) == pytest.approx(20.0)
    backend.step(VehicleCommand(), [ActorCommand("lead", command=VehicleCommand(brake=1.0))])
    assert np.hypot(states.vx[1], states.vy[1]) < 20.0
    backend.step(VehicleCommand(), [ActorCommand("walker", present=False)])
    assert not backend.truth().states.present[2]
    with pytest.raises(ConfigError, match="no actor 'ghost'"):
        backend.step(VehicleCommand(), [ActorCommand("ghost", present=True)])


@pytest.mark.req("A-030")
def test_drifting_over_a_marking_is_one_invasion() -> None:
    backend = EmbeddedBackend()
    backend.reset(replace(ALONE, ego=replace(EGO, speed=20.0)), 0)
    events = []
    for k in range(50):
        steer = 0.012 if k < 25 else -0.012
        events += backend.step(VehicleCommand(throttle=0.3, steer=steer)).invasions
    assert [e.marking for e in events] == ["broken"]
    assert events[0].road == START.road


def test_patches_are_felt_wheel_by_wheel() -> None:
    icy = SurfacePatch(friction=0.1, road=START.road, lane=START.lane_id, side="right")
    backend = EmbeddedBackend()
    backend.reset(replace(ALONE, ego=replace(EGO, speed=10.0), patches=(icy,)), 0)
    backend.step(VehicleCommand())
    mu = backend.truth().mu[0]
    assert mu[[1, 3]] == pytest.approx(0.1 * mu[[0, 2]])
    with pytest.raises(ConfigError, match=r"patches\[0\]"):
        backend.reset(replace(ALONE, patches=(SurfacePatch(friction=0.5, road=999),)), 0)


@pytest.mark.req("A-208")
def test_bad_setups_name_the_field() -> None:
    backend = EmbeddedBackend()
    with pytest.raises(ConfigError, match="actor type"):
        backend.reset(replace(ALONE, actors=(replace(lead_at(20.0), type="tank"),)), 0)
    with pytest.raises(ConfigError, match="different names"):
        backend.reset(replace(ALONE, actors=(replace(lead_at(20.0), name="ego"),)), 0)
    with pytest.raises(ConfigError, match="holds 20 of 30"):
        backend.reset(replace(SETUP, traffic=TrafficSetup(vehicles=30)), 0)


def test_who_appears_looking_elsewhere_does_not_spin() -> None:
    backend = EmbeddedBackend()
    late = ActorSetup(
        name="late",
        type=EGO_TYPE,
        place=START.pose.moved(40.0),
        driver=Control.SCRIPTED,
        present=False,
    )
    backend.reset(replace(ALONE, actors=(late,)), 0)
    assert not backend.truth().states.present[1]
    there = START.pose.moved(60.0)
    place = replace(there, yaw=there.yaw + 3.0)
    backend.step(VehicleCommand(), [ActorCommand("late", place=place, speed=20.0, present=True)])
    assert backend.truth().states.present[1]
    assert backend.truth().states.yaw_rate[1] == pytest.approx(0.0, abs=1e-6)
