"""Surfaces from YAML and OpenCRG files: what lies on parts of the road."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from skidpad.campaign.driving.crg import read_crg
from skidpad.core.errors import ConfigError
from skidpad.core.reading import decode_yaml, read_bytes
from skidpad.core.surface import SurfacePatch
from skidpad.core.told import describe_value, on_a_line


def read_surface(path: Path) -> tuple[SurfacePatch, ...]:
    """Returns the patches of a file; of an OpenCRG one (.crg), the puddles in its hollows.

        patches:
          - {name: puddle, water_mm: 2, circle: [12.0, -3.5, 4.0]}             # x, y, radius
          - {name: split mu, ice_mm: 3, road: 0, lane: -1, s: [120, 220], side: right}

    Raises:
        ConfigError: an unknown field, a value out of its range, or an area that is said twice or not.
        FileError: the file is missing or no YAML.
    """
    if path.suffix.lower() == ".crg":
        return read_crg(path)
    plain = decode_yaml(read_bytes(path, str(path)), str(path))
    if not isinstance(plain, dict) or set(plain) != {"patches"}:
        raise ConfigError(
            f"{path} must be a mapping with `patches`, got {describe_value(plain, 100)}"
        )
    patches = plain["patches"]
    if not isinstance(patches, list) or not patches:
        raise ConfigError(f"{path}: patches must be a list of at least one patch")
    return tuple(_patch(of, f"{path}: patches[{k}]") for k, of in enumerate(patches))


def _patch(plain: Any, where: str) -> SurfacePatch:
    """Returns a patch of a surface from plain data; raises ConfigError with `where`."""
    try:
        return msgspec.convert(plain, SurfacePatch)
    except (msgspec.ValidationError, ConfigError) as error:
        raise ConfigError(f"{where}: {on_a_line(error)}") from None
