"""Maps by name or file: those that come with Skidpad are stored baked, others are baked when read."""

from __future__ import annotations

from functools import lru_cache
from glob import escape
from hashlib import sha256
from pathlib import Path

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.reading import is_file, read_bytes
from skidpad.roads.baked import BakedMap, load_baked
from skidpad.roads.queries import RoadMap

FOLDER = Path(__file__).parent / "maps"
KEPT = "maps"  # in a campaign's folder: maps/<content>/<name>.xodr


def bundled_maps() -> list[str]:
    """Names of the maps that come with Skidpad."""
    return sorted(p.stem for p in FOLDER.glob("*.xodr"))


def map_file(map: str | Path) -> Path:
    """The OpenDRIVE file of a bundled map's name, or of a path."""
    name = str(map)
    if name in bundled_maps():
        return FOLDER / f"{name}.xodr"
    path = Path(map)
    if is_file(path):
        return path
    if path.suffix or len(path.parts) > 1:
        raise FileError(f"map {name}: there is no such file")
    raise ConfigError(
        f"unknown map {name!r}; choose one of: {', '.join(bundled_maps())}, or a file"
    )


def map_name(map: str) -> str:
    """The name of a bundled map, or of a file without folders and ending."""
    return map if map in bundled_maps() else Path(map).stem


def kept_name(file: Path) -> str:
    """Where a campaign's folder keeps a file: by its content, under its own name."""
    return f"{KEPT}/{sha256(file.read_bytes()).hexdigest()[:16]}/{file.name}"


def kept_map(folder: Path, name: str, content_hash: str) -> RoadMap:
    """The map of a drive: the file that the campaign's folder keeps of it, else a bundled one."""
    kept = [load_map(file) for file in sorted((folder / KEPT).glob(f"*/{escape(name)}.*"))]
    same = [map for map in kept if map.content_hash == content_hash]
    return (same or kept or [load_map(name)])[0]


def bake_file(path: Path) -> BakedMap:
    """The baked map of an OpenDRIVE file; the name is the file's."""
    from skidpad.roads.opendrive.bake import bake  # lxml and scipy are needed for baking only
    from skidpad.roads.opendrive.document import SIZE_MAX

    return bake(read_bytes(path, "map", SIZE_MAX), path.stem, str(path))


def load_map(map: str | Path) -> RoadMap:
    """A bundled map by name, or any OpenDRIVE or baked file. The same file gives the same object."""
    path = map_file(map)
    return _load(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _load(path: Path, changed: int) -> RoadMap:  # noqa: ARG001  part of the key
    if path.suffix == ".npz":
        return RoadMap(load_baked(path))
    stored = path.with_suffix(".npz")
    if path.parent == FOLDER and stored.is_file():
        return RoadMap(load_baked(stored))
    return RoadMap(bake_file(path))
