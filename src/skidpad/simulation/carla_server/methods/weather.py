"""Weather, street lamps and the few numbers of the physics engine."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.rpc import Shape, Table
from skidpad.simulation.carla_server.world import World

TABLE = Table("weather")
NO_LAMPS = "maps have no street lamps"


@TABLE.method("get_weather_parameters")
def get_weather_parameters(world: World) -> list[float]:
    """As last set."""
    return world.sky.packed()


@TABLE.method("set_weather_parameters", Shape.VOID)
def set_weather_parameters(world: World, weather: Any) -> None:
    """Acts on grip and sensors from the next tick on."""
    world.sky.apply(weather)


@TABLE.method("query_lights_state")
def query_lights_state(_: World, client: Any) -> list[Any]:
    """No street lamps."""
    wire.text(client, "client")
    return []


@TABLE.method("update_lights_state", Shape.VOID, without_effect=NO_LAMPS)
def update_lights_state(_: World, client: Any, lights: Any, discard: Any = False) -> None:
    """Accepted."""
    wire.text(client, "client")
    wire.items(lights, "lights")
    wire.flag(discard, "discard_client")


@TABLE.method("update_day_night_cycle", Shape.VOID, without_effect=NO_LAMPS)
def update_day_night_cycle(_: World, client: Any, active: Any) -> None:
    """Accepted."""
    wire.text(client, "client")
    wire.flag(active, "active")


@TABLE.method("get_imui_sensor_gravity")
def get_imui_sensor_gravity(world: World) -> float:
    """m/s^2 that IMUs feel."""
    return world.sensors.gravity


@TABLE.method("set_imui_sensor_gravity", Shape.VOID)
def set_imui_sensor_gravity(world: World, gravity: Any) -> None:
    """m/s^2 that IMUs feel."""
    world.sensors.gravity = wire.number(gravity, "gravity")
