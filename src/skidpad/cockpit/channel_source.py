"""A recording of channels as moments: the true world is drawn, and what the driving channel saw.

A recording without the true world shows that of its first channel. Heights of bodies, the state of
traffic lights and the commands are not recorded: bodies have the height of their class.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from skidpad.campaign.driving.loop import Moment
from skidpad.campaign.runs.stored import read_segment
from skidpad.campaign.user_files import with_kept_map
from skidpad.cockpit.hud import round_value
from skidpad.cockpit.indicators import FAR, NEAR, every, least_of, measure_ahead
from skidpad.cockpit.marks import RADAR_MOUNT
from skidpad.cockpit.source import Curves, Said, Seat, Source
from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Context, Decision, TruthFrame
from skidpad.core.courses import Route
from skidpad.core.errors import FileError, InputError
from skidpad.core.frames import RadarPoints, SensorFrame
from skidpad.core.inputs import Outside
from skidpad.core.setup import DT
from skidpad.core.states import (
    ActorStates,
    ActorTable,
    EgoEstimate,
    StackReport,
    VehicleCommand,
    WorldTruth,
)
from skidpad.core.vocabulary import (
    LABEL_OF_KIND,
    ActorKind,
    GripModel,
    RangeModel,
    SemanticClass,
    Supervision,
    class_of,
)
from skidpad.core.weather import Weather
from skidpad.evidence.bodies import Body
from skidpad.live.links import MONITORED
from skidpad.recording.channels.indicators import FILE, read_indicators
from skidpad.recording.channels.mcap_files import McapRecording
from skidpad.recording.hazards.records import INDEX_FILE, read_index
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.simulation.recovery import Action

BRAKING_AX = -1.5  # m/s^2, below which brake lamps are shown lit; our choice
HEIGHT = {  # m, by class; our choice
    SemanticClass.TRUCK: 3.4,
    SemanticClass.BUS: 3.2,
    SemanticClass.PEDESTRIAN: 1.75,
    SemanticClass.RIDER: 1.75,
    SemanticClass.BICYCLE: 1.7,
}
CAR_HEIGHT = 1.5
KINDS = {label: kind for kind, label in reversed(list(LABEL_OF_KIND.items()))}
EGO_KEY = ("ego", 0)
SPARE = (4.5, 1.8)  # m, of a body without a shape
Key = tuple[str, int]


class World(NamedTuple):
    """What is known of one moment; row 0 is the ego."""

    t: float
    keys: tuple[Key, ...]
    state: Floats  # (n, 5) x, y, heading, vx, vy
    size: Floats  # (n, 2) length, width
    classes: tuple[int, ...]
    mu: float


class ChannelSource(Source):
    """Gives the moments of a recording of channels in any order."""

    def __init__(self, path: Path) -> None:
        """FileError for a file without a moment, or whose map is not known here."""
        items = _Items(McapRecording(path))
        self.folder = path.parent
        self.worlds = items.worlds()
        if not self.worlds:
            raise FileError(f"{path} holds no moment of any world")
        self.map, weather, self.seed = _where(path, items.context)
        self._frames, self._decisions = items.frames, items.decisions
        self._channels = items.names
        self.step = max(round((self.worlds[-1].t - self.worlds[0].t) / DT / len(self.worlds)), 1)
        outside = Outside(weather=weather, grip=GripModel.PHYSICAL, range_model=RangeModel.NONE)
        self._seat = Seat(-1, outside, False, "keyboard", None, None)
        self._build()
        self._judged = read_judgements(path, [self.tick(k) for k in range(self.ticks)])
        self.marks = sorted(self._switches() + self._judged.marks)

    def _build(self) -> None:
        """Builds the table of all actors that ever appear, and their places."""
        first: dict[Key, tuple[int, int]] = {}
        for k, world in enumerate(self.worlds):
            for row, key in enumerate(world.keys):
                first.setdefault(key, (k, row))
        keys = [EGO_KEY, *sorted(key for key in first if key != EGO_KEY)]
        rows = {key: row for row, key in enumerate(keys)}
        found = [(self.worlds[k], row) for k, row in (first[key] for key in keys)]
        size = np.array([world.size[row] for world, row in found])
        labels = [world.classes[row] for world, row in found]
        self._table = ActorTable(
            names=tuple("ego" if key == EGO_KEY else f"{key[0]} {key[1]}" for key in keys),
            types=("",) * len(keys),
            kind=np.array([KINDS.get(class_of(v), ActorKind.PROP) for v in labels], dtype=np.uint8),
            length=size[:, 0],
            width=size[:, 1],
            height=np.array([HEIGHT.get(class_of(v), CAR_HEIGHT) for v in labels]),
            rgb=np.array([_paint(i) for i in range(len(keys))], dtype=np.uint8),
        )
        self._state = np.zeros((len(self.worlds), len(keys), 5))
        self._present = np.zeros((len(self.worlds), len(keys)), dtype=np.bool_)
        for k, world in enumerate(self.worlds):
            at = [rows[key] for key in world.keys]
            self._state[k, at], self._present[k, at] = world.state, True
        self._z = np.zeros(len(keys))

    @property
    def table(self) -> ActorTable:
        """Returns all actors that ever appear in the recording, the ego first."""
        return self._table

    @property
    def ticks(self) -> int:
        """Returns how many moments there are."""
        return len(self.worlds)

    def tick(self, k: int) -> int:
        """Returns the tick of moment k."""
        return round(self.worlds[k].t / DT)

    def seat(self, k: int) -> Seat:
        """Returns a seat without a person; the weather is that of the recording."""
        del k
        return self._seat

    def curves(self, part: slice | None = None) -> Curves:
        """Returns speed, gap, grip and what the monitor found along the time; tiers are None.

        part: of the moments; None: about CURVE of them, for which alone the monitor's counts are made.
        """
        part = every(self.ticks) if part is None else part
        v = np.hypot(self._state[part, 0, 3], self._state[part, 0, 4])
        none = np.zeros(self.ticks)
        sizes = zip(self._table.length.tolist(), self._table.width.tolist(), strict=True)
        bodies = []
        for i, (length, width) in enumerate(sizes):
            x, y, yaw, vx, vy = self._state[:, i].T
            bodies.append(Body(x, y, yaw, vx, vy, none, none, length, width))
        ahead = measure_ahead(bodies, self._present)
        near = least_of(ahead.ttc, NEAR, part), least_of(ahead.gap, FAR, part)
        grip = [round_value(world.mu) for world in self.worlds[part]]
        speed = np.round(v * 3.6, 1).tolist()
        return Curves(speed, [None] * len(v), *near, grip, *self._judged[::-1])

    def moment(self, k: int) -> Moment:
        """Returns moment k, 0 <= k < ticks; radar points are what the driving channel reports of others."""
        world, tick = self.worlds[k], self.tick(k)
        states = self._states(k)
        n = len(self._table)
        commands = np.zeros((n, 5))
        commands[:, 1] = states.ax < BRAKING_AX
        truth = WorldTruth(
            tick, self._table, states, np.full((n, 4), world.mu), commands, {}, (), ()
        )
        speed = float(np.hypot(states.vx[0], states.vy[0]))
        ego = EgoEstimate(
            pose=states.pose(0), speed=speed, yaw_rate=0.0, ax=float(states.ax[0]), ay=0.0,
            wheel_speeds=(float("nan"),) * 4, gear=1,
        )  # fmt: skip
        decision = self._decisions.get(tick)
        seen = self._objects_as_radar_points(tick, decision, states)
        frame = SensorFrame(tick, ego, {}, {}, seen, {}, (), (), Supervision.NONE)
        report, command = StackReport(), VehicleCommand()
        return Moment(frame, truth, Said(report, _mode(decision)), command, report, Action(command))

    def _states(self, k: int) -> ActorStates:
        """Returns the actors' states at moment `k`, heights from the map, acceleration from speeds."""
        x, y, yaw, vx, vy = self._state[k].T.copy()
        before, after = max(k - 1, 0), min(k + 1, self.ticks - 1)
        both = self._present[before] & self._present[after]
        v = np.hypot(self._state[..., 3], self._state[..., 4])
        gone = max(self.worlds[after].t - self.worlds[before].t, DT)
        ax = np.where(both, (v[after] - v[before]) / gone, 0.0)
        for i in np.flatnonzero(self._present[k]).tolist():
            for guess in (self._z[i], self._z[0], 0.0):
                point = self.map.project(x[i], y[i], guess, driving=False)
                if point is not None:
                    self._z[i] = point.z
                    break
        none = np.zeros(len(x))
        return ActorStates(
            x, y, self._z.copy(), yaw, none, none, vx, vy, none, ax, none, self._present[k].copy()
        )

    def _objects_as_radar_points(
        self, tick: int, decision: Decision | None, states: ActorStates
    ) -> RadarPoints:
        """Returns what the driving channel (else the first) reports of others as points of the radar."""
        name = decision.driving if decision and decision.driving else self._channels[0]
        frame = self._frames.get((name, tick))
        if frame is None or not len(frame.objects):
            return RadarPoints.none()
        c, s = np.cos(states.yaw[0]), np.sin(states.yaw[0])
        dx, dy = frame.objects[:, 0] - states.x[0], frame.objects[:, 1] - states.y[0]
        mount = RADAR_MOUNT
        forward, left = c * dx + s * dy - mount.x, -s * dx + c * dy - mount.y
        away = np.maximum(np.hypot(forward, left), 0.1)
        relative = frame.objects[:, 3:] - (states.vx[0], states.vy[0])
        rate = (dx * relative[:, 0] + dy * relative[:, 1]) / np.maximum(np.hypot(dx, dy), 0.1)
        points = (away, np.arctan2(left, forward), np.zeros(len(away)), rate)
        return RadarPoints(*(p.astype(np.float32) for p in points))

    def _switches(self) -> list[tuple[int, str, str]]:
        """Returns a mark (tick, kind, text) where another channel begins to drive."""
        marks, driving = [], None
        for tick, decision in sorted(self._decisions.items()):
            if decision.driving != driving and driving is not None:
                marks.append((tick, "notice", _mode(decision)))
            driving = decision.driving
        return marks


class _Items:
    """Reads all messages of a recording, by kind."""

    def __init__(self, recording: McapRecording) -> None:
        self.names = recording.channels
        self.truths: list[TruthFrame] = []
        self.frames: dict[tuple[str, int], ChannelFrame] = {}
        self.decisions: dict[int, Decision] = {}
        self.context: dict[str, str] = {}
        for message in recording.messages():
            item, tick = message.item, round(message.t / DT)
            if isinstance(item, TruthFrame):
                self.truths.append(item)
            elif isinstance(item, ChannelFrame) and message.channel is not None:
                self.frames[self.names[message.channel], tick] = item
            elif isinstance(item, Decision):
                self.decisions[tick] = item
            elif isinstance(item, Context):
                self.context.update(item.entries)

    def worlds(self) -> list[World]:
        """Returns the true worlds in order of time, or those of the first channel where none was recorded."""
        if self.truths:
            return [_of_truth(one) for one in sorted(self.truths, key=lambda one: one.t)]
        mine = sorted((tick, f) for (name, tick), f in self.frames.items() if name == self.names[0])
        return [_of_channel(frame) for _, frame in mine]


def _of_truth(one: TruthFrame) -> World:
    """Returns the true world of a frame, the ego first."""
    keys = (EGO_KEY, *(("actor", int(i)) for i in one.ids))
    return World(
        one.t,
        keys,
        np.vstack([one.ego[None], one.actors]),
        np.array([_size(one.ego_polygon), *map(_size, one.polygons)]),
        (int(SemanticClass.CAR), *map(int, one.classes)),
        float(one.ego_mu),
    )


def _of_channel(one: ChannelFrame) -> World:
    """Returns a channel's world, with rows by its own ids, or by class and place in the list."""
    keys: list[Key] = []
    for n, (id, label) in enumerate(zip(one.ids.tolist(), one.classes.tolist(), strict=True)):
        keys.append(("object", id) if id >= 0 else (f"class {label}", n))
    return World(
        one.t,
        (EGO_KEY, *keys),
        np.vstack([one.ego[None], one.objects]),
        np.array([_size(one.ego_polygon), *map(_size, one.polygons)]),
        (int(SemanticClass.CAR), *map(int, one.classes)),
        float("nan"),
    )


def _size(polygon: Floats) -> Floats:
    """Returns length and width in m of an outline in its own frame, at least 0.2; SPARE where unknown."""
    if not np.isfinite(polygon).any():
        return np.array(SPARE)
    found: Floats = np.maximum(np.nanmax(polygon, axis=0) - np.nanmin(polygon, axis=0), 0.2)
    return found


def _paint(row: int) -> tuple[int, int, int]:
    """Returns the RGB colour of a row: white for the ego, muted ones in turn for others."""
    colours = ((60, 90, 140), (150, 50, 45), (70, 75, 80), (190, 190, 185), (40, 95, 70))
    return (235, 235, 235) if row == 0 else colours[row % len(colours)]


def _mode(decision: Decision | None) -> str:
    """Returns which channel drives and why as text, "" without a decision."""
    if decision is None:
        return ""
    return f"{decision.driving or 'nobody: minimal-risk stop'} drives ({decision.reason})"


def _where(path: Path, context: dict[str, str]) -> tuple[RoadMap, Weather, int]:
    """Returns map, weather and seed: of the file beside the recording, else of its own words, seed 0.

    Raises FileError for a map that is not here.
    """
    if path.with_suffix(".json").is_file():
        spec = with_kept_map(read_segment(path), path.resolve().parents[1])
        assert isinstance(spec.course, Route)
        return load_map(spec.course.map), spec.weather, spec.seed
    name = context.get("map", "")
    try:
        return load_map(name), weather_of(context), 0
    except InputError as error:
        raise FileError(f"{path} was recorded on the map {name!r}, which is not here") from error


def weather_of(context: dict[str, str]) -> Weather:
    """Returns the weather of a recording's words: rain, as much wetness and cloud, and the sun.

    Unsaid, there is no rain and the sun stands 75 deg high.
    """
    rain = float(context.get("precipitation", 0.0))
    sun = float(context.get("sun_altitude_deg", 75.0))
    return Weather(
        name="recorded", precipitation=rain, wetness=rain, cloudiness=rain, sun_altitude_deg=sun
    )


# --- what a monitor said of a recording, along its time: hazards, and indicators beyond their bounds


class MonitoredRun(NamedTuple):
    """What the monitor found in one recording; empty where none looked at it."""

    hazards: list[tuple[int, int, str]]  # first and last tick, and what it was
    violated: list[int]  # indicators beyond their bounds, the most up to the next shown moment

    @property
    def marks(self) -> list[tuple[int, str, str]]:
        """Returns a mark (tick, kind, text) where each hazard begins."""
        return [(first, "hazard", f"hazard: {text}") for first, _, text in self.hazards]


def read_judgements(recording: Path, ticks: Sequence[int]) -> MonitoredRun:
    """Returns what the folder NAME.monitor beside a recording says; empty where there is none.

    ticks: of the recording's moments.
    """
    folder = recording.with_suffix(MONITORED)
    hazards, violated = [], np.zeros(len(ticks), dtype=np.int64)
    if (folder / INDEX_FILE).is_file():
        for row in read_index(folder):
            first, last = (round(row[name] / DT) for name in ("t_start", "t_end"))
            words = row["type"].replace("_", " ")
            hazards.append((first, last, f"{words} ({row['id']})"))
    if (folder / FILE).is_file():
        beyond = read_indicators(folder).filter(pl.col("violated")).group_by("t").len()
        at = np.searchsorted(ticks, np.round(beyond["t"].to_numpy() / DT))
        within = at < len(ticks)
        np.add.at(violated, at[within], beyond["len"].to_numpy()[within])
    starts = np.arange(len(ticks))[every(len(ticks))]
    most = np.maximum.reduceat(violated, starts).tolist() if violated.any() else []
    return MonitoredRun(sorted(hazards), most)
