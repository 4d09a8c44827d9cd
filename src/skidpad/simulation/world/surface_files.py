"""Surfaces from YAML and OpenCRG files: what lies on parts of the road."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from skidpad.core.environment.surface import NUMBERS, SurfacePatch
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.files.reading import decode_yaml, read_bytes
from skidpad.core.text.told import describe_value, on_a_line
from skidpad.simulation.world.crg import read_crg

S = TypeVar("S", bound=msgspec.Struct)


class CrgFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An OpenCRG file that a surface names, and what its grid holds."""

    file: str  # beside the surface's own file
    purpose: Literal["elevation", "friction"] = "elevation"


def read_surface(path: Path) -> tuple[SurfacePatch, ...]:
    """Returns the patches of a file; of an OpenCRG one (.crg), the puddles in its hollows.

        patches:
          - {name: puddle, water_mm: 2, circle: [12.0, -3.5, 4.0]}             # x, y, radius
          - {name: split mu, ice_mm: 3, road: 0, lane: -1, s: [120, 220], side: right}
        crg:
          - {file: braking_lane.crg, purpose: friction}

    Raises:
        ConfigError: an unknown field, a value out of its range, or an area that is said twice or not.
        FileError: the file or one that it names is missing, or cannot be read.
        MissingExtra: an OpenCRG file is named, and its package is not installed.
    """
    if path.suffix.lower() == ".crg":
        return read_crg(path)
    plain = decode_yaml(read_bytes(path, "surface"), str(path))
    if not isinstance(plain, dict) or not plain or set(plain) - {"patches", "crg"}:
        raise ConfigError(
            f"{path} must be a mapping with `patches` or `crg`, got {describe_value(plain, 100)}"
        )
    found = [_struct(p, SurfacePatch, w) for p, w in _entries(plain, "patches", "patch", path)]
    for of, where in _entries(plain, "crg", "file", path):
        crg = _struct(of, CrgFile, where)
        found += read_crg(path.parent / crg.file, friction=crg.purpose == "friction")
    return tuple(found)


def _entries(plain: Any, key: str, what: str, path: Path) -> list[tuple[Any, str]]:
    """Returns each entry of a list in a surface's file and where it stands; [] without the key."""
    entries = plain.get(key, ())
    if key in plain and (not isinstance(entries, list) or not entries):
        raise ConfigError(f"{path}: {key} must be a list of at least one {what}")
    return [(of, f"{path}: {key}[{k}]") for k, of in enumerate(entries)]


def _struct(plain: Any, kind: type[S], where: str) -> S:
    """Returns plain data as a struct; raises ConfigError with `where`."""
    try:
        for name in plain if isinstance(plain, dict) else ():
            require_choice("field", str(name), kind.__struct_fields__)
        return msgspec.convert(plain, kind)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{where}: {_say_what_is_wrong(plain, on_a_line(error))}") from None
    except ConfigError as error:
        raise ConfigError(f"{where}: {on_a_line(error)}") from None


def _say_what_is_wrong(plain: Any, text: str) -> str:
    """Returns msgspec's sentence with the field first and its value last; the range of a number instead."""
    said, _, path = text.partition(" - at `$.")
    name = path.strip("`").split("[")[0]
    if not name:
        return said
    value = describe_value(plain[name], 100)
    if name in NUMBERS:
        low, high = NUMBERS[name]
        return f"{name} must be a number from {low:g} to {high:g}, got {value}"
    return f"{name}: {said}, got {value}"
