"""States of the traffic lights by OpenDRIVE signal id (A-265)."""

from __future__ import annotations

from typing import Any

from skidpad.core.vocabulary import LightState


class TrafficLights:
    """Finds the lights once when cached, else at every reading."""

    def __init__(self, world: Any, cached: bool) -> None:
        self._world = world
        self._known = self._find() if cached else None

    def read(self) -> dict[int, LightState]:
        """By signal id, from the client's newest snapshot."""
        known = self._find() if self._known is None else self._known
        return {id: LightState(int(light.get_state())) for id, light in known}

    def _find(self) -> list[tuple[int, Any]]:
        found = []
        for light in self._world.get_actors().filter("traffic.traffic_light*"):
            text = light.get_opendrive_id()
            if text.lstrip("-").isdigit():  # a light that the map does not know cannot be named
                found.append((int(text), light))
        return sorted(found, key=lambda pair: pair[0])
