"""Maps by name or file: those that come with Skidpad are stored baked, others are baked when read."""

from __future__ import annotations

from functools import lru_cache
from glob import escape
from pathlib import Path

from skidpad.core.files.reading import read_bytes
from skidpad.roads.baked import BakedMap, load_baked
from skidpad.roads.map_files import FOLDER, KEPT, bundled_maps, kept_name, map_file, map_name
from skidpad.roads.queries import RoadMap

__all__ = [
    "FOLDER",
    "KEPT",
    "bake_file",
    "bundled_maps",
    "kept_map",
    "kept_name",
    "load_map",
    "map_file",
    "map_name",
]


def kept_map(folder: Path, name: str, content_hash: str) -> RoadMap:
    """Returns the map of a drive: a file of this name that the campaign's folder keeps, else a bundled one.

    Of several kept files the one with this content hash; where none has it, the first, another content.
    """
    kept = [load_map(file) for file in sorted((folder / KEPT).glob(f"*/{escape(name)}.*"))]
    same = [map for map in kept if map.content_hash == content_hash]
    return (same or kept or [load_map(name)])[0]


def bake_file(path: Path) -> BakedMap:
    """Returns the baked map of an OpenDRIVE file; the name is the file's. FileError for a faulty one."""
    from skidpad.roads.opendrive.bake import bake  # lxml and scipy are needed for baking only
    from skidpad.roads.opendrive.reader import SIZE_MAX

    return bake(read_bytes(path, "map", SIZE_MAX), path.stem, str(path))


def load_map(map: str | Path) -> RoadMap:
    """Returns a bundled map by name, or any OpenDRIVE or baked file; the same file gives the same object.

    A file that has changed is read again. FileError for a file that is missing or faulty, ConfigError for
    an unknown name.
    """
    path = map_file(map)
    return _load(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _load(path: Path, changed: int) -> RoadMap:  # noqa: ARG001  part of the key
    """Returns the map of a file; `changed`, when the file was written, lets the cache forget an older one."""
    if path.suffix == ".npz":
        return RoadMap(load_baked(path))
    stored = path.with_suffix(".npz")
    if path.parent == FOLDER and stored.is_file():
        return RoadMap(load_baked(stored))
    return RoadMap(bake_file(path))
