"""Weather, street lamps and the few numbers of the physics engine."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import Shape, Table
from skidpad.simulation.carla_server.served import Served

TABLE = Table("weather")
NO_LAMPS = "maps have no street lamps"


@TABLE.method("get_weather_parameters")
def get_weather_parameters(served: Served) -> list[float]:
    """Returns `WeatherParameters` as last set."""
    return served.episode.sky.pack()


@TABLE.method("set_weather_parameters", Shape.VOID)
def set_weather_parameters(served: Served, weather: Any) -> None:
    """Sets the weather, which acts on grip and sensors from the next tick on."""
    served.episode.sky.apply(weather)


@TABLE.method("query_lights_state")
def query_lights_state(_: Served, client: Any) -> list[Any]:
    """Returns an empty list, as there are no street lamps."""
    wire.text(client, "client")
    return []


@TABLE.method("update_lights_state", Shape.VOID, without_effect=NO_LAMPS)
def update_lights_state(_: Served, client: Any, lights: Any, discard: Any = False) -> None:
    """Accepts states of street lamps and does nothing."""
    wire.text(client, "client")
    wire.items(lights, "lights")
    wire.flag(discard, "discard_client")


@TABLE.method("update_day_night_cycle", Shape.VOID, without_effect=NO_LAMPS)
def update_day_night_cycle(_: Served, client: Any, active: Any) -> None:
    """Accepts the switch and does nothing."""
    wire.text(client, "client")
    wire.flag(active, "active")


@TABLE.method("get_imui_sensor_gravity")
def get_imui_sensor_gravity(served: Served) -> float:
    """Returns the gravity that IMUs measure, m/s^2."""
    return served.episode.surroundings.gravity


@TABLE.method("set_imui_sensor_gravity", Shape.VOID)
def set_imui_sensor_gravity(served: Served, gravity: Any) -> None:
    """Sets the gravity that IMUs measure, m/s^2."""
    served.episode.surroundings.gravity = wire.number(gravity, "gravity")
