"""What `--backend carla` and its options mean for a campaign."""

from __future__ import annotations

import multiprocessing
import sys
from pathlib import Path

from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.files.names import path_part
from skidpad.core.files.reading import is_file
from skidpad.core.simulator import BACKENDS, BackendChoice, BackendKind
from skidpad.roads.map_files import bundled_maps, is_made_map


def check_backend(choice: BackendChoice) -> BackendChoice:
    """Returns the choice, if it can be driven on; ConfigError or BackendError otherwise.

    A CARLA server that is not started by us must answer now.
    """
    BACKENDS.get(choice.backend)
    if choice.backend != BackendKind.CARLA:
        return BackendChoice(backend=choice.backend)
    if choice.restart_every and not choice.server_command:
        raise ConfigError("--restart-every needs --server-command: only our own server is ours")
    from skidpad.campaign.driving.backends import carla_options
    from skidpad.simulation.carla.connection import require_server, wheel

    options = carla_options(choice)
    wheel()
    if not choice.server_command:
        require_server(options)
    return choice


def map_of(map: str, choice: BackendChoice) -> str:
    """Returns a bundled map or a file as it is; a CARLA server's own map is fetched to a file.

    Raises BackendError when that fails.
    """
    named = map in bundled_maps() or is_made_map(map) or is_file(Path(map)) or Path(map).suffix
    if choice.backend != BackendKind.CARLA or named:
        return map
    from skidpad.core.kernels.jit import user_cache

    folder = user_cache() / "carla-maps"
    # In a process of its own: the wheel's threads can end their process at its exit.
    process = multiprocessing.get_context("spawn").Process(
        target=_fetch, args=(choice, map, folder)
    )
    process.start()
    process.join()
    path = folder / path_part(f"{map}.xodr")
    if not path.is_file() or process.exitcode == 1:
        raise BackendError(f"map {map} could not be fetched from the CARLA server")
    return str(path)


def _fetch(choice: BackendChoice, map: str, folder: Path) -> None:
    """Fetches the map from the CARLA server into the folder; ends the process with 1 if that fails."""
    from skidpad.campaign.driving.backends import carla_options, keep_server
    from skidpad.simulation.carla.mapping import fetch_map

    keep_server(choice)
    try:
        fetch_map(carla_options(choice), map, folder)
    except BackendError as error:
        print(error, file=sys.stderr)
        raise SystemExit(1) from None


def drives_alone(choice: BackendChoice) -> bool:
    """Returns True for a CARLA server, which drives one run at a time."""
    return choice.backend == BackendKind.CARLA
