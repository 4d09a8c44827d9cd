"""Lamps of vehicles: what a file switches on, off or lets flash."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.inputs import Beam
from skidpad.recording.run.lamps import FLASH, Lamp, LampChange, LampMode, lamps_of, newest
from skidpad.scenarios.actions.base import NoEffect, PrivateAction
from skidpad.scenarios.context import Context
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Kind
from skidpad.scenarios.scene import DONE, Actor, Running, Scene

LONGEST = 3600.0  # s of a flash
NO_LAMPS: tuple[tuple[str, bool], ...] = ()


@dataclass(frozen=True, slots=True)
class LightState:
    """Switch a lamp of the entity."""

    lamp: Lamp
    mode: LampMode
    on: float = FLASH
    off: float = FLASH

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Switches the lamp at once and returns an action that is done."""
        change = LampChange(scene.t, actor.name, self.lamp, self.mode, self.on, self.off)
        scene.lamps.append(change)
        return DONE


def compile_light_state(node: Node, ctx: Context) -> PrivateAction:
    """Compiles a <LightStateAction>; one on a lamp of a user's own name has no effect, with a note."""
    kind, state = node.child("LightType").only(), node.child("LightState")
    if kind.tag == "UserDefinedLight":
        name = kind.text("userDefinedLightType")
        ctx.findings.append(kind.finding(f"lamp {name!r} is not known: it does nothing", Kind.NOTE))
        return NoEffect(node.tag)
    mode = state.choice("mode", LampMode)
    times = []
    for attribute in ("flashingOnDuration", "flashingOffDuration"):
        seconds = state.number(attribute, FLASH)
        if mode is LampMode.FLASHING and not 0.0 < seconds <= LONGEST:
            raise state.error(
                f"{attribute} must be above 0 and at most {LONGEST:g} s, got {seconds:g}"
            )
        times.append(seconds)
    return LightState(kind.choice("vehicleLightType", Lamp), mode, *times)


def lit_brake_lamps(scene: Scene) -> tuple[tuple[str, bool], ...]:
    """Returns the entities whose brake lamps the file works, and whether they shine now."""
    if not scene.lamps:
        return NO_LAMPS
    found = newest(scene.lamps, scene.t).items()
    return tuple((name, c.is_lit(scene.t)) for (name, lamp), c in found if lamp is Lamp.BRAKE)


def beam_of_ego(scene: Scene) -> Beam | None:
    """Returns the beam that the file switches the ego's headlights to; None where it says nothing."""
    found = lamps_of(scene.lamps, scene.t, scene.ego)
    low, high = found.get(Lamp.LOW_BEAM), found.get(Lamp.HIGH_BEAM)
    if high is not None and high.is_lit(scene.t):
        return Beam.HIGH
    if low is not None:
        return Beam.LOW if low.is_lit(scene.t) else Beam.OFF
    return None
