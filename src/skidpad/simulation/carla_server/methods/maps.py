"""Maps: which there are, the current one, loading, files, layers."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.maps.landscape import ALL_LAYERS
from skidpad.simulation.carla_server.maps.maps import MAX_XODR, PREFIX
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.recording.recorder import safe_path
from skidpad.simulation.carla_server.served import Served

TABLE = Table("maps")
MAX_FILE = 16 * 1024 * 1024
NAVIGATION = "Nav"  # folder


@TABLE.method("get_available_maps")
def get_available_maps(served: Served) -> list[str]:
    """Returns all maps, as CARLA's content paths."""
    return [f"/Game/{PREFIX}{name}" for name in served.maps.names()]


@TABLE.method("get_map_info")
def get_map_info(served: Served) -> list[Any]:
    """Returns name and recommended spawn points of the map."""
    return [
        served.episode.map.full_name,
        [wire.transform(p) for p in served.episode.map.spawn_points],
    ]


@TABLE.method("get_map_data")
def get_map_data(served: Served) -> str:
    """Returns the OpenDRIVE text of the map."""
    return served.episode.map.xodr


@TABLE.method("load_new_episode", Shape.VOID)
def load_new_episode(served: Served, name: Any, reset: Any, layers: Any = ALL_LAYERS) -> None:
    """Loads another map, or with "" the current one anew; CallError for an unknown one."""
    served.load(
        wire.text(name, "map name"),
        wire.flag(reset, "reset_settings"),
        wire.integer(layers, "map layers", 0, ALL_LAYERS),
    )


@TABLE.method("copy_opendrive_to_file", Shape.VOID)
def copy_opendrive_to_file(served: Served, xodr: Any, parameters: Any) -> None:
    """Keeps OpenDRIVE text that the next load shall use; mesh parameters have no effect."""
    wire.items(parameters, "opendrive parameters")
    served.maps.keep_text(wire.text(xodr, "OpenDRIVE", MAX_XODR))


@TABLE.method("get_required_files")
def get_required_files(served: Served, folder: Any) -> list[str]:
    """Returns the name of the navigation mesh, for its folder alone.

    Clients build other caches themselves.
    """
    navigation = (
        served.episode.map.navigation if wire.text(folder, "folder") == NAVIGATION else None
    )
    return [] if navigation is None else [navigation[0]]


@TABLE.method("request_file")
def request_file(served: Served, name: Any) -> bytes:
    """Returns the content of the navigation mesh, or of a file of the data folder (decision K-8).

    CallError for one that there is not, or of more than MAX_FILE bytes.
    """
    asked = wire.text(name, "file name")
    navigation = served.episode.map.navigation
    if navigation is not None and navigation[0] == asked:
        return navigation[1]
    path = safe_path(served.options.data_dir, asked)
    if not path.is_file() or path.stat().st_size > MAX_FILE:
        raise CallError(f"file {path.name} not found")
    return path.read_bytes()


@TABLE.method("get_navigation_mesh")
def get_navigation_mesh(served: Served) -> bytes:
    """Returns the mesh's content; empty where the map has none, and the client then says so."""
    navigation = served.episode.map.navigation
    return b"" if navigation is None else navigation[1]


@TABLE.method("load_map_layer", Shape.VOID)
def load_map_layer(served: Served, layers: Any) -> None:
    """Brings the objects of these layers back, on maps with a layered name."""
    _layer(served, layers, on=True)


@TABLE.method("unload_map_layer", Shape.VOID)
def unload_map_layer(served: Served, layers: Any) -> None:
    """Removes the objects of these layers for all clients, on maps with a layered name."""
    _layer(served, layers, on=False)


def _layer(served: Served, layers: Any, on: bool) -> None:
    """Loads or unloads the map layers of a bit mask and rebuilds the landscape."""
    served.episode.landscape.load(wire.integer(layers, "map layers", 0, ALL_LAYERS), on)
    served.episode.relandscape()
