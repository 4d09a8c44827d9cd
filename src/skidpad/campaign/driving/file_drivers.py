"""Drivers of ours that scenario files may give to other actors, by name: `ReferenceDriver`."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.traffic.sight import RoadLook
from skidpad.scenarios.scene import Scene
from skidpad.scenarios.traffic import V_UNKNOWN, lead_of
from skidpad.stack.reference.caution import bend_speed, manner, speed_factor, too_fast
from skidpad.stack.reference.following import acceleration
from skidpad.stack.reference.person import person_of


class FollowingDriver:
    """Drives an actor along its lane as the reference driver follows, keeps limits and takes bends.

    Properties: seed, which person it is (default 0); setSpeed, m/s (default: the person's share of
    the limit); road, what it looks like (dry, wet, flooded, snow, ice; default dry). It sees at once
    and without error; junctions and lights are the file's.
    """

    checks_properties = True

    def __init__(self, properties: Mapping[str, str]) -> None:
        self.person = person_of(int(_number(properties, "seed", 0.0)))
        self.v_set = _number(properties, "setSpeed", inf)
        look = properties.get("road", RoadLook.DRY.value)
        if look not in {one.value for one in RoadLook}:
            known = ", ".join(one.value for one in RoadLook)
            raise ConfigError(f"property road of a controller must be one of {known}, got {look!r}")
        self.road = RoadLook(look)

    def update(self, scene: Scene, name: str) -> float:
        """Returns the acceleration, m/s^2, of actor `name` behind the one ahead in its lane."""
        actor = scene.actors[name]
        base, v = actor.guide.base, max(actor.guide.v, 0.0)
        m = manner(self.person, self.road, v)
        if base is None:
            return float(acceleration(v, min(self.v_set, V_UNKNOWN), inf, 0.0, m))
        limit = scene.network.map.limit(base)
        wish = self.person.speed * (V_UNKNOWN if limit is None else limit)
        wish = self.v_set if isfinite(self.v_set) else wish
        wish = min(speed_factor(self.road, v) * wish, bend_speed(self.road, base.curvature))
        gap, v_lead = lead_of(scene, actor)
        a = acceleration(v, wish, gap, max(v_lead, 0.0), m)
        return float(min(a, too_fast(v - wish, self.road, v)) if v > wish else a)


def _number(properties: Mapping[str, str], name: str, default: float) -> float:
    """Returns a property that is a number; ConfigError for anything else."""
    if name not in properties:
        return default
    try:
        value = float(properties[name])
    except ValueError:
        value = inf
    if not (isfinite(value) and value >= 0.0):
        raise ConfigError(f"property {name} of a controller must be a number >= 0")
    return value


FILE_DRIVERS: Mapping[str, Any] = {"ReferenceDriver": FollowingDriver}
