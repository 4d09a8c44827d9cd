"""The story as a table that a kernel plays, for as long as nothing begins or ends in it.

A tick in which no condition changes and no action ends is arithmetic: where actors are, what running
changes of speed and offset ask of them, and what their drivers do. `StoryTable.play` does all of it in one
call of `table_kernel.play_tick`; as soon as anything may happen, `settle` writes its rows back and
Python plays the tick (`Player.step`). What a table cannot hold, `tabulate` names.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from math import hypot, inf, isnan

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, hold
from skidpad.core.setup import ActorCommand
from skidpad.core.states import ActorStates, VehicleCommand, WorldTruth
from skidpad.scenarios.actions.lateral import ChangeOfOffset
from skidpad.scenarios.actions.speed import ChangeOfSpeed
from skidpad.scenarios.conditions.by_entity import (
    SOME,
    Collision,
    Component,
    Quantity,
    Reaches,
    ReachPosition,
)
from skidpad.scenarios.conditions.by_entity import Motion as MotionCondition
from skidpad.scenarios.conditions.by_value import (
    ElementMove,
    ElementState,
    Never,
    SimulationTime,
    Value,
)
from skidpad.scenarios.conditions.distances import (
    EUCLIDEAN,
    Distance,
    Measure,
    TimeHeadway,
    TimeToCollision,
)
from skidpad.scenarios.movement.measures import Axes, Direction
from skidpad.scenarios.movement.motion import LONGEST
from skidpad.scenarios.places.positions import Fixed
from skidpad.scenarios.playing.table_kernel import (
    ACTORS,
    CHANGES,
    CONDITIONS,
    KINDS,
    RULES,
    SHAPES,
    Table,
    play_tick,
)
from skidpad.scenarios.scene import Actor, Running, Scene
from skidpad.scenarios.triggers import AnyEntity, Watched
from skidpad.simulation.scripted import Motion

STEADY = (ElementState, ElementMove, Never, Value)  # say the same until something happens
WITHIN = RULES.index("lessOrEqual")
AXES = {Component.TOTAL: "", Component.LONGITUDINAL: " along", Component.LATERAL: " across"}


@dataclass(frozen=True, slots=True)
class TableUse:
    """How many ticks of a story the kernel has played as a table.

    reason: the first thing that no table can hold, which Python played; "": there was none.
    """

    ticks: int
    by_table: int
    reason: str


class NoTable(Exception):
    """What the story has that no table can hold; the text says it."""


class StoryTable:
    """A story that stands still, in rows.

    way_back: m that the ego has gone backwards, once it is settled.
    """

    def __init__(self, scene: Scene, rows: Table, changes: list[Running], wakes: float) -> None:
        """changes: the actions of the rows; wakes: s, when a delay is over."""
        self.scene, self.rows, self.changes, self.wakes = scene, rows, changes, wakes
        self.held, self.map = hold(rows), scene.network.map.held
        self.states = ActorStates.empty(0)  # of the world, once there was a tick
        self.held_states = hold(self.states)
        told = rows.actors["is_told"].tolist()
        self.told = [(name, k) for k, name in enumerate(scene.actors) if told[k]]
        self.played = 0

    def play(self, truth: WorldTruth) -> list[ActorCommand] | None:
        """Goes on by a tick and returns what actors do until the next; None: Python has to play it."""
        scene = self.scene
        dt = scene.dt
        t = truth.tick * dt
        if truth.contacts or self.wakes <= t + 1e-9:
            return None
        if truth.states is not self.states:
            self.states, self.held_states = truth.states, hold(truth.states)
        if not play_tick(self.map, self.held_states, self.held, t, dt):
            return None
        scene.t, scene.lights, scene.truth = t, truth.lights, truth
        self.played += 1
        pedals = self.rows.pedals.tolist()
        return [ActorCommand(name, None, None, VehicleCommand(*pedals[k])) for name, k in self.told]

    def settle(self) -> None:
        """Writes the rows back into actors and actions, as Python would have left them."""
        for actor, row in zip(self.scene.actors.values(), self.rows.actors, strict=True):
            r = dict(zip(ACTORS.names or (), row.item(), strict=True))
            actor.motion = Motion(r["x"], r["y"], r["yaw"], r["vx"], r["vy"])
            actor.pose = Pose(r["px"], r["py"], r["pz"], 0.0, 0.0, r["yaw"])
            actor.a, actor.acceleration = r["a"], (r["ax"], r["ay"])
            actor.travelled, actor.stood, actor.at_end = r["travelled"], r["stood"], r["at_end_s"]
            guide = actor.guide
            guide.v, guide.a, guide.at_end = r["v"], r["v_rate"], r["at_end"]
            guide.pace = None if isnan(r["pace"]) else r["pace"]
            guide.offset, guide.offset_rate = r["offset"], r["offset_rate"]
            guide.offset_bend, guide.adds_offset = r["offset_bend"], r["adds_offset"]
            if r["followed"]:
                guide.followed = (
                    r["lane"], r["s"], r["left"], r["lx"], r["ly"], r["lz"], r["heading"],
                    r["curvature"], r["width"], r["throttle"], r["brake"], r["steer"],
                )  # fmt: skip
            if actor.name == self.scene.ego:
                self.way_back: float = r["way_back"]
        for change, done in zip(self.changes, self.rows.changes["done"].tolist(), strict=True):
            if isinstance(change, ChangeOfOffset):
                change.done = done


@cache
def hold_no_story() -> Held[Table]:
    """Returns an empty table, of the type that kernels take."""
    actors = np.zeros(0, ACTORS)
    rows = Table(
        actors, actors, np.zeros(0, CONDITIONS), np.zeros(0, CHANGES), np.zeros((0, 3))
    )  # fmt: skip
    return hold(rows)


def tabulate(
    scene: Scene, watched: Iterable[Watched], changes: list[Running], way_back: float
) -> StoryTable:
    """Returns the table of a story in whose last tick nothing began or ended; NoTable says why there is none.

    watched: the conditions that are looked at in each tick; changes: what goes on, in the order of the
    steps; way_back: m that the ego has gone backwards.
    """
    if scene.cruising:
        raise NoTable("traffic that an action brings")
    if scene.network.even_forks:
        raise NoTable("a fork with no straightest way")
    index = {name: k for k, name in enumerate(scene.actors)}
    conditions: list[tuple[float, ...]] = []
    wakes = inf
    for one in watched:
        conditions += condition_rows(one, scene, index)
        wakes = min(wakes, one.wakes)
    actors = np.array([actor_row(actor, way_back) for actor in scene.actors.values()], ACTORS)
    rows = Table(
        actors,
        actors.copy(),
        np.array(conditions, CONDITIONS),
        np.array([change_row(change, index) for change in changes], CHANGES),
        np.zeros((len(actors), 3)),
    )
    return StoryTable(scene, rows, changes, wakes)


def actor_row(actor: Actor, way_back: float) -> tuple[float, ...]:
    """Returns the row of an actor; NoTable where it is not driven along its lane through the tyres."""
    guide, name = actor.guide, actor.name
    is_told = actor.present and actor.driven_by_file
    for asked, what in (
        (actor.driven_by_file and actor.placed_by_file, "is put where the file says"),
        (actor.track is not None, "goes along a trajectory"),
        (actor.controller is not None, "has a controller"),
        (actor.towed_by is not None, "is towed"),
        (bool(actor.worked), "has inputs that the file works"),
        (actor.word is not None or actor.v_after_track is not None, "is put somewhere"),
        (
            is_told and ((guide.followed or guide.base) is None or bool(guide.roads)),
            "is on no lane or on a route",
        ),
        (is_told and guide.v < 0.0, "goes backwards"),
    ):
        if asked:
            raise NoTable(f"{name} {what}")
    m, p, found = actor.motion, actor.pose, guide.followed
    lane: tuple[float, ...] = (-1, *11 * (0.0,)) if found is None else found
    if found is None and (b := guide.base) is not None:
        lane = (b.lane, b.s, 0.0, b.x, b.y, b.z, b.heading, b.curvature, b.width, 0.0, 0.0, 0.0)
    hands = 11 * (0.0,) if actor.driver is None else actor.driver.own_hands
    return (
        m.x, m.y, m.yaw, m.vx, m.vy, p.x, p.y, p.z,
        actor.a, *actor.acceleration, actor.travelled, actor.stood, actor.at_end, way_back,
        guide.v, guide.a, guide.dv, guide.da, np.nan if guide.pace is None else guide.pace,
        guide.offset, guide.offset_rate, guide.offset_bend, guide.along,
        guide.adds_offset, guide.at_end, found is not None, *lane,
        actor.row, is_told, actor.entity.box.forward, actor.entity.box.left, *hands,
    )  # fmt: skip


def change_row(change: Running, index: Mapping[str, int]) -> tuple[float, ...]:
    """Returns the row of an action under way; NoTable for one that is more than a change over time or way."""
    if isinstance(change, ChangeOfSpeed) and change.action.target.other is None:
        began, done, aside = change.began, 0.0, (False, False, False)
    elif type(change) is ChangeOfOffset:
        began, done, aside = 0.0, change.done, (change.by_way, change.to_lane, change.noted)
    else:
        raise NoTable(f"an action that is more than a change: {type(change).__name__}")
    c = change.change
    return (
        index[change.actor.name], isinstance(change, ChangeOfSpeed), c.start, c.end, c.span,
        min(c.span, LONGEST) ** 2, SHAPES.index(c.shape.value), began, done, done, *aside,
    )  # fmt: skip


def condition_rows(
    watched: Watched, scene: Scene, index: Mapping[str, int]
) -> Iterator[tuple[float, ...]]:
    """Yields the rows of a condition, one per entity; NoTable for one that the kernel does not know."""
    condition = watched.timed.condition
    if isinstance(condition, STEADY):
        return
    if isinstance(condition, SimulationTime):
        r = condition.rule
        says = r.is_met(scene.t)
        yield KINDS.index("time"), 0, -1, 0.0, 0.0, RULES.index(r.rule), r.value, 0.0, says
        return
    if not isinstance(condition, AnyEntity):
        raise NoTable(f"a condition: {type(condition).__name__}")
    for name in condition.names:
        if not scene.actors[name].present:
            continue
        if isinstance(condition.condition, Collision):
            yield from _apart_rows(condition.condition, scene, name, index)
            continue
        says = bool(condition.condition.holds(scene, name))
        yield (*_entity_row(condition.condition, scene, name, index), says)


def _apart_rows(
    condition: Collision, scene: Scene, name: str, index: Mapping[str, int]
) -> Iterator[tuple[float, ...]]:
    """Yields a row for each body that an entity may touch: it is too far away for that, or Python looks."""
    for other in condition.names(scene):
        one, it = scene.actors[name], scene.actors[other]
        if one is not it and it.present and not (one.entity.is_ghost or it.entity.is_ghost):
            near = one.nearness(it)
            its = index[other]
            yield KINDS.index("distance"), index[name], its, 0.0, 0.0, WITHIN, near, 0.0, False


def _entity_row(
    condition: object, scene: Scene, name: str, index: Mapping[str, int]
) -> tuple[float, ...]:
    """Returns the row of an entity's condition without what it says now."""
    own = index[name]
    match condition:
        case Reaches(Quantity.TRAVELLED, value):
            return KINDS.index("travelled"), own, -1, 0.0, 0.0, 0, max(value - SOME, 0.0), 0.0
        case Reaches(Quantity.STOOD, value):
            return KINDS.index("stood"), own, -1, 0.0, 0.0, 0, max(value - SOME, SOME), 0.0
        case MotionCondition(rule, component, acceleration, other) if component in AXES:
            kind = ("acceleration" if acceleration else "speed") + AXES[component]
            its = -1 if other is None else index[other]
            return KINDS.index(kind), own, its, 0.0, 0.0, RULES.index(rule.rule), rule.value, 0.0
        case ReachPosition(tolerance, Fixed(place)):
            x, y = place.pose.x, place.pose.y
            return KINDS.index("distance"), own, -1, x, y, WITHIN, tolerance, 0.0
        case Distance(rule, measure, other, goal):
            kind = "distance" + _direction(measure)
        case TimeHeadway(rule, measure, other):
            kind, goal = "headway" + _direction(measure), None
        case TimeToCollision(rule, measure, other, goal):
            kind = "collision time" + _direction(measure)
        case _:
            raise NoTable(f"a condition: {type(condition).__name__}")
    if kind not in KINDS or (other is None and not isinstance(goal, Fixed)):
        raise NoTable(f"a condition: {type(condition).__name__} with its place or axes")
    x, y = (goal.fixed.pose.x, goal.fixed.pose.y) if isinstance(goal, Fixed) else (0.0, 0.0)
    its = -1 if other is None else index[other]
    bodies = [scene.actors[name], *([] if other is None else [scene.actors[other]])]
    slack = sum(map(_reach, bodies)) if measure.free else 0.0
    return KINDS.index(kind), own, its, x, y, RULES.index(rule.rule), rule.value, slack


def _direction(measure: Measure) -> str:
    """Returns how a measure's direction ends the name of a kind; one along a road has no such kind."""
    if measure.direction in EUCLIDEAN:
        return ""
    is_long = measure.direction is Direction.LONGITUDINAL
    if measure.axes in (Axes.ROAD, Axes.LANE):
        return " along the road"
    if measure.axes is Axes.WORLD and not measure.free:
        return " in x" if is_long else " in y"
    return " along" if is_long else " across"


def _reach(actor: Actor) -> float:
    """Returns the distance of the furthest corner of a body from its reference point, m."""
    box = actor.entity.box
    return hypot(abs(box.forward) + 0.5 * box.length, abs(box.left) + 0.5 * box.width)
