"""Conditions on time, values, signals and the storyboard itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from skidpad.roads.opendrive.reader import id_number
from skidpad.scenarios.conditions.base import Condition, Probe, Rule, rule, rule_name
from skidpad.scenarios.context import Context
from skidpad.scenarios.criteria import is_criterion
from skidpad.scenarios.elements import Move, Path, State
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.environment import moment_of
from skidpad.scenarios.reading.findings import Kind
from skidpad.scenarios.reading.parameters import holds_between
from skidpad.scenarios.scene import Scene
from skidpad.scenarios.signals import read_signal_state


@dataclass(frozen=True, slots=True)
class SimulationTime:
    """Time since the scenario began, s."""

    rule: Rule

    def probe(self) -> Probe:
        """Returns the function of a scene that compares its time in s with the value."""
        is_met = self.rule.is_met
        return lambda scene: is_met(scene.t)


@dataclass(frozen=True, slots=True)
class Value:
    """A parameter or a variable against a value, as numbers where both are."""

    name: str
    variable: bool
    rule: str
    value: str

    def probe(self) -> Probe:
        """Returns a probe of the value as it is when asked."""
        holds = self.holds_among
        return lambda scene: holds(scene.variables if self.variable else scene.parameters)

    def holds_among(self, values: Mapping[str, str]) -> bool:
        """Returns whether it holds among these values; KeyError where the name is not among them."""
        return holds_between(self.rule, values[self.name], self.value)


def _value(node: Node, ctx: Context) -> Condition:
    """Compiles a condition on a declared variable or parameter; an undeclared criterion never holds."""
    variable = node.tag == "VariableCondition"
    known = ctx.variables if variable else ctx.parameters
    name = node.plain("variableRef" if variable else "parameterRef")
    if name not in known and (not name or _is_criterion(node)):
        what = f"a criterion of ScenarioRunner ({name!r} is not declared) never holds"
        ctx.findings.append(node.finding(what, Kind.NOTE))
        return Never()
    if name not in known:
        raise node.error(f"{'variable' if variable else 'parameter'} {name!r} is not declared")
    return Value(name, variable, rule_name(node), node.text("value"))


def _is_criterion(node: Node) -> bool:
    """Returns whether a condition has a name by which ScenarioRunner judges, and reads nothing else."""
    named = next(node.element.iterancestors("Condition"), None)
    return named is not None and is_criterion(str(named.get("name", "")))


@dataclass(frozen=True, slots=True)
class Never:
    """Stands in the place of a condition that means nothing here."""

    def probe(self) -> Probe:
        """Returns the function of a scene that is always False."""
        return lambda _: False


@dataclass(frozen=True, slots=True)
class ElementState:
    """An element is in a state."""

    path: Path
    state: State

    def probe(self) -> Probe:
        """Returns a function of the scene: whether the element is in the state now."""
        path, state, before = self.path, self.state, State.STANDBY
        return lambda scene: scene.states.get(path, before) is state


@dataclass(frozen=True, slots=True)
class ElementMove:
    """An element has just gone through a transition."""

    path: Path
    move: Move

    def probe(self) -> Probe:
        """Returns a function of the scene that is True once after each such transition.

        Every observer keeps its own place in the list of moves.
        """
        seen = 0

        def holds(scene: Scene) -> bool:
            nonlocal seen
            fresh, seen = scene.moves[seen:], len(scene.moves)
            return (self.path, self.move) in fresh

        return holds


def _element(node: Node, ctx: Context) -> Condition:
    """Compiles the condition that a storyboard element is in a state or makes a transition."""
    path, text = ctx.element(node), node.text("state")
    for kind in State:
        if kind.value == text:
            return ElementState(path, kind)
    for move in Move:
        if move.value == text:
            return ElementMove(path, move)
    raise node.unsupported_fault(f"state={text!r} is not supported")


@dataclass(frozen=True, slots=True)
class Signal:
    """A signal or signal controller is in a state: that of the file, else what the road's light shows."""

    name: str
    state: str

    def probe(self) -> Probe:
        """Returns a function of the scene: whether the signal is in the state now."""
        wanted, id = read_signal_state(self.state), id_number(self.name.removeprefix("id="))

        def holds(scene: Scene) -> bool:
            if self.name in scene.signals:
                return scene.signals[self.name] == self.state
            return wanted is not None and scene.lights.get(id) is wanted

        return holds


@dataclass(frozen=True, slots=True)
class TimeOfDay:
    """The time of day against a moment; there is none before the file says one."""

    rule: Rule

    def probe(self) -> Probe:
        """Returns a function of the scene: whether its time of day meets the comparison now."""
        return lambda s: s.clock is not None and self.rule.is_met(s.clock.now(s.t))


def _time_of_day(node: Node, ctx: Context) -> Condition:
    """Compiles a condition on the date and time of day of the scene."""
    del ctx
    moment = moment_of(node)
    if moment is None:
        raise node.error("needs the attribute dateTime")
    return TimeOfDay(Rule(rule_name(node), moment))


@dataclass(frozen=True, slots=True)
class UserValue:
    """A value that Python code tells, found by its name, against a value of the file."""

    read: Callable[..., Any]
    rule: str
    value: str

    def probe(self) -> Probe:
        """Returns a function of the scene that reads the value, and whether it meets the comparison."""
        return lambda scene: holds_between(self.rule, str(self.read(scene)), self.value)


def _of_user(node: Node, ctx: Context) -> Condition:
    """Compiles a condition on a user-defined value; without a hook it never holds, with a finding."""
    name = node.text("name")
    read = ctx.names.hook(name, "value")
    if read is None:
        ctx.findings.append(ctx.names.unknown(node, "value", name))
        return Never()
    return UserValue(read, rule_name(node), node.text("value"))


def _signal(node: Node, ctx: Context) -> Condition:
    """Compiles the condition that a traffic signal is in a state or its controller in a phase."""
    del ctx
    if node.tag == "TrafficSignalCondition":
        return Signal(node.text("name"), node.text("state"))
    return Signal(node.text("trafficSignalControllerRef"), node.text("phase"))


BY_VALUE: Mapping[str, Callable[[Node, Context], Condition]] = {
    "SimulationTimeCondition": lambda node, _: SimulationTime(rule(node)),
    "ParameterCondition": _value,
    "VariableCondition": _value,
    "StoryboardElementStateCondition": _element,
    "TrafficSignalCondition": _signal,
    "TrafficSignalControllerCondition": _signal,
    "TimeOfDayCondition": _time_of_day,
    "UserDefinedValueCondition": _of_user,
}
