"""Who drives: assigning and activating controllers, taking over pedals."""

from __future__ import annotations

from dataclasses import dataclass, replace

from skidpad.scenarios.actions.base import NoEffect, PrivateAction
from skidpad.scenarios.context import Context
from skidpad.scenarios.document import Node
from skidpad.scenarios.findings import Fault, Kind
from skidpad.scenarios.scene import DONE, Actor, Running, Scene

OVERRIDES = ("Throttle", "Brake", "Clutch", "ParkingBrake", "SteeringWheel", "Gear")


@dataclass(frozen=True, slots=True)
class Activate:
    """Hand the entity to its controller, or take it back; None leaves a domain as it is."""

    lateral: bool | None
    longitudinal: bool | None

    @property
    def says(self) -> bool | None:
        """Whether a controller is active afterwards; None: as before."""
        if self.lateral is None and self.longitudinal is None:
            return None
        return bool(self.lateral or self.longitudinal)

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Only an entity with a controller of its own (the ego) changes hands."""
        if actor.mode is not None or self.says is None:
            return DONE
        if actor.handed and not self.says:
            actor.follow_road(scene.network, actor.v)
        actor.handed = self.says
        return DONE


@dataclass(frozen=True, slots=True)
class Several:
    """Actions of one element, one after the other."""

    actions: tuple[PrivateAction, ...]

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """All at once."""
        for action in self.actions:
            action.begin(scene, actor)
        return DONE


def _flag(node: Node, name: str) -> bool | None:
    return node.flag(name, default=False) if node.has(name) else None


def compile_activate(node: Node, ctx: Context) -> Activate:
    """An <ActivateControllerAction>."""
    del ctx
    return Activate(_flag(node, "lateral"), _flag(node, "longitudinal"))


def compile_assign(node: Node, ctx: Context) -> Activate:
    """An <AssignControllerAction>; before 1.1 it also activated what it assigned."""
    for reference in node.children("CatalogReference"):
        try:
            ctx.catalogs.entry(reference)
        except Fault as fault:
            ctx.findings.append(replace(fault.finding, kind=Kind.NOTE))
    return Activate(_flag(node, "activateLateral"), _flag(node, "activateLongitudinal"))


def compile_override(node: Node, ctx: Context) -> PrivateAction:
    """An <OverrideControllerValueAction>; taking nothing over changes nothing."""
    del ctx
    taken = False
    for part in node.children():
        if part.tag not in OVERRIDES:
            raise part.unsupported()
        taken = taken or part.flag("active", default=False)
    return NoEffect(node.tag) if taken else Several(())


def compile_controller(node: Node, ctx: Context) -> PrivateAction:
    """A <ControllerAction>: one of these, or before 1.1 several."""
    made = [TABLE[child.tag](child, ctx) for child in node.children() if _known(child)]
    if not made:
        raise node.error("needs an action")
    return made[0] if len(made) == 1 else Several(tuple(made))


def _known(node: Node) -> bool:
    if node.tag not in TABLE:
        raise node.unsupported()
    return True


def no_effect(node: Node, ctx: Context) -> NoEffect:
    """Something that nobody here can see."""
    del ctx
    return NoEffect(node.tag)


TABLE = {
    "AssignControllerAction": compile_assign,
    "ActivateControllerAction": compile_activate,
    "OverrideControllerValueAction": compile_override,
}
