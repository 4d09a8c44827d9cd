"""What conditions and actions see while a scenario is played: time, actors, states of its elements."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import cos, hypot, sin
from typing import Protocol

from skidpad.core.geometry import Pose
from skidpad.core.run import ActorMode
from skidpad.core.setup import ActorCommand
from skidpad.core.states import WorldTruth
from skidpad.roads.queries import RoadMap
from skidpad.scenarios.motion import Lane, Track, track_demand
from skidpad.simulation.scripted import ActorDriver, Motion

STANDING = 0.05  # m/s


class State(str, Enum):
    """Life of a storyboard element."""

    STANDBY = "standbyState"
    RUNNING = "runningState"
    COMPLETE = "completeState"


class Running(Protocol):
    """An action under way."""

    def step(self, scene: Scene) -> bool:
        """Go on for one step; True when it is done."""
        ...


@dataclass
class Actor:
    """One entity while the scenario is played."""

    name: str
    row: int
    mode: ActorMode | None  # None: somebody else moves it, the stack under test
    length: float
    motion: Motion
    lane: Lane
    driver: ActorDriver | None  # None: a body without wheels, always ideal
    track: Track | None = None
    longitudinal: Running | None = None  # the newest action of its kind replaces the one before
    lateral: Running | None = None
    present: bool = True
    word: ActorCommand | None = None  # appear or vanish, said once
    travelled: float = 0.0  # m
    stood: float = 0.0  # s

    @property
    def v(self) -> float:
        """Speed over ground, m/s."""
        return hypot(self.motion.vx, self.motion.vy)

    def command(self, t: float, dt: float) -> ActorCommand | None:
        """The word to the backend for the step from t to t + dt."""
        if self.word is not None:
            word, self.word = self.word, None
            return word
        if not self.present or self.mode is None:
            return None
        if self.mode is ActorMode.IDEAL or self.driver is None:
            return self._placed(t + dt, dt)
        if self.track is not None:
            demand = track_demand(self.track, self.motion, t, dt)
        else:
            demand = self.lane.demand(self.motion)
        return ActorCommand(self.name, command=self.driver.command(self.motion, demand))

    def _placed(self, t: float, dt: float) -> ActorCommand:
        if self.track is not None:
            pose, v, _ = self.track.at(t)
        else:
            pose, v = self.lane.ideal(dt), self.lane.v
        return ActorCommand(self.name, place=pose, speed=v)

    def put(self, map: RoadMap, pose: Pose, v: float) -> None:
        """It stands somewhere else from now on."""
        self.lane = Lane(map, pose, v)
        self.track = None
        self.present = True
        self.word = ActorCommand(self.name, place=pose, speed=v)


@dataclass
class Scene:
    """The moment: truth of the world and of the storyboard."""

    map: RoadMap
    dt: float
    actors: dict[str, Actor]
    t: float = 0.0
    states: dict[str, State] = field(default_factory=dict)  # of storyboard elements, by name
    moves: dict[str, str] = field(default_factory=dict)  # transitions of the last step
    contacts: set[str] = field(default_factory=set)  # names that touched the ego so far

    def observe(self, truth: WorldTruth) -> None:
        """Take over positions and velocities of a tick."""
        self.t = truth.tick * self.dt
        s = truth.states
        for actor in self.actors.values():
            i = actor.row
            actor.motion = Motion(
                float(s.x[i]), float(s.y[i]), float(s.yaw[i]), float(s.vx[i]), float(s.vy[i])
            )
            actor.travelled += actor.v * self.dt
            actor.stood = actor.stood + self.dt if actor.v < STANDING else 0.0
        for contact in truth.contacts:
            self.contacts.add(contact.static or truth.table.names[contact.actor])

    def between(self, a: str, b: str) -> tuple[float, float]:
        """Where b lies as seen from a: m forward, m left."""
        from_, to = self.actors[a].motion, self.actors[b].motion
        dx, dy = to.x - from_.x, to.y - from_.y
        c, s = cos(from_.yaw), sin(from_.yaw)
        return dx * c + dy * s, dy * c - dx * s

    def gap(self, a: str, b: str) -> float:
        """Longitudinal distance of a and b without their own lengths, >= 0, in m."""
        forward, _ = self.between(a, b)
        half = 0.5 * (self.actors[a].length + self.actors[b].length)
        return max(abs(forward) - half, 0.0)
