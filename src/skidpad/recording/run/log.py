"""The log of one run as a value: everything a metric may look at (A-260, decision L-6).

Row k is one moment: the world at `tick[k]`, what the ego's sensors said of it, and what the stack
answered. World frame, ISO 8855, SI. In the arrays here NaN means absent; in the file it is null.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Floats32, Ints
from skidpad.core.states import ActorTable, ContactEvent, LaneInvasion, TrafficContact
from skidpad.recording.run.events import (
    Event,
    LightChange,
    MovedOn,
    Notice,
    PutBack,
    Relocation,
    RolledOver,
)


class ActorSeries(NamedTuple):
    """Motion of n actors over T ticks, arrays (T, n); column 0 is the ego."""

    x: Floats32  # m, world frame, centre of the footprint
    y: Floats32  # m, world frame, centre of the footprint
    z: Floats32  # m, height of the road there
    yaw: Floats32  # rad, counter-clockwise from the x-axis
    vx: Floats32  # m/s, world frame
    vy: Floats32  # m/s, world frame
    yaw_rate: Floats32  # rad/s, left positive
    ax: Floats32  # m/s^2, along the body, forward
    ay: Floats32  # m/s^2, across the body, left


class EgoSeries(NamedTuple):
    """What localisation and the ego's own sensors said, arrays (T,)."""

    x: Floats  # m, world frame, as localisation says
    y: Floats  # m, world frame, as localisation says
    yaw: Floats  # rad, as localisation says
    speed: Floats  # m/s, along the body, negative in reverse
    yaw_rate: Floats  # rad/s, left positive
    ax: Floats  # m/s^2, forward
    ay: Floats  # m/s^2, left
    gear: Floats  # -1 reverse, 0 neutral, 1 and up forward


class CommandSeries(NamedTuple):
    """Commands, arrays (T,); booleans as 0 and 1."""

    throttle: Floats  # 0 to 1
    brake: Floats  # 0 to 1
    steer: Floats  # -1 to 1, left positive
    handbrake: Floats  # whether it is pulled
    reverse: Floats  # whether reverse gear is asked for


class ReportSeries(NamedTuple):
    """The stack's report, arrays (T,), NaN where it said nothing; fields of `core.StackReport`."""

    status: Floats
    tier: Floats
    detected: Floats
    distance: Floats
    time_gap: Floats
    bumper: Floats
    roof: Floats
    fused: Floats
    radar_pre: Floats
    radar_lane: Floats
    radar_velocity: Floats
    radar_points: Floats
    v_target: Floats
    light_distance: Floats
    light_state: Floats
    light_source: Floats
    light_stop: Floats
    hsv: Floats
    lane_offset: Floats
    yaw_error: Floats
    curvature: Floats
    resume_timer: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class LogHeader:
    """What holds for the whole run. `about` says which run it is: config, seed, profile, ..."""

    map: str
    map_hash: str
    dt: float  # s
    about: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RunLog:
    """One run, T ticks and n actors."""

    header: LogHeader
    table: ActorTable
    tick: Ints  # (T,) number of the tick
    actors: ActorSeries
    present: NDArray[np.bool_]  # (T, n) whether the actor is in the world, the ego first
    mu: Floats32  # (T, n, 4) friction at the tyres FL, FR, RL, RR of each actor; NaN where there is none
    ego: EgoSeries
    applied: CommandSeries  # what drove the ego into this moment
    requested: CommandSeries  # what the stack asked for in answer to it
    report: ReportSeries
    supervision: Ints  # (T,) phase of the supervisor
    weather: Ints  # (T,) index into the weathers that the footer lists
    weathers: tuple[str, ...]  # slugs
    events: tuple[Event, ...]  # in order of ticks

    def __len__(self) -> int:
        return len(self.tick)

    def __repr__(self) -> str:
        return (
            f"<RunLog: {len(self)} ticks of {self.header.dt:g} s, {len(self.table)} actors, "
            f"{len(self.contacts)} contacts of the ego>"
        )

    @property
    def t(self) -> Floats:
        """Returns (T,) s of simulated time."""
        return np.asarray(self.tick * self.header.dt, dtype=np.float64)

    @property
    def v_ego(self) -> Floats:
        """Returns (T,) m/s, the true speed of the ego over ground."""
        v: Floats = np.hypot(self.actors.vx[:, 0], self.actors.vy[:, 0]).astype(np.float64)
        return v

    @property
    def contacts(self) -> tuple[ContactEvent, ...]:
        """Returns the contacts of the ego in order of time."""
        return tuple(e for e in self.events if isinstance(e, ContactEvent))

    @property
    def background(self) -> tuple[TrafficContact, ...]:
        """Returns the contacts among background vehicles in order of time."""
        return tuple(e for e in self.events if isinstance(e, TrafficContact))

    @property
    def put_back(self) -> tuple[PutBack, ...]:
        """Returns the vehicles of the background that were put elsewhere."""
        return tuple(e for e in self.events if isinstance(e, PutBack))

    @property
    def moved_on(self) -> tuple[MovedOn, ...]:
        """Returns the vehicles of the background that were moved from afar to near the ego."""
        return tuple(e for e in self.events if isinstance(e, MovedOn))

    @property
    def roll_overs(self) -> tuple[RolledOver, ...]:
        """Returns the vehicles, the ego too, that came to lie on their side."""
        return tuple(e for e in self.events if isinstance(e, RolledOver))

    @property
    def invasions(self) -> tuple[LaneInvasion, ...]:
        """Returns the markings that the ego's outline crossed."""
        return tuple(e for e in self.events if isinstance(e, LaneInvasion))

    @property
    def relocations(self) -> tuple[Relocation, ...]:
        """Returns the moves of the ego by the supervisor."""
        return tuple(e for e in self.events if isinstance(e, Relocation))

    @property
    def lights(self) -> tuple[LightChange, ...]:
        """Returns the changes of traffic lights in order of time."""
        return tuple(e for e in self.events if isinstance(e, LightChange))

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Returns what stack, supervisor, traffic and scenario had to say."""
        return tuple(e for e in self.events if isinstance(e, Notice))
