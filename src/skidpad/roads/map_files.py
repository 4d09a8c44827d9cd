"""Names and files of maps, without reading one: a name that does not exist is said at once."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.files.names import path_part
from skidpad.core.files.reading import is_file
from skidpad.core.objects.registry import Registry
from skidpad.core.text.told import describe_value

FOLDER = Path(__file__).parent / "maps"
KEPT = "maps"  # in a campaign's folder: maps/<content>/<name>.xodr


@dataclass(frozen=True, slots=True)
class MapSource:
    """What gives a map by its name: a file of Skidpad, or a package that makes or holds roads.

    Attributes:
        name: The name of the map, or what stands before the colon in "name:setting".
        title: A few words for tables and pages.
        units: What the setting is, with units; empty: the map takes none.
        factory: Returns the OpenDRIVE text of a setting; the same setting gives the same text.
    """

    name: str
    title: str
    factory: Callable[[str], str]
    units: str = ""


def _read_own(file: Path, setting: str) -> str:
    """Returns the OpenDRIVE text of a bundled file; the setting has no effect."""
    del setting  # there is none
    return file.read_text("utf-8")


def _own_maps() -> tuple[MapSource, ...]:
    """Returns the sources of the bundled maps, sorted by name."""
    return tuple(
        MapSource(file.stem, "Comes with Skidpad", partial(_read_own, file))
        for file in sorted(FOLDER.glob("*.xodr"))
    )


MAPS = Registry("map", "skidpad.maps", MapSource, _own_maps)


def bundled_maps() -> list[str]:
    """Returns the names of the maps that come with Skidpad, sorted."""
    return sorted(p.stem for p in FOLDER.glob("*.xodr"))


def map_file(map: str | Path) -> Path:
    """Returns the file of a map: a bundled one by name, a made one by "name:setting", or any by path.

    A map that a package makes is written to the cache first. FileError for a missing file, ConfigError for
    an unknown name, a wrong setting or a map that cannot be made.
    """
    name = str(map)
    if name in bundled_maps():
        return FOLDER / f"{name}.xodr"
    path = Path(map)
    if is_file(path):
        return path
    if is_made_map(name):
        return _write_made_map(name)
    if path.suffix or len(path.parts) > 1:
        raise FileError(f"map {name}: there is no such file")
    raise ConfigError(f"unknown map {name!r}; choose one of: {', '.join(MAPS.names())}, or a file")


def is_made_map(map: str) -> bool:
    """Returns whether an installed package makes the map of this name, "name" or "name:setting"."""
    source = MAPS.sources().get(map.partition(":")[0])
    return source is not None and source.package != "skidpad"


def _write_made_map(map: str) -> Path:
    """Writes the map that a package makes to the cache, under its content's hash, and returns the file.

    ConfigError for a setting too many or missing, and where the package's code fails.
    """
    from skidpad.core.kernels.jit import user_cache  # numba comes with it

    name, _, setting = map.partition(":")
    source = MAPS.get(name)
    if bool(setting) is not bool(source.units):
        takes = f"a setting, as {name}:SETTING ({source.units})" if source.units else "no setting"
        raise ConfigError(f"map {map!r}: {name} takes {takes}")
    try:
        text = source.factory(setting).encode()
    except ConfigError:
        raise
    except Exception as error:  # code of a package: anything can happen
        raise ConfigError(f"map {map!r} cannot be made: {describe_value(error)}") from error
    part = path_part("-".join(filter(None, (name, setting))))
    file = user_cache() / "made-maps" / sha256(text).hexdigest()[:16] / f"{part}.xodr"
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_suffix(f".{os.getpid()}")
        unfinished.write_bytes(text)
        unfinished.replace(file)
    return file


def map_name(map: str) -> str:
    """Returns the name of a bundled map, or of a file without folders and ending; nothing is looked up."""
    return map if map in bundled_maps() else Path(map).stem


def kept_name(file: Path) -> str:
    """Returns the path below a campaign's folder at which it keeps a file: by its content, under its name."""
    return f"{KEPT}/{sha256(file.read_bytes()).hexdigest()[:16]}/{file.name}"


def require_map(map: str) -> None:
    """Raises ConfigError for a name that no map has.

    A path passes unread, as its file may be moved yet; a map that a package makes is made.
    """
    path = Path(map)
    if is_made_map(map) or (not path.suffix and len(path.parts) < 2):
        map_file(map)
