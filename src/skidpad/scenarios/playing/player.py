"""The player: a compiled scenario as a set-up for a backend and as a script that moves its actors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import cos, sin

from skidpad.core.courses import ActorMode
from skidpad.core.geometry import Pose
from skidpad.core.setup import DT, ActorCommand, ActorSetup
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Control
from skidpad.recording.run.lamps import LampChange
from skidpad.recording.run.staging import Staging
from skidpad.recording.run.tilts import Tilted
from skidpad.scenarios.actions.routing import go_on_after_track
from skidpad.scenarios.elements import Happening
from skidpad.scenarios.movement.motion import Guide
from skidpad.scenarios.movement.network import Place
from skidpad.scenarios.movement.tracking import track_demand
from skidpad.scenarios.playing.disturbing import Disturbances
from skidpad.scenarios.playing.staging import WayOfEgo, staging_of
from skidpad.scenarios.playing.table import NoTable, StoryTable, TableUse, tabulate
from skidpad.scenarios.playing.telling import Telling
from skidpad.scenarios.reading.entities import TYRES, Box
from skidpad.scenarios.scenario import Scenario
from skidpad.scenarios.scene import Actor, Controlling, Running, Scene
from skidpad.scenarios.signals import SignalPlan
from skidpad.scenarios.traffic import drive
from skidpad.scenarios.trailers import connect_at_begin, tow_command, tractors_first
from skidpad.simulation.scripted import ActorDriver, Motion

DURATION_MAX = 3600.0  # s, for files that never end
PHYSICAL = ActorMode.PHYSICAL  # asked in every step
WAY_BACK = 1.0  # m, less is no reversing; assumption
WORTH, LONGEST_PAUSE = 10, 63  # ticks that a table is worth, and between attempts to make one
ASIDE = Place(Pose(0.0, 0.0))  # of what is not in the world yet


@dataclass(frozen=True, slots=True)
class Begun:
    """An event, and when it first began, s; None: it never did."""

    name: str
    t: float | None


@dataclass(frozen=True, slots=True)
class Played:
    """What is left of a scenario that was played: its story, what it staged, its entities' boxes."""

    story: tuple[Happening, ...]
    boxes: Mapping[str, Box]
    staging: Staging
    lamps: tuple[LampChange, ...] = ()
    tilts: tuple[Tilted, ...] = ()
    table: TableUse = TableUse(0, 0, "")


def setups(scenario: Scenario) -> tuple[ActorSetup, tuple[ActorSetup, ...]]:
    """Returns the ego and the other actors, for a backend's set-up."""
    made = {}
    for entity in scenario.entities.values():
        begin = scenario.start.entities[entity.name]
        pose = (begin.place or ASIDE).pose
        place = pose.moved(forward=entity.box.forward, left=entity.box.left)
        made[entity.name] = ActorSetup(
            name=entity.name,
            type=entity.type,
            place=place,
            speed=begin.speed,
            driver=Control.SCRIPTED,
            tyres=entity.properties.get(TYRES, ""),
            collides=not entity.is_ghost,
            present=begin.place is not None,
        )
    return made.pop(scenario.ego), tuple(made.values())


class Player:
    """Plays a scenario: one `step` per tick of the world.

    modes: how each actor is moved, None by somebody else; those not named are physical.
    skill: of the drivers, by actor.
    end_on_collision: a contact of the ego ends the run; else the file alone decides.
    seed: of the traffic that actions bring.
    disturbances: of other vehicles; None: there are none.
    tables: a kernel plays the ticks in which nothing begins or ends, as a table; else Python plays all.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        modes: Mapping[str, ActorMode | None] | None = None,
        skill: Mapping[str, float] | None = None,
        duration: float = DURATION_MAX,
        end_on_collision: bool = False,
        dt: float = DT,
        seed: int = 0,
        disturbances: Disturbances | None = None,
        tables: bool = True,
    ) -> None:
        self.scenario, self.duration, self.end_on_collision = scenario, duration, end_on_collision
        self.modes, self.skill = dict(modes or {}), dict(skill or {})
        self._actors: dict[str, Actor] = {}
        self.disturbances = disturbances or Disturbances((), {}, seed)
        self.scene = Scene(
            scenario.network, dt, self._actors, dict(scenario.parameters),
            dict(scenario.variables), ego=scenario.ego, seed=seed,
        )  # fmt: skip
        self.telling = Telling(scenario.storyboard)
        self.signals = SignalPlan(scenario.signals)
        self.ended = False
        self.going: list[Running] = []  # what <Init> began and is under way
        self.hit = False  # the ego has touched something
        self.way_back = 0.0  # m that the ego has gone backwards
        self.way = WayOfEgo()
        self.tables = tables
        self.table: StoryTable | None = None
        self.ticks = self.by_table = 0
        self.reason = ""  # why Python played what no table can hold, the first one
        self.pause = self.rest = 0  # ticks between attempts to make a table, and those left of them

    @property
    def actors(self) -> Mapping[str, Actor]:
        """Returns the actors by name as they are now; none before the first step."""
        self.settle()
        return self._actors

    @property
    def has_triggered_all(self) -> bool:
        """Returns whether every event of the scenario has begun."""
        return all(event.happened_at is not None for event in self.telling.events)

    @property
    def events(self) -> list[Begun]:
        """Returns all events, with the times of their first begin."""
        return [Begun("::".join(e.path), e.happened_at) for e in self.telling.events]

    @property
    def played(self) -> Played:
        """Returns what was played as a value."""
        self.settle()
        boxes = {name: entity.box for name, entity in self.scenario.entities.items()}
        story = tuple(self.scene.story)
        driven_by_file = self.modes.get(self.scenario.ego, ActorMode.PHYSICAL) is not None
        staging = staging_of(
            self.scenario, story, driven_by_file,
            went_back=self.way_back > WAY_BACK, left_way=self.way.is_left,
        )  # fmt: skip
        return Played(
            story, boxes, staging, tuple(self.scene.lamps), tuple(self.scene.tilts),
            TableUse(self.ticks, self.by_table, self.reason),
        )  # fmt: skip

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Takes in the moment, goes on with the story and returns what actors do until the next.

        The first call makes the actors and begins the actions of <Init>. `ended` is set at the end of the
        scenario, of `duration`, or at a contact of the ego where that ends it.
        """
        self.ticks += 1
        if self.table is not None:
            if truth.tick * self.scene.dt < self.duration:
                played = self.table.play(truth)
                if played is not None:
                    self.by_table += 1
                    return played
            if self.table.played < WORTH:
                self.pause = self.rest = min(2 * self.pause + 1, LONGEST_PAUSE)
            self.settle()
        before = self._count_happenings()
        words = self._play_tick(truth)
        if self._count_happenings() != before:
            self.pause = self.rest = 0
        elif self.rest > 0:
            self.rest -= 1
        elif self.tables and not (truth.contacts or self.ended):
            self._tabulate()
        return words

    def count_ahead(self, tick: int) -> int:
        """Returns how many ticks a kernel may drive with the table; the last is played here."""
        assert self.table is not None
        until = min(self.table.wakes, self.duration)
        return max(int(until / self.scene.dt) - tick, 1)

    def pass_ticks(self, ticks: int) -> None:
        """Takes in that a kernel has played so many ticks of the table."""
        if ticks:
            assert self.table is not None
            self.ticks += ticks
            self.by_table += ticks
            self.table.played += ticks

    def settle(self) -> None:
        """Brings actors and actions to where the table has come, if there is one.

        Python then plays the next tick.
        """
        table, self.table = self.table, None
        if table is not None and table.played:
            table.settle()
            self.way_back = table.way_back

    def _count_happenings(self) -> tuple[int, int, int]:
        """Returns numbers that change as soon as anything begins or ends."""
        return len(self.scene.story), len(self.scene.moves), len(self.going)

    def _tabulate(self) -> None:
        """Makes the table of the story, in which nothing began or ended in this tick, if it can be one."""
        try:
            if self.signals.controllers or self.disturbances.drifts:
                raise NoTable("signal controllers or disturbances")
            if self.way.line is not None:
                raise NoTable("the ego's way round a corner")
            telling, going = self.telling, self.going
            self.table = tabulate(
                self.scene,
                telling.list_conditions(),
                [*going, *telling.list_actions()],
                self.way_back,
            )
        except NoTable as found:
            self.reason = self.reason or str(found)
            self.pause = self.rest = min(2 * self.pause + 1, LONGEST_PAUSE)

    def _play_tick(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Plays a tick in Python."""
        first = not self._actors
        if first:
            self._cast(truth)
        scene, telling, actors = self.scene, self.telling, self._actors
        scene.observe(truth)
        for actor in actors.values():
            if actor.v_after_track is not None:
                go_on_after_track(actor, self.scenario.network)
        if first:
            self._begin()
        self.hit = self.hit or bool(truth.contacts)
        ego, dt, t = actors[self.scenario.ego], scene.dt, scene.t
        self.way_back += max(-ego.motion.speed, 0.0) * dt
        if self.modes.get(ego.name, PHYSICAL) is None:
            self.way.look(ego)
        self.signals.step(scene)
        telling.look(scene)
        if self.going:
            self.going = [action for action in self.going if not action.step(scene)]
        telling.step(scene)
        drive(scene)
        control(scene)
        if not first:  # so that a run may branch at its first tick with nothing drawn
            self.disturbances.step(actors, dt)
        stopped = self.hit and self.end_on_collision
        self.ended = telling.ended or stopped or t >= self.duration
        commands = [self._command(a, t) for a in tractors_first(actors.values())]
        return [c for c in commands if c is not None]

    def _command(self, actor: Actor, t: float) -> ActorCommand | None:
        """Returns what an actor does from t s on; a trailer follows the vehicle that tows it.

        None where the file says nothing to it.
        """
        if actor.towed_by is not None and actor.word is None:
            return tow_command(actor, actor.towed_by, self.scene.dt)
        if actor.piloted is not None and actor.word is None:
            return ActorCommand(actor.name, command=actor.overridden(actor.piloted))
        return actor.command(t, self.scene.dt)

    def _cast(self, truth: WorldTruth) -> None:
        """Makes the scenario actor of every entity, at its first place and speed.

        One without a place is told to be absent.
        """
        names, network = truth.table.names, self.scenario.network
        for entity in self.scenario.entities.values():
            begin = self.scenario.start.entities[entity.name]
            place = begin.place or ASIDE
            skill = self.skill.get(entity.name, 1.0)
            actor = Actor(
                entity=entity,
                row=names.index(entity.name),
                mode=self.modes.get(entity.name, ActorMode.PHYSICAL),
                motion=_motion(place.pose, begin.speed),
                guide=Guide(network, place, begin.speed),
                driver=ActorDriver(entity.type, skill) if entity.wheels else None,
                pose=place.pose,
            )
            if begin.place is None:
                actor.present, actor.word = False, ActorCommand(entity.name, present=False)
            self._actors[entity.name] = actor
        connect_at_begin(self._actors)
        self._actors[self.scenario.ego].handed = not self.scenario.ego_is_handed_later

    def _begin(self) -> None:
        """Begins the actions of the Init phase: time of day, global actions, then those of each entity."""
        if self.scenario.start.environment is not None:
            self.scene.tell_time(self.scenario.start.environment)
        for worldwide in self.scenario.start.actions:
            self.going.append(worldwide.happen(self.scene))
        for name, begin in self.scenario.start.entities.items():
            for action in begin.actions:
                self.going.append(action.begin(self.scene, self._actors[name]))


def _motion(pose: Pose, v: float) -> Motion:
    """Returns the planar motion of a body at a pose that moves along its yaw at v in m/s."""
    return Motion(pose.x, pose.y, pose.yaw, v * cos(pose.yaw), v * sin(pose.yaw))


# Controllers of actors at work: along the lane by an acceleration, or with pedals and steer.


def control(scene: Scene) -> None:
    """Steps every active controller; an action of the file goes before it in its domain.

    Sets the pedals of an actor whose controller has them, else its demanded speed.
    """
    for actor in scene.actors.values():
        actor.piloted, controller = None, actor.controller
        if controller is None or not actor.present:
            continue
        if controller.drives:
            actor.piloted = pilot(scene, actor, controller)
        elif actor.longitudinal is None and actor.controls[1]:
            guide = actor.guide
            v = max(guide.v + controller.acceleration(scene, actor.name) * scene.dt, 0.0)
            guide.v, guide.a = v, (v - guide.v) / scene.dt


def pilot(scene: Scene, actor: Actor, controller: Controlling) -> VehicleCommand | None:
    """Returns pedals by the controller, steer by the file, or the other way round, or both by one.

    None, with a notice, for an actor without pedals.
    """
    if actor.driver is None:
        scene.notice(f"{actor.name} has no pedals: its controller does nothing")
        return None
    asked = controller.command(scene, actor.name)
    lateral, longitudinal = actor.controls
    timed = actor.track is not None and actor.track.timed
    steers = lateral and actor.lateral is None and actor.track is None
    paces = longitudinal and actor.longitudinal is None and not timed
    if steers:
        actor.follow_road(scene.network, actor.guide.v)
    if paces:
        actor.guide.v, actor.guide.a = actor.motion.speed, 0.0
    if steers and paces:
        return asked
    if actor.track is not None:
        demand = track_demand(actor.track, actor.motion, scene.t, scene.dt, actor.centre)
        own = actor.driver.command(actor.motion, demand)
    else:
        own = actor.guide.command(actor.motion, actor.driver)
    if paces:
        return replace(asked, steer=own.steer)
    return replace(own, steer=asked.steer) if steers else own
