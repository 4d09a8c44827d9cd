"""Traffic lights: states, times, groups."""

from __future__ import annotations

from typing import Any

from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import Shape, Table
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.world.lights import Group, Light, Lights

TABLE = Table("traffic lights")
LONGEST = 1.0e6  # s


def light_of(served: Served, id: Any) -> Light:
    """Returns the traffic light with this actor id; CallError where there is none."""
    episode = served.episode
    return episode.posts.light(episode.actors.get(id, Family.TRAFFIC_LIGHT).id)


def _lights(served: Served) -> Lights:
    """Returns the traffic lights of the running episode."""
    return served.episode.moving.lights


def _group(served: Served, id: Any) -> Group:
    """Returns the group to which the traffic light of that id belongs."""
    return _lights(served).groups[light_of(served, id).group]


def parse_state(value: Any) -> LightState:
    """Returns the state of a traffic light from its number on the wire, 0 to 4; else WireError."""
    return LightState(wire.integer(value, "traffic light state", 0, 4))


def _seconds(value: Any) -> float:
    """Returns a duration in s read from the wire, cut to 0..LONGEST."""
    return min(max(wire.number(value, "time"), 0.0), LONGEST)


@TABLE.method("set_traffic_light_state", Shape.VOID)
def set_traffic_light_state(served: Served, id: Any, state: Any) -> None:
    """Sets a light's state at once; its timer starts anew."""
    _lights(served).set_state(light_of(served, id), parse_state(state))


@TABLE.method("set_traffic_light_green_time", Shape.VOID)
def set_traffic_light_green_time(served: Served, id: Any, seconds: Any) -> None:
    """Sets the green time in s of all lights that change together with this one."""
    for light in _lights(served).phase_of(light_of(served, id)):
        light.green = _seconds(seconds)


@TABLE.method("set_traffic_light_yellow_time", Shape.VOID)
def set_traffic_light_yellow_time(served: Served, id: Any, seconds: Any) -> None:
    """Sets the yellow time in s of all lights that change together with this one."""
    for light in _lights(served).phase_of(light_of(served, id)):
        light.yellow = _seconds(seconds)


@TABLE.method("set_traffic_light_red_time", Shape.VOID)
def set_traffic_light_red_time(served: Served, id: Any, seconds: Any) -> None:
    """Sets the red time in s of all lights that change together with this one."""
    for light in _lights(served).phase_of(light_of(served, id)):
        light.red = _seconds(seconds)


@TABLE.method("freeze_traffic_light", Shape.VOID)
def freeze_traffic_light(served: Served, id: Any, frozen: Any) -> None:
    """Stops or starts the light's whole group."""
    _group(served, id).frozen = wire.flag(frozen, "freeze")


@TABLE.method("freeze_all_traffic_lights", Shape.VOID)
def freeze_all_traffic_lights(served: Served, frozen: Any) -> None:
    """Stops or restarts the timers of all traffic lights."""
    _lights(served).frozen = wire.flag(frozen, "freeze")


@TABLE.method("reset_traffic_light_group", Shape.VOID)
def reset_traffic_light_group(served: Served, id: Any) -> None:
    """Starts the light's group from the beginning."""
    _lights(served).reset(_group(served, id))


@TABLE.method("reset_all_traffic_lights", Shape.VOID)
def reset_all_traffic_lights(served: Served) -> None:
    """Restarts the cycles of all traffic lights."""
    _lights(served).reset()


@TABLE.method("get_group_traffic_lights")
def get_group_traffic_lights(served: Served, id: Any) -> list[int]:
    """Returns the actor ids of the lights of its junction, its own included."""
    return [served.episode.posts.actor(light) for light in _group(served, id).lights()]


@TABLE.method("get_light_boxes")
def get_light_boxes(served: Served, id: Any) -> list[Any]:
    """Returns the boxes of its heads in the world; [] where the map draws none."""
    light = light_of(served, id)
    boxes = []
    for head in served.episode.map.roads.roadside.heads:
        if head.signal == light.signal:
            centre = wire.iso_to_wire((head.x, head.y, head.z))
            half = (0.5 * head.lamp_diameter, 0.6 * head.lamp_diameter, 1.7 * head.lamp_diameter)
            boxes.append(wire.box(centre, half, wire.yaw_to_wire(head.heading)))
    return boxes
