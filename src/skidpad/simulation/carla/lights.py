"""Traffic lights by OpenDRIVE signal id: what they show (A-265), and our programme on them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from skidpad.core.vocabulary import LightState
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.lights import Lights


class TrafficLights:
    """Finds the lights once when cached, else at every reading."""

    def __init__(self, world: Any, cached: bool) -> None:
        self._world = world
        self._known = find_lights(world) if cached else None

    def read(self) -> dict[int, LightState]:
        """Returns states by signal id, from the client's newest snapshot."""
        known = find_lights(self._world) if self._known is None else self._known
        return {id: LightState(int(light.get_state())) for id, light in known}


def find_lights(world: Any) -> list[tuple[int, Any]]:
    """Returns lights with their OpenDRIVE signal ids, sorted by id; those without a number are left out."""
    found = []
    for light in world.get_actors().filter("traffic.traffic_light*"):
        text = light.get_opendrive_id()
        if text.lstrip("-").isdigit():  # a light that the map does not know cannot be named
            found.append((int(text), light))
    return sorted(found, key=lambda pair: pair[0])


class Programme:
    """The cycle of the embedded simulator, with the seed's phases (decision M-2), on the server.

    The server's own clocks stand still meanwhile.
    """

    def __init__(self, carla: Any, world: Any, map: RoadMap, seed: int, dt: float) -> None:
        self._carla = carla
        self._cycle, self._dt, self._tick = Lights.pretimed(map, seed, dt), dt, 0
        self._lights = find_lights(world)
        self._shown: dict[int, LightState] = {}
        world.freeze_all_traffic_lights(True)
        self.show(0)

    def hold(self, held: Iterable[tuple[int, LightState]]) -> None:
        """Holds lights in states that a client has set, by signal id, from the next `show` on."""
        self._cycle.hold(held)

    def show(self, tick: int) -> None:
        """Sets the lights as belongs to this tick; the server shows it in the coming one."""
        while self._tick < tick:
            self._cycle.advance(self._dt)
            self._tick += 1
        for id, light in self._lights:
            state = self._cycle.by_id.get(id)
            if state is not None and self._shown.get(id) is not state:
                light.set_state(self._carla.TrafficLightState.values[int(state)])
                self._shown[id] = state
