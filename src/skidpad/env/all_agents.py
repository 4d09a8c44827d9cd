"""All vehicles of a map as agents on the one loop: actions in, observations and terms out, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, hypot

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.loop import Script, Timer, Unsupervised
from skidpad.campaign.driving.run_setup import Stage, stage_of
from skidpad.campaign.runs.run import OpenRun
from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import Held, kernel
from skidpad.core.run import RunSpec
from skidpad.core.setup import ActorCommand
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import Control
from skidpad.env.ego import wheel_of, world_of
from skidpad.env.observation import CLOSING, GAP, OBSERVED, Observations, observe
from skidpad.env.reward import CONTACTS, CRITICAL, DISTANCE, OFF, TERMS, WRONG_WAY
from skidpad.env.wheel import ActionStack
from skidpad.evidence.drive.conflict import TTC_CRITICAL
from skidpad.roads.bundled import load_map
from skidpad.simulation.recovery import (
    OFF_ROAD_LIMIT,
    OFF_ROAD_TIME,
    WRONG_WAY_DOT,
    is_past_the_end,
)
from skidpad.simulation.world.actors import cast_of
from skidpad.simulation.world.step import Arena

INSIDE, OUTSIDE, BACKWARDS = 0, 1, 2  # how a vehicle lies on its lane


class Leavers:
    """A script without an end that takes vehicles off the road by their names."""

    def __init__(self) -> None:
        self.ended = False
        self.leaving: list[str] = []

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Returns the commands to vehicles that leave."""
        del truth
        words = [ActorCommand(name, present=False) for name in self.leaving]
        self.leaving.clear()
        return words


class AllAgentsEpisode:
    """The run of an episode in which agents drive all vehicles, and the way back to its first tick.

    Attributes:
        names: of the agents; row i of every array is that of names[i].
        observations: (n, 12) as `observation.OBSERVED`, of the present tick.
        terms: (n, 6) what the last tick added to each of `reward.TERMS`.
        sums: (n, 6) of these since the begin.
        ended: (n,) whose drive has ended: by a contact, off the road, on the wrong way or on its side.
        over: the time is over.
    """

    def __init__(self, spec: RunSpec) -> None:
        self.script = Leavers()
        stage = set_up_agents(spec, self.script)
        self.map = stage.map
        self.run = OpenRun(spec, ActionStack, stage=stage)
        self.run.sense()
        self.wheel, self.begin = wheel_of(self.run), self.run.save()
        world = self.world = world_of(self.run)
        n, self.dt, self.names = world.wheeled, world.dt, world.table.names
        self.observations: Observations = np.zeros((n, len(OBSERVED)), dtype=np.float32)
        self.terms, self.sums = np.zeros((n, len(TERMS))), np.zeros((n, len(TERMS)))
        self.ended = np.zeros(n, dtype=np.bool_)
        self._off = np.zeros(n, dtype=np.int64)  # ticks with all wheels off every lane
        self._last = np.zeros((n, 2))  # lane and m along it, where it was on one
        self._lies = np.zeros(n, dtype=np.int64)
        self._begin()

    def restart(self) -> None:
        """Goes back to the first tick."""
        self.begin.restore(self.run)
        self._begin()

    def _begin(self) -> None:
        """Observes the first tick, in which nothing was driven yet."""
        self.terms[:] = self.sums[:] = 0.0
        self.ended[:], self._off[:], self._last[:] = False, 0, -1
        self.over = False
        observe(self.world.arena, self.observations)

    def step(self, actions: Floats) -> None:
        """Drives one tick. actions: (n, 2) pedal (1 full throttle, -1 full brake) and steer (1 left)."""
        limited = np.clip(actions, -1.0, 1.0)
        self.wheel.action = limited[0].tolist()
        self.run.answer()
        commands = self.world.commands[1 : len(limited)]
        np.maximum(limited[1:, 0], 0.0, out=commands[:, 0])
        np.maximum(-limited[1:, 0], 0.0, out=commands[:, 1])
        commands[:, 2] = limited[1:, 1]
        if not self.run.sense():  # it has answered the last tick, and nothing moves any more
            self.over, self.terms[:] = True, 0.0
            return
        observe(self.world.arena, self.observations)
        self._judge()

    def close(self) -> None:
        """Releases the world of the run."""
        self.run.close()

    def _judge(self) -> None:
        """Fills terms and sums of this tick, and notes whose drive ends in it."""
        assert self.run.stepper is not None
        truth, terms = self.run.stepper.truth, self.terms
        look(self.world.arena, self.observations, self.dt, self._last, self._lies, terms)
        before = self.ended.copy()
        for event in truth.contacts:
            self._touch(0, event.actor)
        for contact in truth.background:
            self._touch(contact.actor, contact.other)
        for i in truth.rolled:
            terms[i, OFF] = 1.0
        for row in np.flatnonzero(self._lies):
            i = int(row)
            if self._lies[i] == BACKWARDS:
                terms[i, WRONG_WAY] = 1.0
            elif self._has_left(i):
                self.ended[i] = True
                terms[i, OFF] = not self._is_past_the_end(i)
        self._off[self._lies == INSIDE] = 0
        terms[before] = 0.0
        self.ended |= (terms[:, CONTACTS : WRONG_WAY + 1] > 0.0).any(axis=1)
        self.sums += terms
        self.script.leaving += [self.names[i] for i in np.flatnonzero(self.ended & ~before)]

    def _touch(self, *rows: int) -> None:
        """Counts a contact of agents; what is no agent has a row below 0, or behind theirs."""
        for i in rows:
            if 0 <= i < len(self.terms):
                self.terms[i, CONTACTS] += 1.0

    def _has_left(self, i: int) -> bool:
        """Returns whether all wheels were off every lane for a second, or the middle is far off (R-6)."""
        s, table, edge = self.world.states, self.world.table, self.map.edge
        x, y, z, yaw = (column[i : i + 1] for column in (s.x, s.y, s.z, s.yaw))
        if not edge.off(x, y, z, yaw, float(table.length[i]), float(table.width[i]))[0]:
            self._off[i] = 0
            return False
        self._off[i] += 1
        far = float(edge.beyond(x, y, z)[0]) > OFF_ROAD_LIMIT
        return far or bool(self._off[i] * self.dt >= OFF_ROAD_TIME)

    def _is_past_the_end(self, i: int) -> bool:
        """Returns whether a vehicle left over the end of the map."""
        lane, s = self._last[i].tolist()
        x, y = float(self.world.states.x[i]), float(self.world.states.y[i])
        return lane >= 0 and is_past_the_end(self.map, x, y, self.map.at(int(lane), s))


def set_up_agents(spec: RunSpec, script: Script) -> Stage:
    """Returns a run's world in which all vehicles begin as ever, and none has a driver of its own.

    script: takes vehicles off the road; the run ends when its time is over.
    """
    stage = stage_of(spec)
    setup = stage.setup
    roles = cast_of(load_map(setup.map), setup, spec.seed)
    actors = tuple(
        replace(role.actor, driver=Control.SCRIPTED) for role in roles[1:] if not role.late
    )
    setup = replace(setup, actors=actors, traffic=None, specs=())
    timer = Timer(round(spec.duration / setup.dt), script)
    return replace(stage, setup=setup, supervisor=Unsupervised(), script=timer)


@kernel
def look(
    arena: Held[Arena],
    seen: Observations,
    dt: float,
    last: Floats,
    lies: NDArray[np.int64],
    terms: Floats,
) -> None:
    """Writes way and time too close into `terms` of each vehicle, 0 into the others.

    Writes how it lies on its lane (INSIDE, OUTSIDE, BACKWARDS), and its place there into `last`.
    """
    rows, lanes, points = arena.value.rows, arena.value.lanes, arena.value.streets.net.point
    for i in range(len(terms)):
        here = rows.placed[i]
        terms[i, :] = 0.0
        lies[i] = INSIDE
        if not here.present:
            continue
        terms[i, DISTANCE] = hypot(here.vx, here.vy) * dt / 1000.0
        if seen[i, GAP] < TTC_CRITICAL * seen[i, CLOSING]:
            terms[i, CRITICAL] = dt
        if here.lane < 0:
            lies[i] = OUTSIDE
            continue
        last[i, 0], last[i, 1] = here.lane, here.s
        turned = cos(here.heading - here.yaw) < WRONG_WAY_DOT
        if turned and lanes.junction[here.lane] < 0:
            lies[i] = BACKWARDS
        elif abs(here.offset) >= points[here.sample].half_width:
            lies[i] = OUTSIDE
        elif here.s <= 0.0 or here.s >= lanes.length[here.lane]:
            lies[i] = OUTSIDE  # before its begin or behind its end, as far as is known
