"""A server's own maps as ours: the OpenDRIVE text is fetched, kept as a file, and baked when read."""

from __future__ import annotations

from pathlib import Path

from skidpad.core.errors import BackendError
from skidpad.core.files.names import path_part
from skidpad.simulation.carla.connection import connect, speaking
from skidpad.simulation.carla.options import CarlaOptions
from skidpad.simulation.carla.scene import served_name


def fetch_map(options: CarlaOptions, name: str, folder: Path) -> Path:
    """Writes the OpenDRIVE text of the server's map of that name into `folder` and returns the file.

    Loads the map on the server. BackendError when it has none of that name.
    """
    connection = connect(options)
    with speaking(options, f"fetching map {name}"):
        client = connection.client
        served = served_name(client, name)
        if served is None:
            offered = sorted(m.rsplit("/", 1)[-1] for m in client.get_available_maps())
            raise BackendError(
                f"the CARLA server at {options.address} has no map {name}; it offers: "
                f"{', '.join(offered)}"
            )
        text = client.load_world(served).get_map().to_opendrive()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / path_part(f"{name}.xodr")
    path.write_text(text, encoding="utf-8")
    return path
