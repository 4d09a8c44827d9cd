"""The server's world for a set-up: map, time step, weather."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skidpad.core.errors import BackendError
from skidpad.core.setup import Setup
from skidpad.core.vocabulary import SensorLevel
from skidpad.roads.bundled import map_file
from skidpad.simulation.carla.connection import Connection

# Parameters for towns and highways without buildings: no walls, a shoulder to come to rest on.
GENERATION = {
    "vertex_distance": 2.0,
    "max_road_length": 500.0,
    "wall_height": 0.0,
    "additional_width": 0.6,
    "smooth_junctions": True,
    "enable_mesh_visibility": True,
}


def load_scene(connection: Connection, setup: Setup) -> Any:
    """Loads the set-up's map and returns its carla.World, fresh and without actors.

    The server's own map is taken when it has one of that name and content, else it makes one from
    our OpenDRIVE text. BackendError where there is neither.
    """
    client, path = connection.client, map_file(setup.map)
    text = opendrive_text(path)
    name = served_name(client, path.stem)
    if name is not None:
        world = client.load_world(name)
        if text is None or same_roads(world.get_map().to_opendrive(), text):
            return world
    if text is None:
        raise BackendError(
            f"the CARLA server at {connection.options.address} has no map {path.stem}, "
            f"and {path} holds no OpenDRIVE text to make one from"
        )
    parameters = connection.carla.OpendriveGenerationParameters(**GENERATION)
    return client.generate_opendrive_world(text, parameters)


def served_name(client: Any, name: str) -> str | None:
    """Returns the server's full name of a map named without folders; None when it has none."""
    return next((m for m in client.get_available_maps() if m.rsplit("/", 1)[-1] == name), None)


def opendrive_text(path: Path) -> str | None:
    """Returns the OpenDRIVE text of a map's file; None for a baked one."""
    if path.suffix == ".npz":
        return None
    return path.read_text(encoding="utf-8", errors="replace")


def same_roads(a: str, b: str) -> bool:
    """Returns whether two texts are one map; line ends and the space around do not matter."""
    return a.split() == b.split()


def synchronise(world: Any, setup: Setup) -> None:
    """Sets a fixed step and synchronous mode (A-001); rendering is off where no camera is read."""
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = setup.dt
    settings.no_rendering_mode = setup.level is SensorLevel.OBJECTS
    settings.deterministic_ragdolls = True
    world.apply_settings(settings)


def release(world: Any) -> None:
    """Makes the server asynchronous again, so that the next client finds one that ticks by itself."""
    world.freeze_all_traffic_lights(False)
    world.reset_all_traffic_lights()
    settings = world.get_settings()
    settings.synchronous_mode = False
    settings.fixed_delta_seconds = None
    settings.no_rendering_mode = False
    world.apply_settings(settings)
