"""Surfaces from OpenCRG files: water in the ruts and hollows of a measured road, or its friction.

In every cross section water stands up to the lower one of the highest points on either side, so that cross
fall and crown empty what they can. The reference line of the file says where it is in the map's plane;
PyOpenCRG, an unofficial reader, evaluates it without its modifiers. Valid: after rain that has filled all
hollows; water runs off along no rut. Heights act on water alone: wheels feel no bumps.

The grid of a file can hold friction in place of heights (ASAM OpenDRIVE 1.9.0, section 10.6: "CRG data can
also be used to model detailed friction values"; the file does not say which, so the reader is told).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.environment.surface import FRICTION, WATER_MM, SurfacePatch
from skidpad.core.errors import ConfigError, FileError, MissingExtra, require_range
from skidpad.core.text.told import on_a_line
from skidpad.physics.grip import MU_REF

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
WIDE = 0.25  # m, between points of a section of friction
STEP = 0.05  # of friction: values are rounded to multiples


def read_crg(path: Path, *, friction: bool = False) -> tuple[SurfacePatch, ...]:
    """Returns the puddles that stand in the hollows of an OpenCRG road.

    friction: the grid holds friction, not heights; then what differs from the usual dry road.

    Raises:
        FileError: the file is missing, or no OpenCRG.
        ConfigError: the road has no hollow or no other friction, too many, or a value out of range.
        MissingExtra: PyOpenCRG is not installed.
    """
    try:
        import pyopencrg
    except ImportError as error:
        raise MissingExtra(f"{path} (OpenCRG)", "crg") from error
    try:
        road = pyopencrg.read(path, apply_mods=False, check=False)
    except Exception as error:  # the package raises what its own readers raise
        raise FileError(f"{path} cannot be read as OpenCRG: {on_a_line(error)}") from None
    try:
        found = tuple((slippery_parts if friction else puddles)(road, path.stem))
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
    if not found:
        what = f"friction that differs from {MU_REF:g} by {0.5 * STEP:g} or more"
        what = what if friction else f"hollow of {LEVELS_MM[0]:g} mm or more in which water stands"
        raise ConfigError(f"{path} has no {what}")
    if len(found) > PATCHES_MAX:
        what = "parts of a friction of their own" if friction else "puddles"
        raise ConfigError(f"{path} has {len(found)} {what}, at most {PATCHES_MAX} are taken")
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


def slippery_parts(road: Any, name: str) -> Iterator[SurfacePatch]:
    """Yields the parts of a road whose grid holds friction, as shares of MU_REF, which is left out.

    Equal values of a section are one part, and equal parts of sections that follow each other too.
    ConfigError for a value outside of FRICTION times MU_REF.
    """
    v = np.arange(float(road.v_min) + 0.5 * WIDE, float(road.v_max), WIDE)
    ends = [*np.arange(float(road.u_start), float(road.u_end) - 1e-9, ALONG), float(road.u_end)]
    begun: dict[tuple[int, int, int], int] = {}
    for k in range(len(ends)):
        here = set(_parts_of_section(road, ends[k : k + 2], v)) if k + 1 < len(ends) else set()
        for part in [part for part in begun if part not in here]:
            yield _strip(road, name, v, part, ends[begun.pop(part) : k + 1])
        begun = {part: begun.get(part, k) for part in here}


def _parts_of_section(road: Any, ends: list[float], v: Floats) -> Iterator[tuple[int, int, int]]:
    """Yields first and last point of each part between two u, and its friction in steps."""
    mu = np.asarray(road.uv_to_z(np.full(len(v), 0.5 * sum(ends)), v), dtype=np.float64)
    known = np.isfinite(mu)
    for value in (mu[known].min(initial=MU_REF), mu[known].max(initial=MU_REF)):
        require_range("friction", float(value), *(MU_REF * share for share in FRICTION))
    steps = np.where(known, np.round(np.where(known, mu, 0.0) / STEP), 0.0).astype(np.int64)
    usual = round(MU_REF / STEP)
    yield from ((a, b, n) for a, b, n in _runs(np.where(steps == usual, 0, steps)))


def _strip(
    road: Any, name: str, v: Floats, part: tuple[int, int, int], u: list[float]
) -> SurfacePatch:
    """Returns the patch of one part along the places u, at least two."""
    first, last, steps = part
    low, high = v[first] - 0.5 * WIDE, v[last] + 0.5 * WIDE
    along, across = np.array([*u, *u[::-1]]), np.repeat([low, high], len(u))
    corners = zip(*(np.asarray(c).tolist() for c in road.uv_to_xy(along, across)), strict=True)
    return SurfacePatch(name=name, friction=steps * STEP / MU_REF, polygon=tuple(corners))


def _runs(level: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """Yields first, last and value of each stretch of one value that is not 0."""
    edges = np.flatnonzero(np.diff(level)) + 1
    for part in np.split(np.arange(len(level)), edges):
        if len(part) and level[part[0]] > 0:
            yield int(part[0]), int(part[-1]), int(level[part[0]])
