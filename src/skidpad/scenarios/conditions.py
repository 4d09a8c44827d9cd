"""Conditions: one small class each, found through the tables at the end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot
from typing import Protocol

from skidpad.scenarios.positions import position
from skidpad.scenarios.reader import Node, Unsupported
from skidpad.scenarios.scene import Scene, State

RULES: dict[str, Callable[[float, float], bool]] = {
    "greaterThan": lambda a, b: a > b,
    "lessThan": lambda a, b: a < b,
    "equalTo": lambda a, b: a == b,
    "greaterOrEqual": lambda a, b: a >= b,
    "lessOrEqual": lambda a, b: a <= b,
    "notEqualTo": lambda a, b: a != b,
}
EDGES = ("none", "rising", "falling", "risingOrFalling")


class Condition(Protocol):
    """Something that holds now or not."""

    def holds(self, scene: Scene) -> bool:
        """Looked at once per step."""
        ...


class EntityCondition(Protocol):
    """Something that holds for an entity or not."""

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Looked at once per step and entity."""
        ...


class Rule:
    """Compares with the attribute `value` by the attribute `rule`."""

    def __init__(self, node: Node, value: str = "value") -> None:
        self.value = node.number(value)
        self.compare = RULES[node.choice("rule", tuple(RULES))]

    def __call__(self, quantity: float) -> bool:
        """Whether the quantity stands so to the value."""
        return self.compare(quantity, self.value)


class SimulationTime:
    """Time since the scenario began."""

    def __init__(self, node: Node) -> None:
        self.rule = Rule(node)

    def holds(self, scene: Scene) -> bool:
        """t against the value."""
        return self.rule(scene.t)


class Parameter:
    """A parameter of the file against a value; it does not change during a run."""

    def __init__(self, node: Node) -> None:
        name = node.text("parameterRef")
        if name not in node.values:
            raise node.error(f"parameterRef: parameter {name!r} is not declared")
        value, rule = node.text("value"), node.choice("rule", tuple(RULES))
        try:
            self.met = RULES[rule](float(node.values[name]), float(value))
        except ValueError:
            raise Unsupported(node, f"only numbers can be compared, got {value!r}") from None

    def holds(self, _: Scene) -> bool:
        """Always or never."""
        return self.met


class StoryboardElementState:
    """An element is in a state, or goes through a transition."""

    TRANSITIONS = ("startTransition", "endTransition", "stopTransition", "skipTransition")

    def __init__(self, node: Node) -> None:
        self.name = node.text("storyboardElementRef")
        states = tuple(s.value for s in State)
        self.state = node.choice("state", (*states, *self.TRANSITIONS))

    def holds(self, scene: Scene) -> bool:
        """State or transition of the last step."""
        if self.state in self.TRANSITIONS:
            return scene.moves.get(self.name) == self.state
        return scene.states.get(self.name, State.STANDBY).value == self.state


class RelativeDistance:
    """Distance to another entity along the own axes, or straight."""

    def __init__(self, node: Node) -> None:
        self.rule, self.other = Rule(node), node.text("entityRef")
        self.free = node.flag("freespace", default=False)
        kinds = ("longitudinal", "lateral", "cartesianDistance", "euclidianDistance")
        self.kind = node.choice("relativeDistanceType", kinds)
        node.choice("coordinateSystem", ("entity",), "entity")
        if self.free and self.kind != "longitudinal":
            raise Unsupported(node, "freespace is supported for longitudinal distances only")

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Unsigned, as the standard has it."""
        if self.free:
            return self.rule(scene.gap(actor, self.other))
        forward, left = scene.between(actor, self.other)
        if self.kind == "longitudinal":
            return self.rule(abs(forward))
        return self.rule(abs(left) if self.kind == "lateral" else hypot(forward, left))


class TravelledDistance:
    """Way driven since the scenario began."""

    def __init__(self, node: Node) -> None:
        self.value = node.number("value")

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """At least the value."""
        return scene.actors[actor].travelled >= self.value


class StandStill:
    """Standing for some time."""

    def __init__(self, node: Node) -> None:
        self.duration = node.number("duration")

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Counted from the last motion."""
        return scene.actors[actor].stood >= self.duration


class Speed:
    """Speed over ground."""

    def __init__(self, node: Node) -> None:
        self.rule = Rule(node)
        if node.element.get("direction") is not None:
            raise Unsupported(node, "direction is not supported")

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Against the value."""
        return self.rule(scene.actors[actor].v)


class RelativeSpeed:
    """Own speed minus that of another entity."""

    def __init__(self, node: Node) -> None:
        self.rule, self.other = Rule(node), node.text("entityRef")

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Against the value."""
        return self.rule(scene.actors[actor].v - scene.actors[self.other].v)


class TimeHeadway:
    """Time until the entity is where the other one is now, at its own speed."""

    def __init__(self, node: Node) -> None:
        self.rule, self.other = Rule(node), node.text("entityRef")
        self.free = node.flag("freespace", default=False)

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Never while the entity stands."""
        v = scene.actors[actor].v
        forward, _ = scene.between(actor, self.other)
        distance = scene.gap(actor, self.other) if self.free else abs(forward)
        return v > 0.0 and self.rule(distance / v)


class ReachPosition:
    """Within a tolerance of a place."""

    def __init__(self, node: Node) -> None:
        self.tolerance = node.number("tolerance")
        self.position = position(node.child("Position"))

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """Straight distance."""
        pose, m = self.position.pose(scene, actor), scene.actors[actor].motion
        return hypot(pose.x - m.x, pose.y - m.y) <= self.tolerance


class Collision:
    """The entity touched another one; contacts of the ego are known."""

    def __init__(self, node: Node) -> None:
        by = node.find("EntityRef")
        if by is None:
            raise Unsupported(node, "only collisions with an <EntityRef> are supported")
        self.other = by.text("entityRef")

    def holds_for(self, scene: Scene, actor: str) -> bool:
        """From the first contact on."""
        return actor in scene.contacts or self.other in scene.contacts


@dataclass
class AnyEntity:
    """An entity condition for some or all triggering entities."""

    names: tuple[str, ...]
    of_all: bool
    condition: EntityCondition

    def holds(self, scene: Scene) -> bool:
        """By the rule `any` or `all`."""
        found = [self.condition.holds_for(scene, name) for name in self.names]
        return all(found) if self.of_all else any(found)


BY_VALUE: dict[str, Callable[[Node], Condition]] = {
    "ParameterCondition": Parameter,
    "SimulationTimeCondition": SimulationTime,
    "StoryboardElementStateCondition": StoryboardElementState,
}
BY_ENTITY: dict[str, Callable[[Node], EntityCondition]] = {
    "RelativeDistanceCondition": RelativeDistance,
    "TraveledDistanceCondition": TravelledDistance,
    "StandStillCondition": StandStill,
    "SpeedCondition": Speed,
    "RelativeSpeedCondition": RelativeSpeed,
    "TimeHeadwayCondition": TimeHeadway,
    "ReachPositionCondition": ReachPosition,
    "CollisionCondition": Collision,
}


@dataclass
class Timed:
    """A condition with its edge and its delay."""

    condition: Condition
    edge: str
    past: deque[bool] = field(default_factory=deque)  # results of the last `delay`
    before: bool | None = None

    def holds(self, scene: Scene) -> bool:
        """The result of `delay` s ago."""
        now = self.condition.holds(scene)
        before, self.before = self.before, now
        if self.edge != "none":
            rose, fell = now and before is False, before is True and not now
            now = (rose and self.edge != "falling") or (fell and self.edge != "rising")
        self.past.append(now)
        return self.past.popleft()


class Trigger:
    """Groups of conditions: it fires when all of one group hold."""

    def __init__(self, node: Node | None, dt: float) -> None:
        groups = node.children("ConditionGroup") if node is not None else ()
        self.groups: Sequence[Sequence[Timed]] = [
            [_timed(c, dt) for c in group.children("Condition")] for group in groups
        ]

    def __bool__(self) -> bool:
        return bool(self.groups)

    def fires(self, scene: Scene) -> bool:
        """Every condition is looked at in every step, so that delays and edges stay true."""
        results = [[c.holds(scene) for c in group] for group in self.groups]
        return any(all(group) for group in results)


def _timed(node: Node, dt: float) -> Timed:
    edge = node.choice("conditionEdge", EDGES, "none")
    delay = node.number("delay", 0.0)
    if delay < 0.0:
        raise node.error(f"delay must be >= 0, got {delay:g}")
    return Timed(condition(node), edge, deque([False] * round(delay / dt)))


def condition(node: Node) -> Condition:
    """The condition inside a <Condition>."""
    inner = node.only()
    if inner.tag == "ByValueCondition":
        leaf = inner.only()
        if leaf.tag not in BY_VALUE:
            raise Unsupported(leaf)
        return BY_VALUE[leaf.tag](leaf)
    if inner.tag != "ByEntityCondition":
        raise Unsupported(inner)
    who = inner.child("TriggeringEntities")
    leaf = inner.child("EntityCondition").only()
    if leaf.tag not in BY_ENTITY:
        raise Unsupported(leaf)
    names = tuple(n.text("entityRef") for n in who.children("EntityRef"))
    of_all = who.choice("triggeringEntitiesRule", ("any", "all")) == "all"
    return AnyEntity(names, of_all, BY_ENTITY[leaf.tag](leaf))
