"""A live scene for Foxglove: the world as every channel reports it, the driving channel, and alarms."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Decision
from skidpad.core.errors import ConfigError, MissingExtra
from skidpad.live.alarm_tail import AlarmTail
from skidpad.live.child import ALARMS
from skidpad.recording.channels.mcap_files import Item

try:
    import foxglove
    from foxglove import messages as fg
    from foxglove.channels import SceneUpdateChannel
except ImportError as error:
    raise MissingExtra("a live scene for Foxglove", "live") from error

SCENE, ARBITER, ALARM = "/scene", "/arbiter", "/alarms"
COLOURS = ((0.12, 0.47, 0.71), (1.0, 0.5, 0.05), (0.17, 0.63, 0.17), (0.58, 0.4, 0.74))
HEIGHT = 1.5  # m
NS = 1_000_000_000
MONITORED = ".monitor"


class ScenePublisher:
    """Publishes a Foxglove scene by a WebSocket server on 127.0.0.1.

    A client that connects late sees the next cycle.
    """

    def __init__(self, channels: Sequence[str], recording: Path, port: int) -> None:
        self.channels = tuple(channels)
        self.alarms = AlarmTail(recording.with_suffix(MONITORED) / ALARMS)
        self.context = foxglove.Context()
        self.scene = SceneUpdateChannel(SCENE, context=self.context)
        self.words = {
            topic: foxglove.Channel(topic, message_encoding="json", context=self.context)
            for topic in (ARBITER, ALARM)
        }
        try:
            self.server = foxglove.start_server(port=port, context=self.context)
        except RuntimeError as error:
            raise ConfigError(
                f"--scene-port {port}: no server can stand there ({error})"
            ) from error
        self.entities: list[Any] = []

    def hear(self, channel: int | None, item: Item) -> None:
        """Draws a channel's world, or names the driving channel."""
        if isinstance(item, ChannelFrame) and channel is not None:
            self.entities.append(entity_of(self.channels[channel], channel, item))
        elif isinstance(item, Decision):
            word = {"t": item.t, "driving": item.driving, "reason": item.reason}
            scores = {n: s for n, s in zip(self.channels, item.scores, strict=False) if s == s}
            self.words[ARBITER].log(word | {"scores": scores}, log_time=round(item.t * NS))

    def cycle_over(self, k: int, t: float) -> None:
        """Sends the cycle's entities, and new alarms of the monitor beside this drive."""
        del k
        self.scene.log(fg.SceneUpdate(entities=self.entities), log_time=round(t * NS))
        self.entities = []
        for row in self.alarms.read():
            self.words[ALARM].log(row, log_time=round(t * NS))

    def close(self) -> None:
        """Stops the WebSocket server of the scene."""
        self.server.stop()


def entity_of(name: str, number: int, frame: ChannelFrame) -> Any:
    """Returns one channel's world as a Foxglove entity: bodies as boxes, plan and predictions as lines.

    number: of the channel, which chooses its colour.
    """
    r, g, b = COLOURS[number % len(COLOURS)]
    dark, light = fg.Color(r=r, g=g, b=b, a=0.9), fg.Color(r=r, g=g, b=b, a=0.4)
    cubes, lines = [], []
    if np.isfinite(frame.ego).all():
        cubes.append(_cube(frame.ego, frame.ego_polygon, dark))
        lines.append(_line(frame.plan[:, :2], 0.2, dark))
    for i in np.flatnonzero(np.isfinite(frame.objects).all(axis=1)):
        shape = frame.polygons[i, : frame.polygon_size[i]]
        cubes.append(_cube(frame.objects[i], shape, light))
        lines.append(_line(frame.predictions[i], 0.1, light))
    seconds, rest = divmod(round(frame.t * NS), NS)
    stamp = fg.Timestamp(sec=seconds, nsec=rest)
    return fg.SceneEntity(timestamp=stamp, frame_id="map", id=name, cubes=cubes, lines=lines)


def _cube(state: Floats, shape: Floats, colour: Any) -> Any:
    """Returns a Foxglove cube at `state` (x, y in m, heading in rad), as large as `shape` in m."""
    x, y, h = state[:3].tolist()
    length, width = np.ptp(shape, axis=0).tolist() if len(shape) else (0.1, 0.1)
    pose = fg.Pose(
        position=fg.Vector3(x=x, y=y, z=0.5 * HEIGHT),
        orientation=fg.Quaternion(x=0.0, y=0.0, z=sin(0.5 * h), w=cos(0.5 * h)),
    )
    return fg.CubePrimitive(pose=pose, size=fg.Vector3(x=length, y=width, z=HEIGHT), color=colour)


def _line(points: Floats, thickness: float, colour: Any) -> Any:
    """Returns a Foxglove line strip through the finite ones of `points` (n, 2) in m, at z = 0.1 m."""
    known = points[np.isfinite(points).all(axis=1)]
    return fg.LinePrimitive(
        type=fg.LinePrimitiveLineType.LineStrip,
        thickness=thickness,
        points=[fg.Point3(x=x, y=y, z=0.1) for x, y in known.tolist()],
        color=colour,
    )
