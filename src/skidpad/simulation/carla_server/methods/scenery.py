"""What stands around: environment objects, boxes, rays, debug shapes, textures."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server import scenery, wire
from skidpad.simulation.carla_server.rpc import Shape, Table
from skidpad.simulation.carla_server.world import World

TABLE = Table("scenery")
ANY = 0xFF
NO_PAINT = "the map's surfaces cannot be painted"


@TABLE.method("draw_debug_shape", Shape.VOID)
def draw_debug_shape(world: World, shape: Any) -> None:
    """Kept for its life time."""
    world.debug.draw(shape)


@TABLE.method("clear_debug_shape", Shape.VOID)
def clear_debug_shape(world: World) -> None:
    """All but the texts."""
    world.debug.clear(texts=False)


@TABLE.method("clear_debug_string", Shape.VOID)
def clear_debug_string(world: World) -> None:
    """All texts."""
    world.debug.clear(texts=True)


@TABLE.method("get_all_level_BBs")
def get_all_level_bbs(world: World, tag: Any) -> list[Any]:
    """Boxes of what belongs to the map, by tag."""
    label = wire.integer(tag, "tag", 0, ANY)
    return [o.box() for o in scenery.objects(world) if label in (ANY, o.label)]


@TABLE.method("get_environment_objects")
def get_environment_objects(world: World, tag: Any) -> list[Any]:
    """What belongs to the map, by tag."""
    label = wire.integer(tag, "tag", 0, ANY)
    return [o.packed() for o in scenery.objects(world) if label in (ANY, o.label)]


@TABLE.method(
    "enable_environment_objects", Shape.VOID, without_effect="the map's objects stay where they are"
)
def enable_environment_objects(_: World, ids: Any, enable: Any) -> None:
    """Accepted."""
    wire.items(ids, "ids")
    wire.flag(enable, "enable")


@TABLE.method("get_names_of_all_objects")
def get_names_of_all_objects(world: World) -> list[str]:
    """Names of what belongs to the map."""
    return [o.name for o in scenery.objects(world)]


@TABLE.method("project_point")
def project_point(world: World, location: Any, direction: Any, distance: Any) -> list[Any]:
    """[hit, [location, label]] of the first thing on a ray."""
    start = wire.iso_vector(location, "location")
    way = wire.iso_vector(direction, "direction")
    hits = scenery.cast(world, start, way, wire.number(distance, "distance"))
    if not hits:
        return [False, [[0.0, 0.0, 0.0], 0]]
    return [True, [list(wire.iso_to_wire(hits[0].place)), hits[0].label]]


@TABLE.method("cast_ray")
def cast_ray(world: World, start: Any, end: Any) -> list[Any]:
    """All things between two points, near to far."""
    a, b = wire.iso_vector(start, "start"), wire.iso_vector(end, "end")
    way = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    length = sum(v * v for v in way) ** 0.5
    hits = scenery.cast(world, a, way, length) if length > 0.0 else []
    return [[list(wire.iso_to_wire(h.place)), h.label] for h in hits]


for _name in ("apply_color_texture_to_objects", "apply_float_color_texture_to_objects"):

    @TABLE.method(_name, Shape.VOID, without_effect=NO_PAINT)
    def paint(_: World, names: Any, material: Any, texture: Any) -> None:
        """Accepted."""
        wire.items(names, "names")
        wire.integer(material, "material")
        wire.items(texture, "texture")


@TABLE.method(
    "set_annotations_traverse_translucency", Shape.VOID, without_effect="nothing is translucent"
)
def set_annotations_traverse_translucency(_: World, enable: Any) -> None:
    """Accepted."""
    wire.flag(enable, "enable")
