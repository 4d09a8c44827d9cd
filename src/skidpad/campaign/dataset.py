"""Drives as data to learn from: images of three cameras, what is ahead by the truth, and controls.

OUT/<run>/images/<camera>/<tick>.png, OUT/<run>/frames.parquet and config.yaml; OUT/dataset.json says
what the columns and cameras are. Somebody else's network can be trained on it, and driven with
`--stack`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import polars as pl

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.runs.folder import write_config
from skidpad.campaign.runs.run import Run, run
from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, OutputError, StackError
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.run import AdasDriver, CameraDriver, RunSpec
from skidpad.core.specs import SensorSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.files import require_free, write_bytes, write_parquet
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.stack.adas import AdasStack
from skidpad.stack.camera.codes import AHEAD, Label
from skidpad.stack.camera.eyes import CAMERAS, images_of

CARD, FRAMES = "dataset.json", "frames.parquet"
COLUMNS = {
    "tick": "number of the tick, of 0.05 s",
    "speed": "m/s, of the ego",
    "yaw_rate": "rad/s, left positive",
    "throttle": "0 to 1, asked for by the driver at this image",
    "brake": "0 to 1",
    "steer": "-1 to 1, left positive",
    **{f"left_{d:g}m": f"m left of the ego's axis: the lane's middle {d:g} m on" for d in AHEAD},
    "gap": "m from bumper to whoever is first in the lane within 70 m; null: nobody",
}
REALS = {name: pl.Float64 for name in COLUMNS if name != "tick"}


class WatchedStack(AdasStack):
    """Our stack with the three cameras beside its own sensors; it does not look at them."""

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the cameras whose images are written to the data set."""
        return CAMERAS


class DatasetSink(Sink):
    """Writes a driver's images and keeps rows of its commands and of where the lane is."""

    def __init__(self, folder: Path, map: RoadMap, every: int) -> None:
        self.folder, self.map, self.every = folder, map, every
        self.rows: list[dict[str, Any]] = []

    def see(self, moment: Moment) -> None:
        """Writes the images of every `every`-th tick and keeps its row; nothing where the lane is unknown."""
        frame, command = moment.frame, moment.command
        if frame.tick % self.every:
            return
        label = label_of(self.map, moment.truth.table, moment.truth.states)
        if label is None:
            return
        self._write(frame.tick, images_of(frame.extra))
        named = {f"left_{d:g}m": left for d, left in zip(AHEAD, label.offsets, strict=True)}
        self.rows.append(
            {
                "tick": frame.tick,
                "speed": frame.ego.speed,
                "yaw_rate": frame.ego.yaw_rate,
                "throttle": command.throttle,
                "brake": command.brake,
                "steer": command.steer,
                **named,
                "gap": label.gap,
            }
        )

    def _write(self, tick: int, images: Sequence[Any]) -> None:
        """Writes the tick's image of each camera as PNG."""
        for camera, image in zip(CAMERAS, images, strict=True):
            good, coded = cv2.imencode(".png", image[:, :, ::-1])
            if not good:
                raise OutputError(f"an image of {camera.id} cannot be written as PNG")
            name = f"{camera_name(camera.id)}/{tick:06d}.png"
            write_bytes(self.folder / "images" / name, coded.tobytes())

    def close(self) -> int:
        """Writes frames.parquet and returns its number of rows."""
        table = pl.DataFrame(self.rows, schema={"tick": pl.Int64, **REALS})
        write_parquet(self.folder / FRAMES, table)
        return len(table)


def camera_name(id: str) -> str:
    """Returns the last part of a camera's id: `centre` of `camera/centre`."""
    return id.rpartition("/")[2]


def export_drive(spec: RunSpec, out: Path, every: int) -> tuple[Run, int]:
    """Drives a run and writes its frames to out/NAME; returns the run and the number of frames.

    every: ticks from frame to frame. Raises ConfigError for a run without pixels or by another driver,
    StackError when the run failed.
    """
    if spec.sensors is not SensorLevel.PIXELS:
        raise ConfigError("export-dataset writes images: it needs --sensors pixels")
    if not isinstance(spec.driver, (AdasDriver, CameraDriver)):
        raise ConfigError("export-dataset drives with stack or camera")
    from skidpad.campaign.driving.run_setup import stage_of

    folder = require_free(out / spec.name)
    sink = DatasetSink(folder, stage_of(spec).map, every)
    kind = WatchedStack if isinstance(spec.driver, AdasDriver) else None
    driven = run(spec, kind, sinks=[sink])
    if driven.error:
        raise StackError(f"{spec.name}: {driven.error.strip().rpartition(chr(10))[2]}")
    write_config(folder, spec.to_plain())
    return driven, sink.close()


def write_card(out: Path, every: int) -> Path:
    """Writes dataset.json, which describes columns and cameras, and returns its path."""
    cameras = {camera_name(c.id): _describe_mount(c.mount, c) for c in CAMERAS}
    card = {
        "frames": "frames.parquet of each drive: one row per image of every camera, by tick",
        "every_ticks": every,
        "columns": COLUMNS,
        "axes": "ISO 8855: x forward, y left, z up",
        "cameras": cameras,
    }
    text = msgspec.json.format(msgspec.json.encode(card), indent=2)
    write_bytes(out / CARD, text + b"\n")
    return out / CARD


def _describe_mount(mount: Pose, camera: Any) -> dict[str, float]:
    """Returns a camera's size in px, field of view in deg and place in m and rad."""
    return {
        "width_px": camera.width, "height_px": camera.height, "fov_deg": camera.fov_deg,
        "x_m": mount.x, "y_m": mount.y, "z_m": mount.z,
        "pitch_rad": mount.pitch, "yaw_rad": mount.yaw,
    }  # fmt: skip


# --- labels of images, from the truth: where the lane runs, and which vehicle is in it


REACH = 70.0  # m of lane ahead in which a lead is looked for
STEP = 2.0  # m between the places of that lane
SPARE = 0.15  # m beside the ego's body that belongs to its way
EGO = 0


def label_of(
    map: RoadMap, table: ActorTable, states: ActorStates, place: LanePoint | None = None
) -> Label | None:
    """Returns the label of a moment; None off every lane or where it ends. place: the ego's on its lane."""
    pose = states.pose(EGO)
    place = map.project(pose.x, pose.y, pose.z) if place is None else place
    if place is None:
        return None
    offsets = []
    for distance in AHEAD:
        point = map.ahead(place, distance, pose.yaw)
        if point is None:
            return None
        offsets.append(_in_ego(states, point.x, point.y)[1])
    return Label(tuple(offsets), _gap(map, table, states, place))


def _in_ego(states: ActorStates, x: float, y: float) -> tuple[float, float]:
    """Returns how far a place in the world lies ahead and left of the ego, m."""
    dx, dy = x - states.x[EGO], y - states.y[EGO]
    c, s = cos(states.yaw[EGO]), sin(states.yaw[EGO])
    return float(c * dx + s * dy), float(c * dy - s * dx)


def _gap(map: RoadMap, table: ActorTable, states: ActorStates, place: LanePoint) -> float | None:
    """Returns m from the ego's front along the lane to the first body that reaches into it; None: none."""
    way = _way(map, place, float(states.yaw[EGO]))
    half = 0.5 * float(table.width[EGO]) + SPARE
    front = 0.5 * float(table.length[EGO])
    nearest: float | None = None
    for i in range(1, len(table)):
        if not states.present[i] or abs(states.z[i] - states.z[EGO]) > 4.0:
            continue
        s, d = _along(way, _outline(table, states, i))
        inside = (np.abs(d) < half) & (s > 0.0)
        if d.min() < 0.0 < d.max() and s.max() > 0.0:  # it lies across
            inside |= s > 0.0
        if inside.any():
            gap = max(float(s[inside].min()) - front, 0.0)
            nearest = gap if nearest is None else min(nearest, gap)
    return nearest


def _way(map: RoadMap, place: LanePoint, yaw: float) -> Floats:
    """Returns (n, 4) x, y, heading and length of the lane ahead, to REACH m or its end."""
    rows = [(place.x, place.y, place.heading, 0.0)]
    for k in range(1, int(REACH / STEP) + 1):
        point = map.ahead(place, k * STEP, yaw)
        if point is None or abs(wrap_angle(point.heading - rows[-1][2])) > 0.5:
            break
        rows.append((point.x, point.y, point.heading, k * STEP))
    return np.array(rows)


def _outline(table: ActorTable, states: ActorStates, i: int) -> Floats:
    """Returns (8, 2) corners and middles of the sides of actor i's body, world."""
    l, w = 0.5 * float(table.length[i]), 0.5 * float(table.width[i])
    c, s = cos(states.yaw[i]), sin(states.yaw[i])
    local = np.array([(a, b) for a in (-l, 0.0, l) for b in (-w, 0.0, w) if (a, b) != (0.0, 0.0)])
    placed: Floats = local @ np.array([(c, s), (-s, c)]) + np.array([states.x[i], states.y[i]])
    return placed


def _along(way: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Returns length along the way and m left of it of each (n, 2) place; length -1 beyond its end."""
    dx, dy = places[:, :1] - way[:, 0], places[:, 1:] - way[:, 1]
    k = np.argmin(dx**2 + dy**2, axis=1)
    rows = np.arange(len(places))
    c, s = np.cos(way[k, 2]), np.sin(way[k, 2])
    along = way[k, 3] + dx[rows, k] * c + dy[rows, k] * s
    left = dy[rows, k] * c - dx[rows, k] * s
    return np.where(along > way[-1, 3] + STEP, -1.0, along), left
