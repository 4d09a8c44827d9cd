"""The recorder of one run: copies each moment into arrays, and nothing more."""

from __future__ import annotations

from dataclasses import fields
from math import nan
from operator import attrgetter
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import SensorFrame
from skidpad.core.kernels.jit import Held, hold, kernel
from skidpad.core.states import ActorStates, ActorTable, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import LightState, Supervision
from skidpad.recording.run.events import (
    Event,
    LightChange,
    MovedOn,
    Notice,
    NoticeSource,
    PutBack,
    Relocation,
    RolledOver,
)
from skidpad.recording.run.log import (
    ActorSeries,
    CommandSeries,
    EgoSeries,
    LogHeader,
    ReportSeries,
    RunLog,
)

REPORT_FIELDS = tuple(f.name for f in fields(StackReport))
read_report = attrgetter(*REPORT_FIELDS)
NO_REPORT = (None,) * len(REPORT_FIELDS)
N_EGO, N_COMMAND, N_REPORT = len(EgoSeries._fields), len(CommandSeries._fields), len(REPORT_FIELDS)
N_ROW = N_EGO + 2 * N_COMMAND + N_REPORT
# where in a row they begin; the estimate is at its beginning
APPLIED, REQUESTED, REPORT = N_EGO, N_EGO + N_COMMAND, N_EGO + 2 * N_COMMAND
TICK, ROW = Struct("3q"), Struct(f"{N_ROW}d")  # a row of each array
GROWTH = 2


class ActorColumns(NamedTuple):
    """The recorder's arrays of n actors over T ticks."""

    actors: NDArray[np.float32]  # (fields of ActorSeries in their order, T, n)
    present: NDArray[np.bool_]  # (T, n)
    mu: NDArray[np.float32]  # (T, n, 4)


class TickArrays(NamedTuple):
    """Where a kernel may write ticks."""

    at: int  # row
    left: int  # how many there are from there on
    weather: int  # number of it
    ticks: NDArray[np.int64]
    rows: NDArray[np.float64]
    columns: Held[ActorColumns]


class TickLog:
    """Collects the ticks of one run; `finish` gives the log as a value."""

    def __init__(
        self, table: ActorTable, header: LogHeader, weather: str = "", capacity: int = 10_000
    ) -> None:
        """capacity: expected number of ticks; more are welcome and cost a copy."""
        self.table, self.header = table, header
        self._n = 0
        n = len(table)
        self._tick = np.zeros((capacity, 3), dtype=np.int64)  # tick, supervision, weather
        self._row = np.full((capacity, N_ROW), np.nan)
        self._actors = np.zeros((len(ActorSeries._fields), capacity, n), dtype=np.float32)
        self._present = np.zeros((capacity, n), dtype=np.bool_)
        self._mu = np.full((capacity, n, 4), np.nan, dtype=np.float32)
        self._events: list[Event] = []
        self._lights: dict[int, LightState] = {}
        self._weathers = [weather]
        self._weather = 0
        self._states: ActorStates | None = None  # those of `_held`
        self._columns = hold(ActorColumns(self._actors, self._present, self._mu))

    def __len__(self) -> int:
        return self._n

    def copy_state(self) -> tuple[Any, ...]:
        """Returns a copy of the ticks and events so far, for a checkpoint."""
        k = self._n
        ticks = self._tick[:k].copy(), self._row[:k].copy(), self._actors[:, :k].copy()
        more = self._present[:k].copy(), self._mu[:k].copy()
        events = self._events.copy(), dict(self._lights), self._weathers.copy(), self._weather
        return (*ticks, *more, *events)

    def copy_place(self) -> tuple[Any, ...]:
        """Returns a state that goes on from here in a log of the later ticks alone."""
        ticks = (a[:0] for a in (self._tick, self._row))
        columns = self._actors[:, :0], self._present[:0], self._mu[:0]
        return (*ticks, *columns, [], dict(self._lights), self._weathers.copy(), self._weather)

    def restore_state(self, state: tuple[Any, ...]) -> None:
        """Takes back what `copy_state` gave."""
        tick, row, actors, present, mu, events, lights, weathers, weather = state
        k = self._n = len(tick)
        self._tick[:k], self._row[:k], self._actors[:, :k] = tick, row, actors
        self._present[:k], self._mu[:k] = present, mu
        self._events, self._lights = events.copy(), dict(lights)
        self._weathers, self._weather = weathers.copy(), weather

    def append(
        self,
        truth: WorldTruth,
        frame: SensorFrame,
        command: VehicleCommand,
        report: StackReport | None,
        supervision: Supervision = Supervision.NONE,
    ) -> None:
        """Copies one moment: `truth` and `frame` of the same tick, and the stack's answer to it."""
        assert truth.tick == frame.tick, "truth and frame must be of one moment"
        k = self._n
        if k == len(self._tick):
            self._grow()
        TICK.pack_into(self._tick.data, k * TICK.size, truth.tick, supervision, self._weather)
        ego = frame.ego
        told = NO_REPORT if report is None else read_report(report)
        ROW.pack_into(
            self._row.data,
            k * ROW.size,
            *(ego.pose.x, ego.pose.y, ego.pose.yaw),
            *(ego.speed, ego.yaw_rate, ego.ax, ego.ay, ego.gear),
            *truth.commands[0].tolist(),
            *(command.throttle, command.brake, command.steer),
            *(command.handbrake, command.reverse),
            *[nan if value is None else value for value in told],
        )
        if truth.states is not self._states:
            self._states, self._held = truth.states, hold(truth.states)
        copy_actors(self._held, truth.mu, self._columns, k)
        if (
            truth.contacts
            or truth.invasions
            or truth.background
            or truth.put_back
            or truth.moved_on
            or truth.rolled
        ):
            self._events += [*truth.contacts, *truth.invasions, *truth.background]
            self._events += [PutBack(truth.tick, actor) for actor in truth.put_back]
            self._events += [MovedOn(truth.tick, actor) for actor in truth.moved_on]
            self._events += [RolledOver(truth.tick, actor) for actor in truth.rolled]
        if truth.lights != self._lights:
            self._note_lights(truth)
        self._n = k + 1

    def reserve(self, ticks: int) -> TickArrays:
        """Returns the arrays, with room for so many more ticks, and the row at which they begin."""
        while self._n + ticks > len(self._tick):
            self._grow()
        return TickArrays(
            self._n, len(self._tick) - self._n, self._weather, self._tick, self._row, self._columns
        )

    def add(self, ticks: int) -> None:
        """Takes in that so many rows were written there."""
        self._n += ticks

    def set_weather(self, slug: str) -> None:
        """Sets the weather from the next moment on (A-217, A-231)."""
        if slug not in self._weathers:
            self._weathers.append(slug)
        self._weather = self._weathers.index(slug)

    def relocated(self, relocation: Relocation) -> None:
        """Adds a move of the ego by the supervisor (A-194)."""
        self._events.append(relocation)

    def notice(self, tick: int, source: NoticeSource, text: str) -> None:
        """Adds something that a reader of the log should know."""
        self._events.append(Notice(tick, source, text))

    def finish(self) -> RunLog:
        """Returns the log so far; arrays are views of the recorder's own until it grows."""
        k = self._n
        columns = self._row[:k].T
        ego, applied, requested, report = np.split(
            columns, np.cumsum([N_EGO, N_COMMAND, N_COMMAND])
        )
        return RunLog(
            header=self.header,
            table=self.table,
            tick=self._tick[:k, 0],
            actors=ActorSeries(*self._actors[:, :k]),
            present=self._present[:k],
            mu=self._mu[:k],
            ego=EgoSeries(*ego),
            applied=CommandSeries(*applied),
            requested=CommandSeries(*requested),
            report=ReportSeries(*report),
            supervision=self._tick[:k, 1],
            weather=self._tick[:k, 2],
            weathers=tuple(self._weathers),
            events=tuple(sorted(self._events, key=lambda e: e.tick)),
        )

    def _note_lights(self, truth: WorldTruth) -> None:
        """Keeps a light change for each signal whose state differs from the tick before."""
        for signal, state in truth.lights.items():
            if self._lights.get(signal) != state:
                self._events.append(LightChange(truth.tick, signal, state))
        self._lights = dict(truth.lights)

    def _grow(self) -> None:
        """Makes the arrays longer, by at least 64 ticks."""
        more = max(64, (GROWTH - 1) * len(self._tick))
        self._tick = np.concatenate([self._tick, np.zeros((more, 3), np.int64)])
        self._row = np.concatenate([self._row, np.full((more, N_ROW), np.nan)])
        n = len(self.table)
        empty = np.zeros((len(self._actors), more, n), np.float32)
        self._actors = np.concatenate([self._actors, empty], axis=1)
        self._present = np.concatenate([self._present, np.zeros((more, n), np.bool_)])
        self._mu = np.concatenate([self._mu, np.full((more, n, 4), np.nan, np.float32)])
        self._columns = hold(ActorColumns(self._actors, self._present, self._mu))


@kernel
def copy_actors(
    states: Held[ActorStates], mu: NDArray[np.float64], columns: Held[ActorColumns], k: int
) -> None:
    """Writes row k of every actor into the columns; mu: (n, 4)."""
    s, c = states.value, columns.value
    for i in range(len(s.x)):
        c.actors[0, k, i], c.actors[1, k, i], c.actors[2, k, i] = s.x[i], s.y[i], s.z[i]
        c.actors[3, k, i], c.actors[4, k, i], c.actors[5, k, i] = s.yaw[i], s.vx[i], s.vy[i]
        c.actors[6, k, i], c.actors[7, k, i], c.actors[8, k, i] = s.yaw_rate[i], s.ax[i], s.ay[i]
        c.present[k, i] = s.present[i]
        for wheel in range(4):
            c.mu[k, i, wheel] = mu[i, wheel]
