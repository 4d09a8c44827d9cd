"""A simulated vehicle in the fleet: its drive and its monitor, joined with alerts and orders (C-175).

The monitor runs in a process of its own and writes hazards as they begin; at each cycle the drive reads
what came, and asks how fast orders let it go. Neither waits for the network.
"""

from __future__ import annotations

import secrets
from collections import deque
from math import hypot
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.channels.drive import drive_segment
from skidpad.core.channels import ChannelFrame, Context
from skidpad.core.run import RunSpec
from skidpad.fleet.aboard import Aboard
from skidpad.fleet.alerting.keeping import AlertText, Body, Kind, Scene
from skidpad.live.alarm_tail import AlarmTail
from skidpad.live.child import ALARMS
from skidpad.live.links import MONITORED
from skidpad.live.outcome import LinkOutcome, read_outcome
from skidpad.live.settings import Links
from skidpad.recording.channels.drives import DriveOutcome
from skidpad.recording.channels.mcap_files import Item

KEPT = 100  # cycles: 10 s, more than a monitor that is heard may be late
OBJECTS_MAX = 200
STANDS = 0.1  # m/s
PATIENCE_S = 5.0  # with a request; an order that came later would have expired


class Watch:
    """Keeps what the first channel saw of a drive, and raises an alert for each alarm of the monitor."""

    def __init__(self, aboard: Aboard, alarms: Path) -> None:
        self.aboard, self.alarms = aboard, AlarmTail(alarms)
        self.drive = secrets.token_hex(8)  # names this drive in the keys of its alerts
        self.map = ""
        self._seen: deque[ChannelFrame] = deque(maxlen=KEPT)
        self._stood = False

    def hear(self, channel: int | None, item: Item) -> None:
        """Keeps the map's name and the first channel's frames, of which a scene is made."""
        if isinstance(item, Context):
            self.map = item.entries.get("map", self.map)
        elif channel == 0 and isinstance(item, ChannelFrame) and np.isfinite(item.ego).all():
            self._seen.append(item)

    def cycle_over(self, k: int, t: float) -> None:
        """Raises what the monitor has found meanwhile, and once that the vehicle stands by an order."""
        self.look()
        if self._seen and not self._stood and not self.aboard.v_max:
            self._stood = hypot(*self._seen[-1].ego[3:]) < STANDS
            if self._stood:
                self._raise(k, t, Kind.MINIMAL_RISK, "stands still as it was ordered")

    def close(self) -> None:
        """Raises the last alarms, as the monitor has ended."""
        self.look()

    def look(self) -> None:
        """Raises an alert for each alarm that was written in full since the last look."""
        for row in self.alarms.read():
            self._raise(row["cycle"], row["t"], Kind.HAZARD, row["hazard"].replace("_", " "))

    def _raise(self, k: int, t: float, kind: Kind, what: str) -> None:
        """Raises an alert about cycle `k` at `t` s; its scene is the last frame known by then.

        Without a frame it only says so.
        """
        known = [frame for frame in self._seen if frame.t <= t + 1e-3] or list(self._seen)[:1]
        if not known:
            self.aboard.say(f"{what} at {t:.1f} s: no alert, as no pose was known")
            return
        text = f"{what} at {t:.1f} s of the drive"
        key = f"{self.drive}-{k}-{what.replace(' ', '-')}"[:64]
        self.aboard.alert(key, AlertText(kind, text, scene_of(known[-1], self.map)))


def scene_of(frame: ChannelFrame, map: str) -> Scene:
    """Returns what a channel saw around the vehicle, nearest objects first, OBJECTS_MAX at most."""
    x, y = frame.ego[:2]
    reach = np.hypot(frame.objects[:, 0] - x, frame.objects[:, 1] - y)
    near = [i for i in np.argsort(reach) if np.isfinite(frame.objects[i, :3]).all()][:OBJECTS_MAX]
    shapes = [frame.polygons[i][: frame.polygon_size[i]] for i in near]
    return Scene(
        map=map,
        ego=_body(frame.ego, frame.ego_polygon),
        v=hypot(*frame.ego[3:]),
        objects=tuple(_body(frame.objects[i], s) for i, s in zip(near, shapes, strict=True)),
    )


def _body(state: NDArray[np.float64], corners: NDArray[np.float64]) -> Body:
    """Returns the rectangle of a state (x, y, heading, ...); of a usual car where it has no shape.

    corners: (n, 2) around the state's place, along its heading.
    """
    x, y, heading = (float(v) for v in state[:3])
    if not len(corners) or not np.isfinite(corners).all():
        return Body(x, y, heading)
    length, width = (float(v) for v in np.ptp(corners, axis=0))
    return Body(x, y, heading, min(length, 100.0), min(width, 10.0))


def drive_aboard(spec: RunSpec, folder: Path, aboard: Aboard) -> tuple[DriveOutcome, LinkOutcome]:
    """Drives at real time as a vehicle of the fleet, its monitor beside; returns what became of both.

    Starts and closes `aboard`.
    """
    recording = folder / "drive.mcap"
    monitored = recording.with_suffix(MONITORED)
    watch = Watch(aboard, monitored / ALARMS)
    aboard.start()
    try:
        links = Links(monitor=True, live=True)
        driven = drive_segment(spec, recording, links, lambda _: aboard.v_max, [watch])
        return driven, read_outcome(monitored)
    finally:
        watch.close()
        aboard.close()
