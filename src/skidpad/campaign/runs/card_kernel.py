"""The kernel of a launch on a graphics card, compiled for the values of its worlds."""

from __future__ import annotations

import os
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import cuda

from skidpad.campaign.driving.quick_kernel import drive_ticks
from skidpad.core.errors import OutputError
from skidpad.core.kernels.batch import Leaves, call_directly, name_stores, write_taker
from skidpad.core.kernels.card import SIMULATED, find_view, keep_apart
from skidpad.core.kernels.jit import _cache_of, hold
from skidpad.physics.contact import resolve_contacts
from skidpad.physics.vehicle import step_vehicles
from skidpad.recording.files import write_bytes
from skidpad.roads.kernels import project_kernel, sample_kernel
from skidpad.sensors.object_level.object_camera import see_boxes
from skidpad.sensors.object_level.object_radar import cast_radar, find_slope
from skidpad.simulation.recovery import find_ego
from skidpad.simulation.standing import has_reason
from skidpad.simulation.world.ground import settle
from skidpad.simulation.world.step import advance
from skidpad.simulation.world.touch import cross_markings
from skidpad.simulation.world.traffic.driver import drive_all
from skidpad.stack.perception.lights import heed_light
from skidpad.stack.road import read_road
from skidpad.stack.think import think

# columns of `ints`: BEGUN to LANE of `runs/card.py`; of `floats`: throttle, brake, steer, s, offset
LAUNCH = """
def launch(t, ints, floats, n, {names}):
    b = cuda.grid(1)
    if b < ints.shape[0] and ints[b, 2] > 0:
        joined = take(t, b, {names})
        told = drive(
            joined, None, ints[b, 0] != 0, ints[b, 1], min(ints[b, 2], n), 0, ints[b, 3],
            ints[b, 4], floats[b, 0], floats[b, 1], floats[b, 2], ints[b, 5] != 0,
        )
        ints[b, 6], ints[b, 7], ints[b, 8], ints[b, 9] = told[0], told[1], told[2], told[3]
        floats[b, 0], floats[b, 1], floats[b, 2] = told[4], told[5], told[6]
        ints[b, 5], ints[b, 10] = told[7], told[8]
        floats[b, 3], floats[b, 4], ints[b, 4] = told[9], told[10], told[11]
"""
APART = (
    project_kernel, sample_kernel, see_boxes, cast_radar, find_slope, drive_all, step_vehicles,
    resolve_contacts, settle, cross_markings, think, read_road, heed_light, find_ego, has_reason, advance,
)  # fmt: skip


class KeyLeaves:
    """Leaves of which the source decides; for a cache."""

    def __init__(self, leaves: Leaves) -> None:
        self.leaves = leaves

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KeyLeaves) and other.leaves.source == self.leaves.source

    def __hash__(self) -> int:
        return hash(self.leaves.source)


@cache
def find_kernel(key: KeyLeaves, dtypes: tuple[np.dtype[Any], ...]) -> Any:
    """Returns the kernel of a launch for such values; its machine code is kept on the disk."""
    leaves, names = key.leaves, name_stores(dtypes)
    text = write_taker(leaves, dtypes)
    space: dict[str, Any] = {**leaves.classes, "view": find_view(), "uint64": np.uint64}
    if SIMULATED:  # the CPU's own machine code
        space["Inside"] = hold
        exec(text, space)
        space["drive"] = drive_ticks
    else:
        exec(text, space)
        keep_apart(APART)
        compiled = numba.njit(error_model="numpy")
        space["take"] = compiled(space["take"])
        space["drive"] = call_directly(drive_ticks, compiled)
    space["cuda"], launch = cuda, LAUNCH.format(names=names)
    file = _keep_text(text + launch)
    exec(compile(launch, file or "<launch>", "exec"), space)
    if file and "NUMBA_CACHE_DIR" not in os.environ:
        numba.config.CACHE_DIR = str(Path(file).parent)
    return cuda.jit(space["launch"], cache=bool(file))


def _keep_text(text: str) -> str:
    """Returns the file with this text in the user's cache, beside which numba keeps machine code; "": none.

    It is in the folder of this file's kernels, named after all files that these and the launch are made of.
    """
    folder = "" if SIMULATED else _cache_of(Path(__file__).resolve())
    if not folder:
        return ""
    file = Path(folder) / sha256(text.encode()).hexdigest()[:16] / "launch.py"
    try:
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(file, text.encode())
    except (OSError, OutputError):
        return ""
    return str(file)
