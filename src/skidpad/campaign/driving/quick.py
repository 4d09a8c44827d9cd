"""The quick way through a run: many ticks of the loop in one compiled call, as long as nothing happens.

`QuickDrive` works beside the `Stepper` of a run and leaves it ready for the next tick: its action, words
and truth are those of the last one. Its frame, the reports of driver and stack, and the supervisor's truth
stay those of the last tick that the stepper drove. Contacts, crossed markings, changes of lights,
departures, an ego that stands without a reason, and vehicles that are put elsewhere end the call; the
stepper then drives that tick. `find_parts` of `quick_parts` says which runs have no quick way.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any, NamedTuple

import numpy as np

from skidpad.campaign.driving.loop import Stepper
from skidpad.campaign.driving.outdoors import FileChanges
from skidpad.campaign.driving.quick_kernel import drive_ticks
from skidpad.campaign.driving.quick_parts import QuickParts, find_parts, make_rules
from skidpad.campaign.driving.quick_tables import (
    ARRIVED,
    DONE,
    MOVED,
    REFUSED,
    STEPPED,
    TOLD,
    UNUSUAL,
    Addresses,
    Joined,
    Request,
    Rules,
    Stop,
    Tables,
)
from skidpad.core.errors import StackError
from skidpad.core.kernels.calls import find_address
from skidpad.core.kernels.jit import Held, hold
from skidpad.core.setup import ActorCommand
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import LightState, Supervision
from skidpad.envelope.govern_kernel import NOTHING_TOLD, find_limits, keep_inside
from skidpad.envelope.sight import Motion
from skidpad.recording.run.ticks import TickArrays, TickLog, copy_actors
from skidpad.scenarios.playing.table import hold_no_story
from skidpad.scenarios.playing.table_kernel import Table, play_tick
from skidpad.sensors.object_level.objects import sense
from skidpad.simulation.recovery import Action, find_ego
from skidpad.simulation.standing import has_reason, stops_of
from skidpad.simulation.world.feel import feel_motion
from skidpad.simulation.world.step import advance
from skidpad.simulation.world.touch import EGO
from skidpad.stack.perception.lights import heed_light
from skidpad.stack.road import read_road
from skidpad.stack.think import think

NO_WAY = np.zeros((0, 3))
STILL = Motion(*(0.0,) * 9, (0.0,) * 4)  # of the type that the envelope's kernels take

Returned = tuple[int, int, int, int, float, float, float, bool, int, float, float, int]


class Call(NamedTuple):
    """A call of `drive_ticks`; whatever makes it hands back what that gives."""

    joined: Held[Joined]
    story: Held[Table] | None  # that the kernel plays
    begun: bool
    tick: int
    n: int
    at: int  # first row in the log
    grace: int
    standing: int
    last: Request


Calls = Generator[Call, Returned, int]  # ends with the ticks that were driven


def make_calls(calls: Calls) -> int:
    """Makes all calls in this process and returns how many ticks were driven."""
    try:
        call = next(calls)
        while True:
            call = calls.send(drive_ticks(*call[:-1], *call.last))
    except StopIteration as end:
        return int(end.value)


class QuickDrive:
    """The quick way of a run for which `find_parts` finds no reason when it begins.

    Attributes:
        reason: the first one for which the stepper drove a tick that was asked for here; "": none.
    """

    def __init__(
        self, stepper: Stepper, parts: QuickParts, log: TickLog, changes: FileChanges | None = None
    ) -> None:
        self.stepper, self.parts, self.log, self.changes = stepper, parts, log, changes
        self.reason = ""
        self._clocks = parts.world.lights.clocks()
        self._stops = stops_of(parts.world.map)
        self._shown: dict[int, LightState] = {}  # of the next two
        self._lines = parts.stack.road.scan.show(self._shown)
        self._lit = self._stops.show(self._shown)
        self._reached = np.zeros(1, dtype=np.int64)
        self._joined: Held[Joined] | None = None
        self._joined_by: Rules | None = None
        self._joined_of: tuple[object, ...] = ()

    def drive(self, most: int) -> Calls:
        """Asks for calls that drive up to `most` ticks; the stepper drives the one after them.

        Ends with how many were driven, 0 where the next tick is the stepper's.
        """
        # anew, as surroundings, functions and random streams may be others since the last call
        found = find_parts(self.stepper, self.changes)
        if isinstance(found, str):
            return self._leave(found)
        self.parts, last = found, self._last_request()
        if isinstance(last, str):
            return self._leave(last)
        timer, driven = found.timer, 0
        if found.governed is not None:
            most = min(most, found.governed.envelope.bus.draw_noise())
        if timer is None:
            driven = self._step_world(most, last)
        elif not timer.ended:
            driven = yield from self._drive_alone(min(most, timer.left), last)
        if driven:
            self.stepper.truth = found.backend.truth()
        elif not self.stepper.script.ended:
            self._leave("something happened in each tick")
        return driven

    @property
    def why_not(self) -> str:
        """Returns the first reason for which the stepper drove a tick."""
        return self.reason or "it was driven tick by tick"

    def _leave(self, reason: str) -> int:
        """Leaves the next tick to the stepper; returns 0, as many as were driven."""
        self.reason = self.reason or reason
        return 0

    def _step_world(self, most: int, last: Request) -> int:
        """Drives ticks in which the world steps here, with its script; the rest of each is one call.

        Where a table holds the story, one call drives on to where it has to be played here.
        """
        stepper, world, script = self.stepper, self.parts.world, self.stepper.script
        arrays, driven, inner = self.log.reserve(1), 0, self.parts.backend
        joined, shown, begun = self._join(arrays), world.lights.by_id, False
        while driven < min(most, arrays.left) and not script.ended:
            assert stepper.action is not None
            begun = begun or self._make_step(stepper.action.command, stepper.words)
            if not (begun and world.events.is_empty and world.lights.by_id is shown):
                stepper.next_frame = inner.read_frame()
                break
            story, n = self._story_ahead(min(most, arrays.left) - driven)
            call = self._describe(joined, story, arrays.at + driven, last, True, n)
            stop = self._note(call, drive_ticks(*call[:-1], *last))
            last, driven = stop.request, driven + stop.ticks
            self._tell(stop.ticks, last)
            begun = stop.why in (MOVED, STEPPED)
            if begun:
                world.finish_step(stop.touches, stop.crossed, settled=stop.why == STEPPED)
            elif stop.why == REFUSED:
                self._refuse(last)
                break
            elif stop.why == UNUSUAL:
                stepper.next_frame = inner.read_frame()
                break
            else:
                stepper.words = script.step(inner.truth())
        return driven

    def _story_ahead(self, most: int) -> tuple[Held[Table] | None, int]:
        """Returns the story that the kernel is given, and how many ticks it may drive with it."""
        if self.parts.changed is None:
            return None, 1
        changes, world = self.parts.changed[1], self.parts.world
        player, is_free = changes.player, self.parts.backend.steps_alone and not world.has_drivers
        if player.table is None or not is_free or changes.depends_on_time:
            return hold_no_story(), 1
        return player.table.held, min(most, player.count_ahead(world.tick))

    def _make_step(self, command: VehicleCommand, words: Sequence[ActorCommand]) -> bool:
        """Steps the world; returns whether no script changes anything in this tick."""
        if self.parts.changed is None:
            self.parts.backend.make_step(command, words)
            return True
        backend, changes = self.parts.changed
        return not backend.make_step(command, words) and changes.is_silent

    def _drive_alone(self, n: int, last: Request) -> Calls:
        """Drives up to n ticks of a run whose world steps in the kernel, too."""
        stepper, world = self.stepper, self.parts.world
        arrays, lights, driven, begun = self.log.reserve(n), world.lights, 0, False
        while driven < n:
            shown = lights.by_id
            joined = self._join(arrays)
            call = self._describe(joined, None, arrays.at + driven, last, begun, n - driven)
            stop = self._note(call, (yield call))
            last, driven = stop.request, driven + stop.ticks
            if stop.why in (MOVED, STEPPED):
                world.finish_step(stop.touches, stop.crossed, settled=stop.why == STEPPED)
                begun = world.events.is_empty and lights.by_id is shown
                if begun:
                    continue
            if stop.why == REFUSED:
                self._refuse(last)
            elif stop.why not in (DONE, ARRIVED):
                stepper.next_frame = self.parts.backend.read_frame()
            break
        self._tell(driven, last)
        if driven:
            stepper.words = ()
        return driven

    def _last_request(self) -> Request | str:
        """Returns what the stack asked for in the last tick; else why it does not drive on as it did."""
        stepper, stack, supervisor = self.stepper, self.parts.stack, self.parts.supervisor
        action = stepper.action
        if action is None or stepper.failure is not None or stepper.next_frame is not None:
            return "the first tick, or one that has begun"
        if action.relocate is not None or action.command.reverse:
            return "the ego is moved, or drives backwards"
        if stack.supervision is not Supervision.NONE or not stack.road.is_traced:
            return "the stack does not drive, or is on no lane"
        if supervisor is not None:
            if supervisor.phase is not Supervision.NONE or supervisor.over:
                return "the supervisor drives"
            if supervisor.first is None:  # only it notes where the ego comes to a lane
                return "the ego has been on no lane yet"
        c = action.command
        return Request(c.throttle, c.brake, c.steer, c.handbrake)

    def _describe(
        self, joined: Held[Joined], story: Held[Table] | None, at: int, last: Request,
        begun: bool, n: int,
    ) -> Call:  # fmt: skip
        """Returns the call that drives up to n ticks.

        at: their first row in the log. begun: the world has made the step of the first one already.
        """
        world, supervisor = self.parts.world, self.parts.supervisor
        grace, stood = (0, 0) if supervisor is None else (supervisor.grace, supervisor.standing)
        way = self.parts.way
        if way is not None:
            self._reached[0] = way.journey.reached
        if n > 1 or self.parts.timer is not None:  # else the world makes its own step
            for kept, new in zip(self._clocks, world.lights.clocks(), strict=True):
                kept[:] = new
        return Call(joined, story, begun, world.tick, n, at, grace, stood, last)

    def _note(self, call: Call, found: Returned) -> Stop:
        """Notes the ticks of a call that are whole."""
        world, supervisor, way = self.parts.world, self.parts.supervisor, self.parts.way
        ticks, why, touches, crossed, throttle, brake, steer, handbrake = found[:8]
        lane, s, offset, standing = found[8:]
        steps = ticks + (why in (UNUSUAL, REFUSED)) - call.begun
        if steps:
            world.pass_ticks(steps)
            world.lights.set_clocks(self._clocks.elapsed)
        if ticks:
            if self.parts.timer is not None:
                self.parts.timer.left -= ticks
            if way is not None:
                way.journey.reached = int(self._reached[0])
                way.ended = way.journey.is_done
            if supervisor is not None:
                supervisor.pass_ticks(ticks, (lane, s, offset), standing)
            if self.parts.changed is not None:  # Python plays the story at the end of a call
                self.parts.changed[1].player.pass_ticks(ticks - (why in (DONE, TOLD)))
        return Stop(ticks, why, touches, crossed, Request(throttle, brake, steer, handbrake))

    def _tell(self, ticks: int, last: Request) -> None:
        """Tells all who look on that kernels drove so many ticks; last: what the stack asked for."""
        if ticks == 0:
            return
        self.stepper.action = Action(VehicleCommand(*last))
        if self.parts.governed is not None:
            self.parts.governed.pass_ticks(ticks, self.stepper.action.command)
        for sink in self.stepper.sinks:
            sink.pass_ticks(ticks)

    def _refuse(self, request: Request) -> None:
        """Ends the run as a command out of range does."""
        if self.parts.governed is not None:
            self.parts.governed.envelope.drop_tick()
        try:
            self.parts.guard.check(VehicleCommand(*request), self.parts.world.tick)
        except StackError as failure:
            self.stepper.failure = failure

    def _join(self, arrays: TickArrays) -> Held[Joined]:
        """Returns what the kernel is given; it is held anew when a part of it is another object."""
        world, suite, stack = self.parts.world, self.parts.suite, self.parts.stack
        road, lights, rules = stack.road, world.lights, make_rules(self.parts, arrays.weather)
        places = NO_WAY if self.parts.way is None else self.parts.way.journey.places
        common = suite.hold_common(world.states)
        assert common is not None, "find_parts has asked for it"
        parts, governed = stack.parts(suite.most_runs, suite.most_points), self.parts.governed
        inside = None if governed is None else governed.envelope.held
        if lights.by_id is not self._shown:
            self._shown = lights.by_id
            self._lines[:] = road.scan.show(self._shown)
            self._lit[:] = self._stops.show(self._shown)
        known = (
            world.arena, world.states, common, road.parts, parts.held, parts.kept, parts.room,
            road.on_highway, arrays.rows, arrays.columns, inside, places,
        )  # fmt: skip
        joined = self._joined
        if joined is None or rules != self._joined_by or not is_same(known, self._joined_of):
            tables = Tables(
                stack.memory, parts.samples, parts.history, parts.kept, road.ways, parts.room,
                road.on_highway, self._lines, arrays.ticks, arrays.rows, *self._clocks,
                self._stops.lane, self._stops.s, self._lit, places, self._reached,
            )  # fmt: skip
            states, map = hold(world.states), world.map.held
            held = states, map, common, road.parts, parts.held, arrays.columns
            at = self._find_addresses(tables, *held, inside)
            joined = hold(Joined(at, rules, tables, world.arena, *held, road.scan.held, inside))
            self._joined, self._joined_by, self._joined_of = joined, rules, known
        return joined

    def _find_addresses(
        self, t: Tables, states: Any, map: Any, common: Any, road: Any, stack: Any, columns: Any,
        inside: Any,
    ) -> Addresses:  # fmt: skip
        """Returns where the machine code of each kernel is for what this run holds."""
        world, lines = self.parts.world, self.parts.stack.road.scan.held
        runs, points = self.parts.suite.sample_arrays()
        pose, way = (0.0, 0.0, 0.0, 0.0, 0.0), (0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
        step = (world.arena, 0, 0, 0.0, 0, 0.0, 0.0)
        steps_here = self.parts.timer is None and self.parts.changed is None
        return Addresses(
            advance=0 if steps_here else find_address(advance, *step),
            feel_motion=find_address(feel_motion, world.arena, EGO),
            sense=find_address(sense, common, map, 0),
            read_road=find_address(read_road, t.memory, road, t.on_highway, t.ways, *pose, True),
            think=find_address(
                think, t.memory, stack, t.samples, t.history, t.kept, t.ways, t.room, *runs, *runs,
                *points, t.on_highway, *pose, True, 0.0, 0.0, 0.0,
            ),
            find_ego=find_address(find_ego, map, states),
            has_reason=find_address(has_reason, map, states, t.stop_lane, t.stop_s, t.shown, 0.0),
            heed_light=find_address(heed_light, t.memory, lines, t.lines, way, False, 0.0, 0.0),
            copy_actors=find_address(copy_actors, states, world.mu, columns, 0),
            find_limits=0 if inside is None else find_address(
                find_limits, inside, *points, STILL, 0.0, 0.0, 0.0, 0, False
            ),
            keep_inside=0 if inside is None else find_address(
                keep_inside, inside, NOTHING_TOLD, 0.0, 0.0, 0.0, 0.0, False
            ),
            play_tick=0 if self.parts.changed is None else find_address(
                play_tick, map, states, hold_no_story(), 0.0, 0.0
            ),
        )  # fmt: skip


def is_same(some: Sequence[object], others: Sequence[object]) -> bool:
    """Returns whether these are the very objects."""
    return all(a is b for a, b in zip(some, others, strict=True))
