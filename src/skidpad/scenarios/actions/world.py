"""Actions without an actor: entities come and go, values change, lights switch, weather is set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from skidpad.core.setup import ActorCommand
from skidpad.scenarios.actions.base import GlobalAction, NoEffect
from skidpad.scenarios.actions.traffic import compile_traffic
from skidpad.scenarios.context import Context
from skidpad.scenarios.places.positions import Position, position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.environment import Environment, compile_environment
from skidpad.scenarios.reading.expressions import as_text
from skidpad.scenarios.scene import DONE, Running, Scene


@dataclass(frozen=True, slots=True)
class AddEntity:
    """Lets an entity appear at a position."""

    name: str
    position: Position

    def happen(self, scene: Scene) -> Running:
        """Puts the entity at its place with the speed demanded so far; returns an action that is done.

        An entity that is there already stays where it is, with a notice.
        """
        actor = scene.actors[self.name]
        if actor.present:
            scene.notice(f"<AddEntityAction> of {self.name} has no effect: it is there already")
            return DONE
        actor.put(scene.network, self.position.place(scene), actor.guide.v)
        actor.goes_on = True
        return DONE


@dataclass(frozen=True, slots=True)
class DeleteEntity:
    """Takes an entity out of the world."""

    name: str

    def happen(self, scene: Scene) -> Running:
        """Takes the entity out from the next step on; returns an action that is done."""
        actor = scene.actors[self.name]
        actor.present = False
        actor.word = ActorCommand(self.name, present=False)
        return DONE


def _entity(node: Node, ctx: Context) -> GlobalAction:
    """Compiles the action that adds an entity at a position or deletes it."""
    name, what = ctx.entity(node), node.only()
    if what.tag == "AddEntityAction":
        return AddEntity(name, position(what.child("Position"), ctx))
    if what.tag == "DeleteEntityAction":
        return DeleteEntity(name)
    raise what.unsupported_fault()


@dataclass(frozen=True, slots=True)
class SetValue:
    """A parameter or variable gets another value; change works it out from the old one."""

    name: str
    variable: bool
    change: Callable[[str], str]

    def happen(self, scene: Scene) -> Running:
        """Sets the value at once and returns an action that is done.

        Where the old one is no number, as a change needs, it stays, with a notice.
        """
        values = scene.variables if self.variable else scene.parameters
        old = values[self.name]
        try:
            values[self.name] = self.change(old)
        except ValueError:  # an action before has made it a word
            scene.notice(f"{self.name} = {old!r} is no number and stays as it is")
        return DONE


def _value(node: Node, ctx: Context) -> GlobalAction:
    """Compiles the action that sets, adds to or multiplies a declared variable or parameter."""
    variable = node.tag == "VariableAction"
    known = ctx.variables if variable else ctx.parameters
    name = node.plain("variableRef" if variable else "parameterRef")
    if name not in known:
        raise node.error(f"{'variable' if variable else 'parameter'} {name!r} is not declared")
    what = node.only()
    if what.tag == "SetAction":
        value = what.text("value")
        return SetValue(name, variable, lambda _: value)
    if what.tag != "ModifyAction":
        raise what.unsupported_fault()
    rule = what.child("Rule").only()
    size = rule.number("value")
    try:
        float(known[name])
    except ValueError:
        raise node.error(f"{name!r} is no number and cannot be changed by one") from None
    if rule.tag == "AddValue":
        return SetValue(name, variable, lambda old: as_text(float(old) + size))
    if rule.tag == "MultiplyByValue":
        return SetValue(name, variable, lambda old: as_text(float(old) * size))
    raise rule.unsupported_fault()


@dataclass(frozen=True, slots=True)
class SetSignal:
    """A signal or a controller gets a state; a light of the road shows it, as far as it is a colour."""

    name: str
    state: str

    def happen(self, scene: Scene) -> Running:
        """Sets the signal's state, or its controller's phase, at once; returns an action that is done."""
        scene.signals[self.name] = self.state
        return DONE


def _infrastructure(node: Node, ctx: Context) -> GlobalAction:
    """Compiles the action that sets a traffic signal's state or a signal controller's phase."""
    del ctx
    what = node.child("TrafficSignalAction").only()
    if what.tag == "TrafficSignalStateAction":
        return SetSignal(what.text("name"), what.text("state"))
    if what.tag == "TrafficSignalControllerAction":
        return SetSignal(what.text("trafficSignalControllerRef"), what.text("phase"))
    raise what.unsupported_fault()


@dataclass(frozen=True, slots=True)
class SetEnvironment:
    """Weather, time of day and road; that of <Init> is there from the begin."""

    environment: Environment

    def happen(self, scene: Scene) -> Running:
        """Queues the weather for the next step and sets the clock at once; returns a done action.

        An environment without a time of day leaves the clock as it is.
        """
        scene.environments.append(self.environment)
        scene.tell_time(self.environment)
        return DONE


def _environment(node: Node, ctx: Context) -> GlobalAction:
    """Compiles the action that sets the environment given in place or by a catalogue reference."""
    found = ctx.catalogs.resolve(node.only(), "Environment")
    return SetEnvironment(compile_environment(found, ctx.network.map, ctx.findings))


@dataclass(frozen=True, slots=True)
class UserAction:
    """An action that Python code carries out, found by its name."""

    act: Callable[..., Any]
    text: str

    def happen(self, scene: Scene) -> Running:
        """Calls the user's code at once with the scene and the text; returns an action that is done."""
        self.act(scene, self.text)
        return DONE


def user_defined(node: Node, ctx: Context) -> GlobalAction:
    """Compiles a <UserDefinedAction> by the type of its command; a monitor that is set has no effect.

    A type that is not registered has none either, with a finding.
    """
    command = node.find("CustomCommandAction")
    if command is None:
        return NoEffect(node.tag)
    name = command.text("type")
    act = ctx.names.hook(name, "act")
    if act is None:
        ctx.findings.append(ctx.names.unknown(command, "command", name))
        return NoEffect(node.tag)
    return UserAction(act, (command.element.text or "").strip())


GLOBAL: Mapping[str, Callable[[Node, Context], GlobalAction]] = {
    "EntityAction": _entity,
    "ParameterAction": _value,
    "VariableAction": _value,
    "InfrastructureAction": _infrastructure,
    "EnvironmentAction": _environment,
    "SetMonitorAction": user_defined,
    "TrafficAction": compile_traffic,
}


def global_action(node: Node, ctx: Context) -> GlobalAction:
    """Compiles the action inside a <GlobalAction>; raises an error for an unsupported one."""
    inner = node.only()
    return inner.choose(GLOBAL)(inner, ctx)
