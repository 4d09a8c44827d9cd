"""A world without physics, in which everything is where its scenario says: the file by itself.

For trajectories as the file means them, for comparing with other players, and for trying thousands
of files.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import copysign, cos, hypot, sin

import numpy as np

from skidpad.core.courses import ActorMode
from skidpad.core.geometry import Pose
from skidpad.core.setup import DT, ActorCommand
from skidpad.core.states import ActorStates, ActorTable, WorldTruth
from skidpad.core.vocabulary import ActorKind
from skidpad.recording.files import csv_text
from skidpad.scenarios.playing.player import Player, setups
from skidpad.scenarios.reading.entities import Body
from skidpad.scenarios.scenario import Scenario

KINDS = {
    Body.VEHICLE: ActorKind.CAR,
    Body.PEDESTRIAN: ActorKind.PEDESTRIAN,
    Body.PROP: ActorKind.PROP,
}


@dataclass(frozen=True, slots=True)
class Row:
    """One entity at one time; the place of its reference point."""

    time: float  # s, since the start
    id: int  # index of the entity
    name: str  # name of the entity
    x: float  # m, world frame
    y: float  # m, world frame
    z: float  # m, world frame
    h: float  # rad, heading
    speed: float  # m/s, over ground, negative backwards


@dataclass(frozen=True, slots=True)
class PlayedScenario:
    """A scenario played by itself: where everything was, and the player at the end."""

    rows: tuple[Row, ...]
    player: Player

    def of(self, name: str) -> list[Row]:
        """Returns the rows of one entity."""
        return [row for row in self.rows if row.name == name]

    def csv(self) -> str:
        """Returns the rows as CSV with the columns time,id,name,x,y,z,h,speed."""
        return rows_csv(self.rows)


def rows_csv(rows: Iterable[Row]) -> str:
    """Returns rows as CSV with the columns time,id,name,x,y,z,h,speed."""
    cells = (
        (f"{r.time:.3f}", r.id, r.name, *(f"{v:.4f}" for v in (r.x, r.y, r.z, r.h, r.speed)))
        for r in rows
    )
    return csv_text(Row.__dataclass_fields__, cells)


class IdealWorld:
    """The world: it does as it is told."""

    def __init__(self, scenario: Scenario) -> None:
        ego, others = setups(scenario)
        actors = [ego, *others]
        self.tick, n = 0, len(actors)
        entities = [scenario.entities[a.name] for a in actors]
        self.table = ActorTable(
            names=tuple(a.name for a in actors),
            types=tuple(a.type for a in actors),
            kind=np.array([KINDS[e.body] for e in entities], np.uint8),
            length=np.array([e.box.length for e in entities]),
            width=np.array([e.box.width for e in entities]),
            height=np.array([e.box.height for e in entities]),
            rgb=np.zeros((n, 3), np.uint8),
        )
        self.index = {a.name: i for i, a in enumerate(actors)}
        self.states = ActorStates.empty(n)
        self.mu, self.commands = np.ones((n, 4)), np.zeros((n, 5))
        for actor in actors:
            assert isinstance(actor.place, Pose)
            self._apply_command(ActorCommand(actor.name, place=actor.place, speed=actor.speed))
            self.states.present[self.index[actor.name]] = actor.present

    def _apply_command(self, word: ActorCommand) -> None:
        """Sets presence, pose and velocity of the commanded actor, exactly as commanded."""
        i, s = self.index[word.actor], self.states
        if word.present is not None:
            s.present[i] = word.present
        if word.place is None:
            return
        v, yaw = word.speed or 0.0, word.place.yaw
        s.x[i], s.y[i], s.z[i], s.yaw[i] = word.place.x, word.place.y, word.place.z, yaw
        s.vx[i], s.vy[i] = v * cos(yaw), v * sin(yaw)
        s.present[i] = True

    def step(self, words: Sequence[ActorCommand]) -> None:
        """Moves the actors on by one tick, exactly as commanded."""
        self.tick += 1
        for word in words:
            self._apply_command(word)

    def truth(self) -> WorldTruth:
        """Returns the true world at this tick."""
        return WorldTruth(self.tick, self.table, self.states, self.mu, self.commands, {}, (), ())


def play_ideal(
    scenario: Scenario,
    duration: float,
    dt: float = DT,
    seed: int = 0,
    *,
    ends_with_acts: bool = True,
) -> PlayedScenario:
    """Plays a scenario with every entity exactly where the file puts it, for `duration` s at most.

    Earlier when the scenario ends; dt: s per step; seed: of the traffic that actions bring;
    ends_with_acts: a story without a stop trigger ends when all its acts are complete.
    """
    stage = IdealWorld(scenario)
    modes = dict.fromkeys(scenario.entities, ActorMode.IDEAL)
    player = Player(scenario, modes=modes, dt=dt, seed=seed)
    player.telling.ends = player.telling.ends and ends_with_acts
    rows: list[Row] = []
    for _ in range(round(duration / dt) + 1):
        words = player.step(stage.truth())
        rows += _rows(player, stage)
        if player.ended:
            break
        stage.step(words)
    return PlayedScenario(tuple(rows), player)


def _rows(player: Player, stage: IdealWorld) -> list[Row]:
    """Returns one row (position of the reference point, yaw, signed speed) for each actor that is present."""
    found = []
    s, t = stage.states, player.scene.t
    for i, (name, actor) in enumerate(player.actors.items()):
        k = actor.row
        if not s.present[k]:
            continue
        yaw, box = float(s.yaw[k]), actor.entity.box
        x = float(s.x[k]) - box.forward * cos(yaw) + box.left * sin(yaw)
        y = float(s.y[k]) - box.forward * sin(yaw) - box.left * cos(yaw)
        vx, vy = float(s.vx[k]), float(s.vy[k])
        v = copysign(hypot(vx, vy), vx * cos(yaw) + vy * sin(yaw))
        if stage.tick == 0 and actor.track is not None:  # what begins at time 0 is so at time 0
            pose, first, _ = actor.track.at(t)
            v = v if actor.track.timed else first
            x, y, yaw = pose.x, pose.y, pose.yaw
        found.append(Row(t, i, name, x, y, float(s.z[k]), yaw, v))
    return found
