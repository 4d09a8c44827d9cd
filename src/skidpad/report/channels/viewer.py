"""Recordings of channels in Rerun: worlds from above and indicators on one time line (extra `view`)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.errors import MissingExtra
from skidpad.evidence.channels.monitor import Monitor

APPLICATION = "skidpad channels"
COLOURS = ((255, 91, 82), (79, 206, 127), (242, 180, 65), (181, 140, 255))  # C-211: red, green
EGO = (77, 157, 255)


def require_rerun() -> Any:
    """Returns the module `rerun`; MissingExtra without it."""
    try:
        import rerun
    except ImportError as error:
        raise MissingExtra("skidpad view", "view") from error
    return rerun


def log_drive(
    channels: tuple[str, ...], cycles: Iterable[Cycle], save: Path | None, spawn: bool
) -> int:
    """Sends every cycle, monitored, to a viewer or the file `save` (.rrd); returns the number of cycles.

    spawn: start a viewer; without it and `save` nothing is shown.
    """
    rr = require_rerun()
    recording = rr.RecordingStream(APPLICATION)
    if save is not None:
        recording.save(save)
    elif spawn:
        recording.spawn()
    monitor = Monitor(channels)
    n = 0
    for cycle in cycles:
        recording.set_time("drive", duration=cycle.t)
        evidence = monitor.update(cycle)
        for c, (name, frame) in enumerate(zip(channels, cycle.frames, strict=True)):
            _world(rr, recording, name, frame, COLOURS[c % len(COLOURS)])
        readings = evidence.readings
        for (indicator, subject), value in zip(
            readings.layout.places, readings.values.tolist(), strict=True
        ):
            if value == value:  # evaluated
                path = f"indicators/{indicator.value}/{subject.replace('+', '-')}"
                recording.log(path, rr.Scalars(value))
        for hazard in evidence.fired:
            recording.log("hazards", rr.TextLog(hazard.value, level="WARN"))
        n += 1
    recording.flush()
    return n


def _world(
    rr: Any, recording: Any, name: str, frame: ChannelFrame | None, colour: tuple[int, int, int]
) -> None:
    """Logs one channel's world, or clears it where the channel is silent. Rerun's y points down, ours up."""
    root = f"worlds/{name}"
    if frame is None or not np.isfinite(frame.ego).all():
        recording.log(root, rr.Clear(recursive=True))
        return
    outlines = [
        outline(o, p[:k])
        for o, p, k in zip(frame.objects, frame.polygons, frame.polygon_size, strict=True)
    ]
    recording.log(f"{root}/objects", _lines(rr, outlines, colour))
    recording.log(f"{root}/predictions", _lines(rr, list(frame.predictions), colour))
    recording.log(f"{root}/plan", _lines(rr, [frame.plan[:, :2]], colour))
    recording.log(f"{root}/ego", _lines(rr, [outline(frame.ego, frame.ego_polygon)], EGO))


def outline(state: Floats, polygon: Floats) -> Floats:
    """Returns the closed outline (k + 1, 2) of a shape (k, 2) placed at x, y, yaw of `state`."""
    c, s = np.cos(state[2]), np.sin(state[2])
    placed = polygon @ np.array([[c, s], [-s, c]]) + state[:2]
    return np.concatenate([placed, placed[:1]])


def _lines(rr: Any, strips: list[Floats], colour: tuple[int, int, int]) -> Any:
    """Returns strips as Rerun line strips of one RGB colour, with y negated; single points are left out."""
    drawn = [strip * (1.0, -1.0) for strip in strips if len(strip) > 1]
    return rr.LineStrips2D(drawn, colors=[colour] * len(drawn))
