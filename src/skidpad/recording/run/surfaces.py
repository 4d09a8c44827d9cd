"""The surface of a stored run: what lay on parts of its road, at the begin and by events."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from skidpad.core.environment.surface import SurfacePatch, present_patches
from skidpad.core.files.reading import convert_plain, decode_yaml, read_bytes
from skidpad.core.weather import Weather
from skidpad.recording.files import read_json, write_bytes

CONFIG = "config.yaml"  # of a run's folder
LAID = "surfaces.json"  # in it, where events have laid any


class LaidSurface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What lies on the road from a tick on.

    Attributes:
        tick: the first one.
        surface: all patches, those of the begin that stay among them.
    """

    tick: int
    surface: tuple[SurfacePatch, ...]


def read_run_surface(folder: Path) -> tuple[SurfacePatch, ...]:
    """Returns the patches that lay on the road in the weather with which a stored run began.

    () where the run's description names none, or is missing.
    """
    path = folder / CONFIG
    if not path.is_file():
        return ()
    plain = decode_yaml(read_bytes(path, "run"), str(path))
    found = plain.get("surface") if isinstance(plain, dict) else None
    if found is None:
        return ()
    surface = convert_plain(found, tuple[SurfacePatch, ...], f"{path}: surface")
    weather = convert_plain(plain.get("weather", {}), Weather, f"{path}: weather")
    return present_patches(surface, weather.air_temperature_c)


def write_laid_surfaces(folder: Path, laid: Sequence[LaidSurface]) -> None:
    """Writes what events have laid on the road of a run; no file where they laid nothing."""
    if laid:
        write_bytes(folder / LAID, msgspec.json.encode(laid))


def read_laid_surfaces(folder: Path) -> tuple[LaidSurface, ...]:
    """Returns what events have laid on the road of a stored run; () for nothing, FileError for nonsense."""
    return read_json(folder / LAID, tuple[LaidSurface, ...]) or ()


def read_surfaces(folder: Path) -> tuple[LaidSurface, ...]:
    """Returns all that lay on the road of a stored run, that of its begin first."""
    return (LaidSurface(0, read_run_surface(folder)), *read_laid_surfaces(folder))
