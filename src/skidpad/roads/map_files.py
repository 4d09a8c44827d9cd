"""Names and files of maps, without reading one: a name that does not exist is said at once."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.reading import is_file

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


def require_map(map: str) -> None:
    """Raise ConfigError for a name that no bundled map has; what names a file may be moved yet."""
    path = Path(map)
    if not path.suffix and len(path.parts) < 2:
        map_file(map)
