"""What stands around: environment objects, boxes, rays, debug shapes, textures."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.maps import scenery
from skidpad.simulation.carla_server.maps.landscape import EnvironmentObject, objects
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import Shape, Table
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.carla_server.served import Served

TABLE = Table("scenery")
ANY = 0xFF
NO_PAINT = "the map's surfaces cannot be painted"


@TABLE.method("draw_debug_shape", Shape.VOID)
def draw_debug_shape(served: Served, shape: Any) -> None:
    """Keeps a debug shape for its life time; nothing is drawn."""
    served.episode.debug.draw(shape)


@TABLE.method("clear_debug_shape", Shape.VOID)
def clear_debug_shape(served: Served) -> None:
    """Removes all debug shapes but the texts."""
    served.episode.debug.clear(texts=False)


@TABLE.method("clear_debug_string", Shape.VOID)
def clear_debug_string(served: Served) -> None:
    """Removes all debug texts from the world."""
    served.episode.debug.clear(texts=True)


def _objects_with_tag(served: Served, tag: Any) -> list[EnvironmentObject]:
    """Returns the environment objects with that semantic tag; the tag ANY takes all."""
    label = wire.integer(tag, "tag", 0, ANY)
    return [o for o in objects(served.episode.map.roads) if label in (ANY, o.label)]


@TABLE.method("get_all_level_BBs")
def get_all_level_bbs(served: Served, tag: Any) -> list[Any]:
    """Returns the boxes of what belongs to the map and has a tag, hidden objects too."""
    return [o.box() for o in _objects_with_tag(served, tag)]


@TABLE.method("get_environment_objects")
def get_environment_objects(served: Served, tag: Any) -> list[Any]:
    """Returns what belongs to the map and has a tag, hidden objects too."""
    return [o.pack() for o in _objects_with_tag(served, tag)]


@TABLE.method("enable_environment_objects", Shape.VOID)
def enable_environment_objects(served: Served, ids: Any, enable: Any) -> None:
    """Shows or hides objects for all clients; unknown ids change nothing."""
    known = [wire.integer(id, "id") for id in wire.items(ids, "ids")]
    served.episode.landscape.toggle(known, wire.flag(enable, "enable"))
    served.episode.relandscape()


@TABLE.method("get_names_of_all_objects")
def get_names_of_all_objects(served: Served) -> list[str]:
    """Returns the names of what belongs to the map."""
    return [o.name for o in objects(served.episode.map.roads)]


def _trace_ray(served: Served, start: Vector, way: Vector, reach: float) -> list[scenery.Hit]:
    """Returns the hits of a ray with the landscape and the actors within `reach` in m."""
    return scenery.trace_ray(served.episode.landscape, served.episode.actors, start, way, reach)


@TABLE.method("project_point")
def project_point(served: Served, location: Any, direction: Any, distance: Any) -> list[Any]:
    """Returns [hit, [location, label]] of the first thing on a ray; False and zeros for none."""
    start = wire.iso_vector(location, "location")
    way = wire.iso_vector(direction, "direction")
    hits = _trace_ray(served, start, way, wire.number(distance, "distance"))
    if not hits:
        return [False, [[0.0, 0.0, 0.0], 0]]
    return [True, [list(wire.iso_to_wire(hits[0].place)), hits[0].label]]


@TABLE.method("cast_ray")
def cast_ray(served: Served, start: Any, end: Any) -> list[Any]:
    """Returns [location, label] of all things between two points, near to far."""
    a, b = wire.iso_vector(start, "start"), wire.iso_vector(end, "end")
    way = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    length = sum(v * v for v in way) ** 0.5
    hits = _trace_ray(served, a, way, length) if length > 0.0 else []
    return [[list(wire.iso_to_wire(h.place)), h.label] for h in hits]


for _name in ("apply_color_texture_to_objects", "apply_float_color_texture_to_objects"):

    @TABLE.method(_name, Shape.VOID, without_effect=NO_PAINT)
    def paint(_: Served, names: Any, material: Any, texture: Any) -> None:
        """Accepts new materials and textures and does nothing."""
        wire.items(names, "names")
        wire.integer(material, "material")
        wire.items(texture, "texture")


@TABLE.method(
    "set_annotations_traverse_translucency", Shape.VOID, without_effect="nothing is translucent"
)
def set_annotations_traverse_translucency(_: Served, enable: Any) -> None:
    """Accepts the switch and does nothing."""
    wire.flag(enable, "enable")
