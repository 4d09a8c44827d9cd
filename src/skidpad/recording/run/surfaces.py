"""The surface of a stored run: what lay on parts of its road."""

from __future__ import annotations

from pathlib import Path

from skidpad.core.environment.surface import SurfacePatch, present_patches
from skidpad.core.files.reading import convert_plain, decode_yaml, read_bytes
from skidpad.core.weather import Weather

CONFIG = "config.yaml"  # of a run's folder


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
