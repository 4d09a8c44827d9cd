"""Triggers: groups of conditions with edges and delays, compiled once and observed by each run."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum
from functools import partial
from math import inf

from skidpad.scenarios.conditions.base import Condition, EntityCondition, Probe
from skidpad.scenarios.conditions.by_entity import BY_ENTITY
from skidpad.scenarios.conditions.by_value import BY_VALUE, ElementMove, Never
from skidpad.scenarios.conditions.distances import DISTANCES
from skidpad.scenarios.context import Context
from skidpad.scenarios.elements import Happening, Path
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.outline import describe_element
from skidpad.scenarios.scene import Scene

ENTITY_CONDITIONS = {**BY_ENTITY, **DISTANCES}


class Edge(Enum):
    """Which change of a condition counts."""

    NONE = "none"
    RISING = "rising"
    FALLING = "falling"
    BOTH = "risingOrFalling"


@dataclass(frozen=True, slots=True)
class AnyEntity:
    """An entity condition for some or all triggering entities."""

    names: tuple[str, ...]
    of_all: bool
    condition: EntityCondition

    def probe(self) -> Probe:
        """Returns a function of the scene: whether the condition holds for any entity, or for all."""
        if len(self.names) != 1:
            return self._holds
        (name,), holds = self.names, self.condition.holds
        return lambda scene: scene.actors[name].present and holds(scene, name)

    def holding(self, scene: Scene) -> list[str]:
        """Returns the entities for which it holds now."""
        names = (n for n in self.names if scene.actors[n].present)
        return [n for n in names if self.condition.holds(scene, n)]

    def _holds(self, scene: Scene) -> bool:
        """Returns whether the condition holds for any (or all) of the entities; absent ones count as no."""
        for name in self.names:
            held = scene.actors[name].present and bool(self.condition.holds(scene, name))
            if held is not self.of_all:
                return not self.of_all
        return self.of_all


@dataclass(frozen=True, slots=True)
class Timed:
    """A condition with its name, edge and delay in s. outline: what the file says of it, in one line."""

    name: str
    condition: Condition
    edge: Edge
    delay: float
    outline: str = ""


@dataclass(frozen=True, slots=True)
class Trigger:
    """Groups of conditions: it fires when all of one group hold."""

    groups: tuple[tuple[Timed, ...], ...]

    def __bool__(self) -> bool:
        return bool(self.groups)


EMPTY = Trigger(())


class Watched:
    """A condition as one run sees it."""

    def __init__(self, timed: Timed, path: Path) -> None:
        self.timed, self.probe, self.path = timed, timed.condition.probe(), path
        self.is_immediate = timed.edge is Edge.NONE and timed.delay <= 0.0
        self.said = False
        self.before: bool | None = None
        self.sent = self.late = False  # what goes into the delay, and what has come out of it
        self.past: deque[tuple[float, bool]] = deque()  # its changes, each with when it is due

    def holds(self, scene: Scene) -> bool:
        """Returns the result of `delay` s ago; adds a change of it to the story. Once per step."""
        result = bool(self.probe(scene))  # a value of NumPy would be neither True nor False
        if not self.is_immediate:
            result = self._at_edge(scene, result)
        if result is not self.said:
            self.said = result
            what = f"condition {self.timed.name} {'holds' if result else 'ends'}"
            scene.story.append(Happening(scene.t, self.path, what))
        return result

    def _at_edge(self, scene: Scene, now: bool) -> bool:
        """Returns whether the condition, with its edge applied, held `delay` seconds ago; now: it holds."""
        before, self.before = self.before, now
        edge = self.timed.edge
        if edge is not Edge.NONE:
            rose, fell = now and before is False, before is True and not now
            now = (rose and edge is not Edge.FALLING) or (fell and edge is not Edge.RISING)
        if self.timed.delay <= 0.0:
            return now
        if now is not self.sent:
            self.sent = now
            self.past.append((scene.t + self.timed.delay, now))
        if self.past and self.past[0][0] <= scene.t + 1e-9:
            self.late = self.past.popleft()[1]
        return self.late

    @property
    def wakes(self) -> float:
        """Returns when the next change comes out of its delay, s; inf: none is on its way.

        -inf where an edge or a transition has just been seen or come out, which is over in the next step.
        """
        timed = self.timed
        moved = isinstance(timed.condition, ElementMove)
        if (moved or timed.edge is not Edge.NONE) and (self.sent or self.said):
            return -inf
        if moved and self.before:
            return -inf
        return self.past[0][0] if self.past else inf


class Watch:
    """A trigger as one run sees it."""

    def __init__(self, trigger: Trigger, path: Path = ()) -> None:
        self.groups = [[Watched(c, path) for c in group] for group in trigger.groups]
        self.fired: list[list[Watched]] = []  # the groups that hold, when it was looked at last

    def fires(self, scene: Scene) -> bool:
        """Returns whether all conditions of any group hold; to be called once per step.

        Every condition is looked at each time, so that delays and edges stay true.
        """
        self.fired = fired = []
        for group in self.groups:
            are_met = True
            for condition in group:
                are_met = condition.holds(scene) and are_met
            if are_met:
                fired.append(group)
        return bool(fired)

    def triggering(self, scene: Scene) -> list[str]:
        """Returns the entities that made it fire just now."""
        conditions = (c.timed.condition for group in self.fired for c in group)
        asked = [c for c in conditions if isinstance(c, AnyEntity)]
        return list(dict.fromkeys(n for c in asked for n in c.holding(scene)))


def compile_trigger(node: Node | None, ctx: Context) -> Trigger:
    """Compiles a <StartTrigger> or <StopTrigger>; faulty conditions go to the list of findings.

    Such a condition never holds; None gives an empty trigger.
    """
    if node is None:
        return EMPTY
    groups = []
    for group in node.children("ConditionGroup"):
        found = [
            ctx.attempt(partial(_timed_condition, c, ctx)) for c in group.children("Condition")
        ]
        groups.append(tuple(c or Timed("", Never(), Edge.NONE, 0.0) for c in found))
    return Trigger(tuple(g for g in groups if g))


def _timed_condition(node: Node, ctx: Context) -> Timed:
    """Compiles a condition with its edge and its delay in s."""
    edge = node.choice("conditionEdge", Edge, Edge.NONE)
    delay = node.number("delay", 0.0)
    if delay < 0.0:
        raise node.error(f"delay must be >= 0, got {delay:g}")
    made = condition(node, ctx)
    outline = describe_element(node.find("ByEntityCondition", "EntityCondition") or node.only())
    return Timed(node.label(), made, edge, delay, outline)


def condition(node: Node, ctx: Context) -> Condition:
    """Compiles the condition by value or by entity inside a <Condition>."""
    inner = node.only()
    if inner.tag == "ByValueCondition":
        leaf = inner.only()
        return leaf.choose(BY_VALUE)(leaf, ctx)
    if inner.tag != "ByEntityCondition":
        raise inner.unsupported_fault()
    who = inner.child("TriggeringEntities")
    leaf = inner.child("EntityCondition").only()
    make = leaf.choose(ENTITY_CONDITIONS)
    names = ctx.actors(who.children("EntityRef"))
    rule = who.text("triggeringEntitiesRule")
    if rule not in ("any", "all"):
        raise who.error(f"triggeringEntitiesRule must be any or all, got {rule!r}")
    return AnyEntity(names, rule == "all", make(leaf, ctx))
