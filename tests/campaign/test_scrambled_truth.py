"""A driver knows what its sensors measured: all else of the world may be anything."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import replace
from types import BuiltinFunctionType, FunctionType, ModuleType

import numpy as np
import pytest

from skidpad.campaign.channels.drive import Crew
from skidpad.campaign.channels.world import segment_of
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.stack_at_wheel import StackAtWheel, with_sensors
from skidpad.core.courses import Roads
from skidpad.core.geometry import Pose
from skidpad.core.run import RunSpec, StackDriver
from skidpad.core.specs import EyesSpec, LidarSpec
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel, TrafficStart
from skidpad.roads.queries import RoadMap
from skidpad.sensors.requested import AskedSensors
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.world.world import World
from skidpad.stack.loading import GuardedStack
from support.runs import segment_run

REACH = 165.0  # m, beyond which no sensor of the listening stack measures: its radar reaches 150 m
NEAR = 60.0  # m, within which it minds what its eyes see, of a moment ago


class Listening:
    """A stack of a user: each reading of its sensors changes its commands."""

    def __init__(self, specs, map, settings):
        self.turn = 0.0

    def sensors(self):
        """What it asks for."""
        return LidarSpec(
            "roof", Pose(0.0, 0.0, 1.9), range=60.0, points_per_second=20_000
        ), EyesSpec("eyes")

    def tick(self, frame):
        """A command that a change of any reading would change."""
        points, view, radar = frame.extra["roof"], frame.extra["eyes"], frame.radar
        heard = [points.xyz.sum(), radar.range.sum(), radar.velocity.sum(), frame.ego.speed]
        near = np.hypot(view.actors.x - view.pose.x, view.actors.y - view.pose.y) < NEAR
        heard += [view.actors.x[near].sum(), view.actors.vx[near].sum()]
        self.turn = (self.turn + float(np.sum(heard))) % 1.0
        return VehicleCommand(throttle=0.3 + 0.2 * self.turn, steer=0.01 * (self.turn - 0.5))


class ScrambledBackend(EmbeddedBackend):
    """Measures in a world in which all that `hide` names is somewhere else, or is not there."""

    hide: Callable[[], np.ndarray]  # (n,) of the actors whose truth is scrambled

    def _frame(self):
        world, rng = self.world, np.random.default_rng(self.world.tick)
        true = world.states
        world.states = scrambled = true.copy()
        out = self.hide()
        out[0] = False
        for field in (scrambled.x, scrambled.y, scrambled.yaw, scrambled.vx, scrambled.vy):
            field[out] += rng.uniform(3000.0, 9000.0, int(out.sum()))
        scrambled.present[out] = rng.random(int(out.sum())) < 0.5
        self.scrambled = int(out.sum())
        frame = super()._frame()
        world.states = true
        return frame


def drive_both(setup, seed, drivers, hide, ticks, words=lambda truth: ()):
    """Drives two worlds in step; returns the commands of both, and how many states were scrambled."""
    true, other = EmbeddedBackend(), ScrambledBackend()
    other.hide = lambda: hide(true)
    frames = [true.reset(setup, seed), other.reset(setup, seed)]
    commands, count = [], 0
    for _ in range(ticks):
        both = [driver.act(frame) for driver, frame in zip(drivers, frames, strict=True)]
        commands.append(both)
        count += other.scrambled
        said = words(true.truth())
        frames = [b.step(c, said) for b, c in zip((true, other), both, strict=True)]
    return commands, count


def drive_listening(reach, ticks):
    """Drives the stack of a user; what is beyond `reach` m of the ego is scrambled."""

    def far_actors(backend):
        s = backend.world.states
        return np.hypot(s.x - s.x[0], s.y - s.y[0]) > reach

    spec = RunSpec(
        driver=StackDriver("x:Listening"), sensors=SensorLevel.OBJECTS,
        course=Roads(vehicles=40, map="town", traffic=TrafficStart.RANDOM, allow_fewer=True),
    )  # fmt: skip
    stage = stage_of(spec)
    stacks = [GuardedStack(Listening, stage.setup.specs, stage.map, {}) for _ in range(2)]
    drivers = [StackAtWheel(stack) for stack in stacks]
    return drive_both(with_sensors(stage.setup, stacks[0]), 1, drivers, far_actors, ticks)


@pytest.mark.req("A-014")
def test_a_stack_of_a_user_drives_alike_where_all_that_it_cannot_sense_is_scrambled():
    commands, count = drive_listening(REACH, 100)
    assert count > 100
    assert all(a == b for a, b in commands)
    assert len({a.steer for a, _ in commands}) > 50


def test_scrambling_what_is_sensed_changes_the_commands():
    """The comparison sees what it should."""
    commands, _ = drive_listening(5.0, 90)
    assert any(a != b for a, b in commands)


def unseen_by_channels(backend):
    """(n,) actors that no channel sees in this cycle."""
    suites = [observe.__self__._suite for observe in backend._asked.observers]
    return ~np.any([suite.visible for suite in suites], axis=0)


@pytest.mark.req("A-014")
def test_channels_drive_alike_where_all_that_they_cannot_see_is_scrambled():
    spec = segment_run()
    crews = [Crew(spec, segment_of(spec)) for _ in range(2)]
    specs = crews[0].sensors()
    asked = frozenset(channel.id for channel in specs)
    setup = replace(crews[0].segment.setup, specs=specs, asked=asked)
    commands, count = drive_both(setup, spec.seed, crews, unseen_by_channels, 100)
    assert count > 100
    assert all(a == b for a, b in commands)
    assert any(a.throttle > 0.0 for a, _ in commands)
    for mine, its in zip(crews[0].frames, crews[1].frames, strict=True):
        assert repr(mine) == repr(its)


def reachable(root, limit=200_000):
    """All objects that attributes and containers of `root` lead to; code and types lead nowhere."""
    seen, todo = {}, [root]
    while todo and len(seen) < limit:
        thing = todo.pop()
        if id(thing) in seen or isinstance(thing, (type, ModuleType, BuiltinFunctionType)):
            continue
        seen[id(thing)] = thing
        if isinstance(thing, FunctionType):
            todo += [cell.cell_contents for cell in thing.__closure__ or ()]
            continue
        todo += gc.get_referents(thing)
    return seen.values()


def test_readings_lead_to_no_object_of_the_world():
    spec = segment_run()
    crew = Crew(spec, segment_of(spec))
    specs = crew.sensors()
    setup = replace(
        crew.segment.setup, specs=specs, asked=frozenset(channel.id for channel in specs)
    )
    backend = EmbeddedBackend()
    frame = backend.reset(setup, spec.seed)
    crew.act(frame)  # readings are there
    wrong = (World, RoadMap, AskedSensors, type(backend.world.states))
    found = [thing for thing in reachable(frame.extra) if isinstance(thing, wrong)]
    assert not found, {type(thing) for thing in found}
    assert any(isinstance(thing, AskedSensors) for thing in reachable(backend))  # it would be found
