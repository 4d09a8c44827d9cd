"""Who drives: assigning and activating controllers, taking over pedals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import pi
from types import MappingProxyType

from skidpad.core.courses import ActorMode
from skidpad.scenarios.actions.base import NoEffect, PrivateAction
from skidpad.scenarios.context import Context
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Fault, Kind
from skidpad.scenarios.registry import ControllerOf, controller_of
from skidpad.scenarios.scene import DONE, Actor, Running, Scene

FULL_LOCK = 3.0 * pi  # rad of a steering wheel, to either side; assumption
BACKWARDS = "r"  # of an automatic gear box


@dataclass(frozen=True, slots=True)
class Activate:
    """Hand the entity to its controller, or take it back; None leaves a domain as it is."""

    lateral: bool | None
    longitudinal: bool | None
    controllers: Mapping[str, ControllerOf] = field(default_factory=dict)  # of entities, by name
    assigned: ControllerOf | None = None

    @property
    def says(self) -> bool | None:
        """Returns whether a controller is active afterwards; None: as before."""
        if self.lateral is None and self.longitudinal is None:
            return None
        return bool(self.lateral or self.longitudinal)

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Hands an actor to its controller or to the file, and returns an action that is done.

        For the ego this says which of the two drives; others have a controller only where one of a known
        name is theirs.
        """
        actor.assigned = self.assigned or actor.assigned
        if actor.mode is not None and self.says is not None:
            self._switch(scene, actor)
        if actor.mode is not None or self.says is None:
            return DONE
        if actor.handed and not self.says:
            actor.follow_road(scene.network, actor.v)
        actor.handed = self.says
        return DONE

    def _switch(self, scene: Scene, actor: Actor) -> None:
        """Turns the domains of the controller of another actor than the ego on and off."""
        found = actor.assigned or self.controllers.get(actor.name)
        asked = zip((self.lateral, self.longitudinal), actor.controls, strict=True)
        lateral, longitudinal = (old if new is None else new for new, old in asked)
        before, actor.controls = actor.controller, (lateral, longitudinal)
        if found is None or not (lateral or longitudinal):
            actor.controller = None
            if before is not None and before.drives:
                actor.piloted = None
                actor.follow_road(scene.network, actor.motion.speed)
        elif before is None or self.longitudinal:
            actor.controller = found.make()


@dataclass(frozen=True, slots=True)
class Several:
    """Actions of one element, one after the other."""

    actions: tuple[PrivateAction, ...]

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Begins all actions at once and returns an action that is done."""
        for action in self.actions:
            action.begin(scene, actor)
        return DONE


def _flag(node: Node, name: str) -> bool | None:
    """Returns the boolean attribute of that name; None where the node lacks the attribute."""
    return node.flag(name, default=False) if node.has(name) else None


def compile_activate(node: Node, ctx: Context) -> Activate:
    """Compiles an <ActivateControllerAction>; a flag that it omits is None, for no change."""
    return Activate(_flag(node, "lateral"), _flag(node, "longitudinal"), ctx.controllers)


def compile_assign(node: Node, ctx: Context) -> Activate:
    """Compiles an <AssignControllerAction>; before 1.1 it also activated what it assigned.

    A controller that is not known becomes a note.
    """
    found: ControllerOf | None = None
    for one in node.children("CatalogReference", "Controller"):
        try:
            found, unknown = controller_of(ctx.catalogs.resolve(one, "Controller"), ctx.names)
        except Fault as fault:
            ctx.findings.append(replace(fault.finding, kind=Kind.NOTE))
            continue
        if unknown is not None:
            ctx.findings.append(replace(unknown, kind=Kind.NOTE))
    lateral, longitudinal = _flag(node, "activateLateral"), _flag(node, "activateLongitudinal")
    return Activate(lateral, longitudinal, ctx.controllers, found)


@dataclass(frozen=True, slots=True)
class Override:
    """Inputs of a vehicle that the file works itself; None gives one back to the driver."""

    inputs: Mapping[str, float | None]  # by field of a VehicleCommand

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Sets pedals and wheel from now on, and returns an action that is done.

        An entity that is placed by the file, or has no driver, has none: a notice says so.
        """
        if actor.mode is ActorMode.IDEAL or actor.driver is None:
            return NoEffect("OverrideControllerValueAction").begin(scene, actor)
        for name, value in self.inputs.items():
            if value is None:
                actor.worked.pop(name, None)
            else:
                actor.worked[name] = value
        return DONE


def compile_override(node: Node, ctx: Context) -> PrivateAction:
    """Compiles an <OverrideControllerValueAction>; without a supported input it has no effect."""
    del ctx
    inputs: dict[str, float | None] = {}
    for part in node.children():
        name, value = part.choose(INPUTS)
        active = part.flag("active", default=False)
        if name and not (active and part.find("BrakeForce") is not None):
            inputs[name] = value(part) if active else None
    return Override(inputs) if inputs else NoEffect(node.tag)


def _read_pedal(node: Node) -> float:
    """Returns how far an element presses a pedal, 0 to 1."""
    percent = node.find("BrakePercent")
    return min(max((percent or node).number("value"), 0.0), 1.0)


def _steer(node: Node) -> float:
    """Returns the steering command in -1..1: the wheel angle `value` in rad over full lock, clipped."""
    return min(max(node.number("value") / FULL_LOCK, -1.0), 1.0)


def _reverse(node: Node) -> bool:
    """Returns whether the file puts the automatic or manual gear box into reverse."""
    automatic = node.find("AutomaticGear")
    if automatic is not None:
        return automatic.text("gear") == BACKWARDS
    manual = node.find("ManualGear")
    return manual is not None and manual.number("number" if manual.has("number") else "gear") < 0.0


# field of a VehicleCommand and how it is read; there is no clutch
INPUTS: Mapping[str, tuple[str, Callable[[Node], float]]] = MappingProxyType(
    {
        "Throttle": ("throttle", _read_pedal),
        "Brake": ("brake", _read_pedal),
        "ParkingBrake": ("handbrake", lambda node: _read_pedal(node) > 0.0),
        "SteeringWheel": ("steer", _steer),
        "Gear": ("reverse", _reverse),
        "Clutch": ("", _read_pedal),
    }
)


@dataclass(frozen=True, slots=True)
class Visibility:
    """Whether sensors see the entity."""

    sensors: bool

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Sets whether sensors see the actor from the next step on, and returns an action that is done."""
        del scene
        actor.visible = self.sensors
        return DONE


def compile_visibility(node: Node, ctx: Context) -> Visibility:
    """Compiles a <VisibilityAction>; pictures for people and other traffic go by its `sensors`, too."""
    del ctx
    return Visibility(node.flag("sensors", default=True))


def compile_controller(node: Node, ctx: Context) -> PrivateAction:
    """Compiles a <ControllerAction>: one action, or before 1.1 several."""
    made = [child.choose(TABLE)(child, ctx) for child in node.children()]
    if not made:
        raise node.error("needs an action")
    return made[0] if len(made) == 1 else Several(tuple(made))


def no_effect(node: Node, ctx: Context) -> NoEffect:
    """Compiles an action that nothing in the simulation can perceive."""
    del ctx
    return NoEffect(node.tag)


TABLE = {
    "AssignControllerAction": compile_assign,
    "ActivateControllerAction": compile_activate,
    "OverrideControllerValueAction": compile_override,
}
