"""Maps: which there are, the current one, loading, files, layers."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.maps import MAX_XODR, PREFIX
from skidpad.simulation.carla_server.recorder import safe_path
from skidpad.simulation.carla_server.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.world import World

TABLE = Table("maps")
MAX_FILE = 16 * 1024 * 1024
NO_LAYERS = "maps have no layers"


@TABLE.method("get_available_maps")
def get_available_maps(world: World) -> list[str]:
    """All maps, as CARLA's content paths."""
    return [f"/Game/{PREFIX}{name}" for name in world.maps.names()]


@TABLE.method("get_map_info")
def get_map_info(world: World) -> list[Any]:
    """Name and recommended spawn points."""
    return [world.map.full_name, [wire.transform(p) for p in world.map.spawn_points]]


@TABLE.method("get_map_data")
def get_map_data(world: World) -> str:
    """The OpenDRIVE text."""
    return world.map.xodr


@TABLE.method("load_new_episode", Shape.VOID)
def load_new_episode(world: World, name: Any, reset: Any, layers: Any = 0) -> None:
    """Another map; "" loads the current one anew."""
    wire.integer(layers, "map layers")
    world.load(wire.text(name, "map name"), wire.flag(reset, "reset_settings"))


@TABLE.method("copy_opendrive_to_file", Shape.VOID)
def copy_opendrive_to_file(world: World, xodr: Any, parameters: Any) -> None:
    """OpenDRIVE text that the next load shall use; mesh parameters have no effect."""
    wire.items(parameters, "opendrive parameters")
    world.maps.keep_text(wire.text(xodr, "OpenDRIVE", MAX_XODR))


@TABLE.method("get_required_files")
def get_required_files(_: World, folder: Any) -> list[str]:
    """None: clients build their own caches, and there is no navigation mesh."""
    wire.text(folder, "folder")
    return []


@TABLE.method("request_file")
def request_file(world: World, name: Any) -> bytes:
    """A file of the data folder (decision K-8)."""
    path = safe_path(world.options.data_dir, wire.text(name, "file name"))
    if not path.is_file() or path.stat().st_size > MAX_FILE:
        raise CallError(f"file {path.name} not found")
    return path.read_bytes()


@TABLE.method(
    "get_navigation_mesh", without_effect="no navigation mesh: AI walkers stay where they are"
)
def get_navigation_mesh(_: World) -> bytes:
    """Empty: the client then says that it has no mesh."""
    return b""


@TABLE.method("load_map_layer", Shape.VOID, without_effect=NO_LAYERS)
def load_map_layer(_: World, layers: Any) -> None:
    """Accepted."""
    wire.integer(layers, "map layers")


@TABLE.method("unload_map_layer", Shape.VOID, without_effect=NO_LAYERS)
def unload_map_layer(_: World, layers: Any) -> None:
    """Accepted."""
    wire.integer(layers, "map layers")
