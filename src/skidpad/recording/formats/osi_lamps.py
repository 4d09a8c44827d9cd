"""Lamps of vehicles in OSI GroundTruth: those of the ego's pedals, and those that a file switches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from skidpad.recording.run.lamps import Lamp, LampChange, newest
from skidpad.recording.run.log import RunLog

EGO = 0
BRAKING = 0.05  # of a pedal, above which brake lamps shine, as in the embedded world
GENERIC: Mapping[Lamp, tuple[str, ...]] = {  # fields of LightState by lamp
    Lamp.LOW_BEAM: ("head_light",),
    Lamp.HIGH_BEAM: ("high_beam",),
    Lamp.FOG: ("front_fog_light", "rear_fog_light"),
    Lamp.FOG_FRONT: ("front_fog_light",),
    Lamp.FOG_REAR: ("rear_fog_light",),
    Lamp.REVERSING: ("reversing_light",),
    Lamp.PLATE: ("license_plate_illumination_rear",),
    Lamp.SPECIAL: ("emergency_vehicle_illumination",),
}
INDICATORS = {Lamp.WARNING: "WARNING", Lamp.LEFT: "LEFT", Lamp.RIGHT: "RIGHT"}


def write_lamps_of(moving: Any, log: RunLog, k: int, i: int, changes: Sequence[LampChange]) -> None:
    """Writes the lamps of actor i at row k of the log, as far as anything says how they are."""
    if moving.type != moving.TYPE_VEHICLE:
        return
    if i == EGO:
        state = moving.vehicle_classification.light_state
        braking = float(log.applied.brake[k]) > BRAKING
        state.brake_light_state = _brake(state, braking)
        state.reversing_light = _generic(state, bool(log.applied.reverse[k] > 0.0))
    if changes:
        t, name = float(log.t[k]), log.table.names[i]
        found = {lamp: c for (entity, lamp), c in newest(changes, t).items() if entity == name}
        if found:
            _write_switched(moving.vehicle_classification.light_state, found, t)


def _write_switched(state: Any, found: Mapping[Lamp, LampChange], t: float) -> None:
    """Writes the lamps that a file switches at `t` s into an OSI vehicle's light state."""
    for lamp, change in found.items():
        lit = change.is_lit(t)
        for field in GENERIC.get(lamp, ()):
            setattr(state, field, _generic(state, lit))
        if lamp is Lamp.BRAKE:
            state.brake_light_state = _brake(state, lit)
    switched = [lamp for lamp in INDICATORS if lamp in found]
    if switched:
        shine = [lamp for lamp in switched if found[lamp].is_lit(t)]
        both = {Lamp.LEFT, Lamp.RIGHT} <= set(shine)
        word = "WARNING" if both else INDICATORS[shine[0]] if shine else "OFF"
        state.indicator_state = state.IndicatorState.Value(f"INDICATOR_STATE_{word}")


def _generic(state: Any, lit: bool) -> Any:
    """Returns OSI's value of a lamp that is on or off."""
    word = "ON" if lit else "OFF"
    return state.GenericLightState.Value(f"GENERIC_LIGHT_STATE_{word}")


def _brake(state: Any, lit: bool) -> Any:
    """Returns OSI's value of brake lamps that are on or off."""
    word = "NORMAL" if lit else "OFF"
    return state.BrakeLightState.Value(f"BRAKE_LIGHT_STATE_{word}")
