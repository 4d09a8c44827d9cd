"""Drives as data to learn from: images of three cameras, what is ahead by the truth, and controls.

OUT/<run>/images/<camera>/<tick>.png, OUT/<run>/frames.parquet and config.yaml; OUT/dataset.json says
what the columns and cameras are. Somebody else's network can be trained on it, and driven with
`--stack`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import msgspec
import polars as pl

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.runs.folder import write_config
from skidpad.campaign.runs.run import Run, run
from skidpad.campaign.sight_labels import label_of
from skidpad.core.errors import ConfigError, OutputError, StackError
from skidpad.core.geometry import Pose
from skidpad.core.run import AdasDriver, CameraDriver, RunSpec
from skidpad.core.specs import SensorSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.files import require_free, write_bytes, write_parquet
from skidpad.roads.queries import RoadMap
from skidpad.stack.adas import AdasStack
from skidpad.stack.camera.codes import AHEAD
from skidpad.stack.camera.eyes import CAMERAS, images_of

CARD, FRAMES = "dataset.json", "frames.parquet"
COLUMNS = {
    "tick": "of 0.05 s",
    "speed": "m/s",
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
    """Writes what a driver saw, should have seen, and did."""

    def __init__(self, folder: Path, map: RoadMap, every: int) -> None:
        self.folder, self.map, self.every = folder, map, every
        self.rows: list[dict[str, Any]] = []

    def see(self, moment: Moment) -> None:
        """One frame of `every`, unless nothing can be said of the lane."""
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
        for camera, image in zip(CAMERAS, images, strict=True):
            good, coded = cv2.imencode(".png", image[:, :, ::-1])
            if not good:
                raise OutputError(f"an image of {camera.id} cannot be written as PNG")
            name = f"{camera_name(camera.id)}/{tick:06d}.png"
            write_bytes(self.folder / "images" / name, coded.tobytes())

    def close(self) -> int:
        """Write the table; returns its rows."""
        table = pl.DataFrame(self.rows, schema={"tick": pl.Int64, **REALS})
        write_parquet(self.folder / FRAMES, table)
        return len(table)


def camera_name(id: str) -> str:
    """Returns the last part of a camera's id: `centre` of `camera/centre`."""
    return id.rpartition("/")[2]


def export_drive(spec: RunSpec, out: Path, every: int) -> tuple[Run, int]:
    """Drive a run and write its frames; the run, and how many frames there are."""
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
    """What the data are; returns the file."""
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
    return {
        "width_px": camera.width, "height_px": camera.height, "fov_deg": camera.fov_deg,
        "x_m": mount.x, "y_m": mount.y, "z_m": mount.z,
        "pitch_rad": mount.pitch, "yaw_rad": mount.yaw,
    }  # fmt: skip
