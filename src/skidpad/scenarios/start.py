"""How a scenario begins: the <Init> of a file, worked out for all entities in their own order.

A place or speed may refer to another entity's; those are worked out first, and a circle is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, cast

from skidpad.core.geometry import Pose
from skidpad.scenarios.actions.base import GlobalAction, PrivateAction
from skidpad.scenarios.actions.controllers import Activate, Several
from skidpad.scenarios.actions.distance import KeepGap
from skidpad.scenarios.actions.lateral import LaneChange, LaneOffset
from skidpad.scenarios.actions.private import private_action
from skidpad.scenarios.actions.routing import FollowTrajectory, Teleport
from skidpad.scenarios.actions.speed import Speed, limit_speed
from skidpad.scenarios.actions.world import (
    AddEntity,
    DeleteEntity,
    SetEnvironment,
    global_action,
    user_defined,
)
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.measures import Point, corners
from skidpad.scenarios.movement.motion import Guide, Shape
from skidpad.scenarios.movement.network import Network, Place
from skidpad.scenarios.places.positions import Position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.environment import Environment
from skidpad.scenarios.reading.findings import Fault, Kind
from skidpad.scenarios.scene import Actor, Scene

ORIGIN = Pose(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Begin:
    """One entity at the begin. place: None where it is not in the world yet."""

    place: Place | None
    speed: float
    actions: tuple[PrivateAction, ...] = ()  # what else it does from the begin on


@dataclass(frozen=True, slots=True)
class Start:
    """Places and speeds of all entities when the scenario begins."""

    entities: Mapping[str, Begin]
    actions: tuple[GlobalAction, ...] = ()
    environment: Environment | None = None
    handed: Mapping[str, bool] = field(default_factory=dict)  # controllers switched by the file


@dataclass(slots=True)
class _Wish:
    """What <Init> says about one entity, with the element for messages."""

    node: Node
    positions: list[Position] = field(default_factory=list)  # one after the other
    speed: Speed | None = None
    actions: list[PrivateAction] = field(default_factory=list)


def compile_start(init: Node, ctx: Context) -> Start:
    """Compiles the <Init> of a storyboard; what is faulty goes to the list of findings."""
    wishes: dict[str, _Wish] = {}
    worldwide: list[GlobalAction] = []
    gone: set[str] = set()
    environment: Environment | None = None
    for node in init.child("Actions").children():
        if node.tag == "Private":
            ctx.attempt(partial(_private, node, ctx, wishes))
            continue
        make = {"GlobalAction": global_action, "UserDefinedAction": user_defined}.get(node.tag)
        if make is None:
            ctx.findings.append(node.unsupported_fault().finding)
            continue
        action = ctx.attempt(partial(make, node, ctx))
        if isinstance(action, AddEntity):
            wishes.setdefault(action.name, _Wish(node)).positions.append(action.position)
        elif isinstance(action, DeleteEntity):
            gone.add(action.name)
        elif isinstance(action, SetEnvironment):
            environment = action.environment
        elif action is not None:
            worldwide.append(action)
    begins = dict(_worked_out(init, wishes, gone, ctx))
    return Start(begins, tuple(worldwide), environment, dict(_handed_over(wishes)))


def _private(node: Node, ctx: Context, wishes: dict[str, _Wish]) -> None:
    """Adds the positions, initial speed and other private actions of a node to the entities' wishes."""
    for name in ctx.actors([node]):
        wish = wishes.setdefault(name, _Wish(node))
        for one in node.children("PrivateAction"):
            action = ctx.attempt(partial(private_action, one, ctx))
            if isinstance(action, Teleport):
                wish.positions.append(action.position)
                continue
            if isinstance(action, Speed) and action.at_once:
                wish.speed = action
                if not action.target.continuous:
                    continue
            if action is not None:
                wish.actions.append(action)


def _handed_over(wishes: Mapping[str, _Wish]) -> Iterator[tuple[str, bool]]:
    """Yields (entity name, active) for each controller that the Init phase switches."""
    for name, wish in wishes.items():
        flat: list[Any] = []
        for action in wish.actions:
            flat += action.actions if isinstance(action, Several) else [action]
        for action in flat:
            if isinstance(action, Activate) and action.says is not None:
                yield name, action.says


def is_step_of_place(action: PrivateAction) -> bool:
    """Returns whether an action puts its entity somewhere else without taking time."""
    if isinstance(action, KeepGap):
        return action.limits.is_boundless
    if isinstance(action, LaneChange):
        return action.at_once
    return isinstance(action, LaneOffset) and action.shape is Shape.STEP


class _Starting:
    """An entity whose place and speed are worked out when somebody asks; looks like an actor."""

    def __init__(self, name: str, wish: _Wish, ctx: Context, scene: Scene) -> None:
        self.name, self.wish, self.ctx, self.scene = name, wish, ctx, scene
        self.entity = ctx.entities[name]
        self.guide = Guide(ctx.network, Place(ORIGIN), 0.0)
        self._known: dict[str, Any] = {}
        self._so_far: Place | None = None  # where the teleports before the one at hand have put it

    def _once(self, key: str, make: Callable[[], Any]) -> Any:
        """Returns the value of `key`, computed at most once; raises an error where it depends on itself."""
        if key not in self._known:
            self._known[key] = _ASKED
            self._known[key] = make()
        if self._known[key] is _ASKED:
            if key == "speed" and self.wish.speed and self.wish.speed.target.continuous:
                return 0.0  # a circle of speeds that are kept to begins at a stand
            raise self.wish.node.error(f"the {key} of {self.name!r} depends on itself")
        return self._known[key]

    def place(self, network: Network) -> Place:
        """Returns where it begins; while that is worked out, where it is so far."""
        del network
        if self._known.get("place") is _ASKED and self._so_far is not None:
            return self._so_far
        return cast("Place", self._once("place", self._place))

    def _place(self) -> Place:
        """Returns the entity's place after all its Init actions; the world origin where none gives one."""
        for position in self.wish.positions:
            self._so_far = position.place(self.scene)
        network = self.ctx.network
        for action in self.wish.actions:
            if isinstance(action, FollowTrajectory):
                if self.wish.positions and action.is_steered(self.entity):
                    continue  # it steers there from where it is
                here = self._so_far = self._so_far or network.place_of(ORIGIN)
                pose = action.first_pose(self.scene, here.pose, self.v_told)
                self._so_far = network.place_of(pose)
            elif is_step_of_place(action):
                self._so_far = self._place_after(action)
        return self._so_far or network.place_of(ORIGIN)

    def _place_after(self, action: PrivateAction) -> Place:
        """Returns where an action that takes no time puts it: along its lane, aside, or straight on."""
        itself, network = cast("Actor", self), self.ctx.network
        here = self._so_far = self._so_far or network.place_of(ORIGIN)
        self.guide = guide = Guide(network, here, 0.0)
        if isinstance(action, KeepGap):
            guide.leap = action.excess(self.scene, itself, action.resolved_side(self.scene, itself))
        elif isinstance(action, LaneChange):
            end = action.aim(self.scene, self.name, guide)
            guide.offset = guide.offset if end is None else end
        elif isinstance(action, LaneOffset):
            guide.offset = action.target(self.scene, itself)
        pose = guide.ideal(0.0)
        return network.place_of(pose) if guide.base is None else guide.place(pose)

    @property
    def pose(self) -> Pose:
        """Returns the pose as an actor has it."""
        return self.place(self.ctx.network).pose

    def outline(self) -> list[Point]:
        """Returns the corners of the outline on the ground."""
        return corners(self.pose, self.entity.box)

    @property
    def v_told(self) -> float:
        """Returns the speed in m/s when the scenario begins."""
        return cast("float", self._once("speed", self._speed))

    def _speed(self) -> float:
        """Returns the initial speed in m/s: the leader's for a gap action, else as asked, limited, or 0."""
        gap = next((a for a in self.wish.actions if isinstance(a, KeepGap)), None)
        if gap is not None and gap.limits.is_boundless:
            return self.scene.actors[gap.other].v_told
        if self.wish.speed is None:
            return 0.0
        asked = self.wish.speed.target.speed(self.scene)
        v = limit_speed(asked, self.entity.performance)
        if v != asked:
            what = f"speed of {self.name!r} at the begin: {asked:g} m/s asked, {v:g} m/s applied"
            note = self.wish.node.finding(f"{what} (maxSpeed)", Kind.NOTE)
            self.ctx.findings.append(note)
        return v


_ASKED = object()


def _worked_out(
    init: Node, wishes: Mapping[str, _Wish], gone: set[str], ctx: Context
) -> Iterator[tuple[str, Begin]]:
    """Yields names and where entities begin; what <Init> puts nowhere stands at the origin, as in esmini.

    An entity with a fault, or one that an event is to add, begins without a place.
    """
    actors: dict[str, _Starting] = {}
    scene = Scene(ctx.network, 0.0, cast("Mapping[str, Actor]", actors))
    for name in ctx.entities:
        actors[name] = _Starting(name, wishes.get(name, _Wish(init)), ctx, scene)
    for name, one in actors.items():
        try:
            place = None if name in gone else one.place(ctx.network)
            if not one.wish.positions and name in ctx.added:
                place = None
            left = (a for a in one.wish.actions if not (isinstance(a, LaneChange) and a.at_once))
            yield name, Begin(place, one.v_told, tuple(left))
        except Fault as fault:
            ctx.findings.append(fault.finding)
            yield name, Begin(None, 0.0)
