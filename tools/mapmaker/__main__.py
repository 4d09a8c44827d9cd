"""Write the bundled maps: `PYTHONPATH=tools python -m mapmaker [FOLDER]`."""

from __future__ import annotations

import sys
from pathlib import Path

from mapmaker import figure8, motorway, straight, town
from skidpad.roads.bundled import FOLDER, bake_file

MAPS = {
    "figure8": figure8.network,
    "motorway": motorway.network,
    "straight": straight.network,
    "town": town.network,
}


def write(folder: Path) -> None:
    """Every map as .xodr and baked beside it."""
    for name, network in MAPS.items():
        path = folder / f"{name}.xodr"
        path.write_bytes(network().text())
        bake_file(path).save(path.with_suffix(".npz"))


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
