"""Traffic lights: states, times, groups."""

from __future__ import annotations

from typing import Any

from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.catalogue import Family
from skidpad.simulation.carla_server.lights import Light
from skidpad.simulation.carla_server.rpc import Shape, Table
from skidpad.simulation.carla_server.world import World

TABLE = Table("traffic lights")
LONGEST = 1.0e6  # s


def light_of(world: World, id: Any) -> Light:
    """The light with this actor id."""
    light: Light = world.actors.get(id, Family.TRAFFIC_LIGHT).extra
    return light


def parse_state(value: Any) -> LightState:
    """A lamp state."""
    return LightState(wire.integer(value, "traffic light state", 0, 4))


def _seconds(value: Any) -> float:
    return min(max(wire.number(value, "time"), 0.0), LONGEST)


@TABLE.method("set_traffic_light_state", Shape.VOID)
def set_traffic_light_state(world: World, id: Any, state: Any) -> None:
    """Now; its timer starts anew."""
    world.lights.set_state(light_of(world, id), parse_state(state))
    world.lights_changed = True


@TABLE.method("set_traffic_light_green_time", Shape.VOID)
def set_traffic_light_green_time(world: World, id: Any, seconds: Any) -> None:
    """s, of all lights that change together with it."""
    for light in world.lights.phase_of(light_of(world, id)):
        light.green = _seconds(seconds)


@TABLE.method("set_traffic_light_yellow_time", Shape.VOID)
def set_traffic_light_yellow_time(world: World, id: Any, seconds: Any) -> None:
    """s, of all lights that change together with it."""
    for light in world.lights.phase_of(light_of(world, id)):
        light.yellow = _seconds(seconds)


@TABLE.method("set_traffic_light_red_time", Shape.VOID)
def set_traffic_light_red_time(world: World, id: Any, seconds: Any) -> None:
    """s, of all lights that change together with it."""
    for light in world.lights.phase_of(light_of(world, id)):
        light.red = _seconds(seconds)


@TABLE.method("freeze_traffic_light", Shape.VOID)
def freeze_traffic_light(world: World, id: Any, frozen: Any) -> None:
    """Its whole group stands still."""
    world.lights.groups[light_of(world, id).group].frozen = wire.flag(frozen, "freeze")


@TABLE.method("freeze_all_traffic_lights", Shape.VOID)
def freeze_all_traffic_lights(world: World, frozen: Any) -> None:
    """All stand still."""
    world.lights.all_frozen = wire.flag(frozen, "freeze")


@TABLE.method("reset_traffic_light_group", Shape.VOID)
def reset_traffic_light_group(world: World, id: Any) -> None:
    """Its group from the beginning."""
    world.lights.groups[light_of(world, id).group].reset()
    world.lights_changed = True


@TABLE.method("reset_all_traffic_lights", Shape.VOID)
def reset_all_traffic_lights(world: World) -> None:
    """All from the beginning."""
    world.lights.reset()
    world.lights_changed = True


@TABLE.method("get_group_traffic_lights")
def get_group_traffic_lights(world: World, id: Any) -> list[int]:
    """Ids of the lights of its junction."""
    group = world.lights.groups[light_of(world, id).group]
    return [light.actor for light in group.lights()]


@TABLE.method("get_light_boxes")
def get_light_boxes(world: World, id: Any) -> list[Any]:
    """Boxes of its heads in the world."""
    light = light_of(world, id)
    boxes = []
    for head in world.map.roads.roadside.heads:
        if head.signal == light.signal:
            centre = wire.iso_to_wire((head.x, head.y, head.z))
            half = (0.5 * head.lamp_diameter, 0.6 * head.lamp_diameter, 1.7 * head.lamp_diameter)
            boxes.append(wire.box(centre, half, wire.yaw_to_wire(head.heading)))
    return boxes
