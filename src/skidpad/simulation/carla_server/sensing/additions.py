"""Values of the attributes that are additions of ours: each is a setting of runs, for one sensor."""

from __future__ import annotations

from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.settings.parts import find_setting
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.protocol import wire

# Settings whose names say nothing on a blueprint, or are CARLA's for another thing there.
SETTINGS = {"range_model": "range", "lidar_model": "lidar", "camera_effect": "camera"}


def read_addition(actor: Actor, name: str) -> Any:
    """Returns an attribute's value in the type of its setting; None where the sensor does not have it.

    WireError for a value that the setting does not take.
    """
    if name not in actor.attributes:
        return None
    text, setting = actor.attributes[name], find_setting(SETTINGS.get(name, name))
    try:
        value = setting.read(text)
        setting.require_in_range(value)
    except ConfigError:
        allowed = "true or false" if setting.kind is bool else setting.range_text
        raise wire.WireError(
            f"{actor.blueprint.id}: {name} must be {allowed}, got {text[:40]!r}"
        ) from None
    return value
