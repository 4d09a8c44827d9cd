"""Python classes that files reach by name: controllers of actors, actions and values of users.

A file names them and nothing more: it never says what is imported. Names come from `register` in
Python, or from `--register NAME=module:Class` on the command line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.objects.registry import Registry
from skidpad.core.states import VehicleCommand
from skidpad.core.text.told import describe_value
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import read_properties
from skidpad.scenarios.reading.findings import Finding, Kind
from skidpad.scenarios.scene import Scene
from skidpad.scenarios.traffic import lead_of
from skidpad.simulation.world.traffic.idm import Character, idm

Make = Callable[..., Any]
REGISTERED: dict[str, Make] = {}


def register(name: str, made: Make) -> None:
    """Let files name a class of yours.

    Args:
        name: As files write it: the name of a Controller, the type of a CustomCommandAction, or the
            name of a UserDefinedValueCondition.
        made: A class. A controller is made with its properties (a dict of texts) and has
            `update(scene, name)`, which returns an acceleration in m/s^2, or `drive(scene, name)`,
            which returns a `VehicleCommand`. Others are made without arguments: an action has
            `act(scene, text)`, a value has `value(scene)`.
    """
    if not name or not callable(made):
        raise ConfigError(f"register needs a name and a class, got {name!r} and {made!r}")
    REGISTERED[name] = made


class Acc:
    """Adaptive cruise control by the Intelligent Driver Model: controller `ACC`.

    Properties: setSpeed, m/s (default: the speed at which it is activated); timeGap, s.
    """

    checks_properties = True

    def __init__(self, properties: Mapping[str, str]) -> None:
        self.v_set = _number(properties, "setSpeed", -1.0)
        headway = _number(properties, "timeGap", Character().headway)
        self.character = Character(headway=headway)

    def update(self, scene: Scene, name: str) -> float:
        """Returns the acceleration in m/s^2 behind the vehicle ahead in the lane.

        Without `setSpeed` the speed at the first call is kept.
        """
        actor = scene.actors[name]
        if self.v_set < 0.0:
            self.v_set = actor.guide.v
        gap, v_lead = (inf, 0.0) if actor.guide.base is None else lead_of(scene, actor)
        return float(idm(actor.guide.v, self.v_set, gap, v_lead, self.character))


def _number(properties: Mapping[str, str], name: str, default: float) -> float:
    """Returns a controller's property as a finite number; raises ConfigError where it is none."""
    try:
        value = float(properties.get(name, default))
    except ValueError:
        value = inf
    if not isfinite(value):
        raise ConfigError(f"property {name} of a controller must be a number")
    return value


@dataclass(frozen=True, slots=True)
class ScenarioName:
    """A name that scenario files may use, as `register` describes it.

    Attributes:
        name: As files write it.
        title: A few words for tables.
        made: A class with `update` (controller), `act` (action) or `value` (condition).
        units: What a controller, action or value takes or gives, with units.
    """

    name: str
    title: str
    made: Make
    units: str = ""


def _own_names() -> tuple[ScenarioName, ...]:
    """Returns the registry entries of the controllers that are built in."""
    title, units = "Controller: Intelligent Driver Model", "setSpeed in m/s, timeGap in s"
    return tuple(ScenarioName(name, title, made, units) for name, made in BUILT_IN.items())


BUILT_IN: Mapping[str, Make] = {"ACC": Acc, "ACCController": Acc}
SCENARIO_NAMES = Registry("scenario name", "skidpad.scenario_names", ScenarioName, _own_names)


@dataclass
class Names:
    """The names that one file may use. strict: one that is not known is an error, else a note.

    asked: those that it did use.
    """

    given: Mapping[str, Make] = field(default_factory=dict)
    strict: bool = False
    asked: set[str] = field(default_factory=set)
    _made: dict[str, Any] = field(default_factory=dict)

    def find(self, name: str) -> Make | None:
        """Returns the class of this name; None where it is not registered."""
        self.asked.add(name)
        found = {**BUILT_IN, **REGISTERED, **self.given}.get(name)
        if found is None and name in SCENARIO_NAMES.sources():
            found = SCENARIO_NAMES.get(name).made
        return found

    def unknown(self, node: Node, what: str, name: str) -> Finding:
        """Returns the finding on a name that is not registered; an error if strict, else a note."""
        text = f"{what} {name!r} is not registered: it does nothing"
        return node.finding(text, Kind.ERROR if self.strict else Kind.NOTE)

    def hook(self, name: str, method: str) -> Callable[..., Any] | None:
        """Returns a method of the one object of this name in this file; None: not registered.

        ConfigError where the object has no such method.
        """
        made = self.find(name)
        if made is None or name in BUILT_IN:
            return None
        if name not in self._made:
            self._made[name] = call(name, made)
        found = getattr(self._made[name], method, None)
        if found is None:
            raise ConfigError(f"{name!r}, as it is registered, has no method {method}")
        return lambda *args: call(name, found, *args)


def call(name: str, function: Callable[..., Any], *args: Any) -> Any:
    """Calls a user's code and returns its result; what it raises becomes a ConfigError in one sentence."""
    try:
        return function(*args)
    except ConfigError:
        raise
    except Exception as error:
        raise ConfigError(
            f"{name!r}, as it is registered, failed: {describe_value(error)}"
        ) from error


@dataclass(frozen=True, slots=True)
class ControllerOf:
    """A controller that a file gives to an entity, not yet made."""

    name: str
    properties: Mapping[str, str]
    made: Make

    def make(self) -> ActiveController:
        """Returns a new controller for one run."""
        return ActiveController(self.name, call(self.name, self.made, dict(self.properties)))


@dataclass(slots=True)
class ActiveController:
    """A controller of an actor: along its lane, or with pedals and steer."""

    name: str
    inner: Any

    @property
    def drives(self) -> bool:
        """Returns whether it gives pedals and steer, by a method `drive`."""
        return hasattr(self.inner, "drive")

    def command(self, scene: Scene, actor: str) -> VehicleCommand:
        """Returns pedals and steer; ConfigError for anything else."""
        found = call(self.name, self.inner.drive, scene, actor)
        if not isinstance(found, VehicleCommand) or not all(
            isfinite(v) for v in (found.throttle, found.brake, found.steer)
        ):
            raise ConfigError(
                f"controller {self.name!r} must return a VehicleCommand of finite numbers from "
                f"drive, got {describe_value(found, 100)}"
            )
        return found

    def acceleration(self, scene: Scene, actor: str) -> float:
        """Returns the acceleration that it asks for, m/s^2; ConfigError for what is no number."""
        a = call(self.name, self.inner.update, scene, actor)
        if not isinstance(a, (int, float)) or not isfinite(a):
            raise ConfigError(
                f"controller {self.name!r} must return m/s^2, got {describe_value(a, 100)}"
            )
        return float(a)


def controller_of(node: Node, names: Names) -> tuple[ControllerOf | None, Finding | None]:
    """Returns the controller inside a <Controller>, or what is said where it is not known.

    One of both is None.
    """
    name = node.text("name")
    made = names.find(name)
    if made is None:
        return None, names.unknown(node, "controller", name)
    properties = read_properties(node)
    if getattr(made, "checks_properties", False):
        try:
            made(properties)
        except ConfigError as error:
            return None, node.finding(f"controller {name!r}: {error}", Kind.ERROR)
    return ControllerOf(name, properties, made), None
