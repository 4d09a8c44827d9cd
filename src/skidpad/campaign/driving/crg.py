"""Surfaces from OpenCRG files: water that stands in the ruts and hollows of a measured road.

In every cross section water stands up to the lower one of the highest points on either side, so that cross
fall and crown empty what they can. The reference line of the file says where it is in the map's plane;
PyOpenCRG, an unofficial reader, evaluates it without its modifiers. Valid: after rain that has filled all
hollows; water runs off along no rut. Heights act on water alone: wheels feel no bumps.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, FileError, MissingExtra
from skidpad.core.surface import WATER_MM, SurfacePatch
from skidpad.core.told import on_a_line

ALONG, ACROSS = 2.0, 0.05  # m, between sections and between points of one
LEVELS_MM = (
    0.5,
    1.0,
    2.0,
    4.0,
    7.0,
    10.0,
)  # depth of a patch: the largest of these that is reached
PATCHES_MAX = 2000


def read_crg(path: Path) -> tuple[SurfacePatch, ...]:
    """Returns the puddles that stand in the hollows of an OpenCRG road.

    Raises:
        FileError: the file is missing, or no OpenCRG.
        ConfigError: the road has no hollow, or too many.
        MissingExtra: PyOpenCRG is not installed.
    """
    try:
        import pyopencrg
    except ImportError as error:
        raise MissingExtra("--surface FILE.crg", "crg") from error
    try:
        road = pyopencrg.read(path, apply_mods=False, check=False)
    except Exception as error:  # the package raises what its own readers raise
        raise FileError(f"{path} cannot be read as OpenCRG: {on_a_line(error)}") from None
    found = tuple(puddles(road, path.stem))
    if not found:
        raise ConfigError(
            f"{path} has no hollow of {LEVELS_MM[0]:g} mm or more in which water stands"
        )
    if len(found) > PATCHES_MAX:
        raise ConfigError(f"{path} has {len(found)} puddles, at most {PATCHES_MAX} are taken")
    return found


def hollow_depths(z: Floats) -> Floats:
    """Returns how deep water stands at each point of a cross section, m; 0 where nothing is known."""
    known = np.isfinite(z)
    bare = np.where(known, z, -np.inf)
    left = np.maximum.accumulate(bare)
    right = np.maximum.accumulate(bare[::-1])[::-1]
    depth: Floats = np.zeros(len(z))
    depth[known] = np.minimum(left, right)[known] - z[known]
    return depth


def puddles(road: Any, name: str) -> Iterator[SurfacePatch]:
    """Yields the puddles of a road as PyOpenCRG reads it, cell by cell, equal depths of a row as one."""
    v = np.arange(float(road.v_min), float(road.v_max) + 1e-9, ACROSS)
    for u in np.arange(float(road.u_start), float(road.u_end) - 1e-9, ALONG):
        end = min(u + ALONG, float(road.u_end))
        z = np.asarray(road.uv_to_z(np.full(len(v), 0.5 * (u + end)), v), dtype=np.float64)
        level = np.digitize(1000.0 * hollow_depths(z), LEVELS_MM)
        for first, last, k in _runs(level):
            low, high = v[first] - 0.5 * ACROSS, v[last] + 0.5 * ACROSS
            x, y = road.uv_to_xy(np.array([u, end, end, u]), np.array([low, low, high, high]))
            corners = tuple((float(a), float(b)) for a, b in zip(x, y, strict=True))
            depth = min(LEVELS_MM[k - 1], WATER_MM[1])
            yield SurfacePatch(name=name, water_mm=depth, polygon=corners)


def _runs(level: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """Yields first, last and value of each stretch of one value that is not 0."""
    edges = np.flatnonzero(np.diff(level)) + 1
    for part in np.split(np.arange(len(level)), edges):
        if len(part) and level[part[0]] > 0:
            yield int(part[0]), int(part[-1]), int(level[part[0]])
