"""The surface of a stored run: what lay on parts of its road."""

from __future__ import annotations

from pathlib import Path

from skidpad.core.reading import convert_plain, decode_yaml, read_bytes
from skidpad.core.surface import SurfacePatch

CONFIG = "config.yaml"  # of a run's folder


def read_run_surface(folder: Path) -> tuple[SurfacePatch, ...]:
    """Return the patches of a run's folder; none where its description names none, or is missing."""
    path = folder / CONFIG
    if not path.is_file():
        return ()
    plain = decode_yaml(read_bytes(path, "run"), str(path))
    found = plain.get("surface") if isinstance(plain, dict) else None
    if found is None:
        return ()
    return convert_plain(found, tuple[SurfacePatch, ...], f"{path}: surface")  # type: ignore[no-any-return]
