"""One segment: channels with their arbiter as a driver, their recording as a sink (decision L-5).

    each 0.1 s:  view   = read_sensor(frame, channel)  measured by the backend; nothing else is seen
                 frame  = channel.update(view)
                 scores = safety_scores(frames)        from evidence
                 choice = arbiter.update(frames, scores)
                 record frames, choice and truth; the chosen channel's command drives

`/truth` and `/context` are written for evaluation; no channel reads them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np

from skidpad import __version__
from skidpad.campaign.channels.outcomes import Referee
from skidpad.campaign.channels.world import TRAFFIC, Segment, crew_of, route_of, segment_of
from skidpad.campaign.driving.backends import WATCHDOG, keep_server, make_backend
from skidpad.campaign.driving.loop import Moment, Sink, Unsupervised, loop
from skidpad.campaign.driving.pace import RealTime
from skidpad.core.channels import ChannelFrame, ChannelView, Context, Decision, TruthFrame
from skidpad.core.frames import SensorFrame
from skidpad.core.run import ARBITER, RunSpec
from skidpad.core.sensor_types import read_sensor
from skidpad.core.setup import DT, ActorCommand
from skidpad.core.specs import ChannelSpec
from skidpad.core.states import ActorTable, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind, Stratum
from skidpad.evidence.channels.risk import safety_scores
from skidpad.live.links import open_listeners
from skidpad.live.listener import Listener
from skidpad.live.settings import Links
from skidpad.recording.channels.drives import DriveOutcome
from skidpad.recording.channels.mcap_files import ChannelWriter, Item
from skidpad.sensors.channels.suite import CYCLE
from skidpad.simulation.world.traffic.variety import risky_character
from skidpad.stack.channels.arbiter import Arbiter, Choice, Reason
from skidpad.stack.channels.channel import Channel
from skidpad.stack.channels.settings import load_channel_settings

PERIOD = round(CYCLE / DT)  # ticks
WARM_UP = 3.0  # s before the recording begins: tracks exist then (C-12)
WARM_UP_CYCLES = round(WARM_UP / CYCLE)
TRUTH_REACH = 120.0  # m around the ego within which the true world is recorded
# Jumps of position in the stratum of risky drivers (assumed): each counts a twentieth there, as where,
# how far and how long a channel jumps is what it was.
RISKY_JUMPS = 20.0  # times as many
MINIMAL_RISK_BRAKE = 0.4  # of full brake, about 4 m/s^2 (UN R157 5.1.6: at most 4 m/s^2)
NO_REPORT = StackReport()
Guide = Callable[[float], float]  # at a cycle's time, s: most speed, m/s; 0: it is to stop
LABEL_OF = np.array([LABEL_OF_KIND[kind] for kind in ActorKind], dtype=np.int64)


class Crew:
    """Drives by channels and their arbiter, which compute in every PERIOD-th tick."""

    report = NO_REPORT

    def __init__(self, spec: RunSpec, segment: Segment, guide: Guide | None = None) -> None:
        self.spec, self.crew, self.segment = spec, crew_of(spec), segment
        self.guide = guide
        names = self.crew.channels
        self.channels = [
            Channel(name, load_channel_settings(name), segment.car, segment.map, segment.route)
            for name in names
        ]
        self.arbiter = Arbiter(names, names[0])
        self.ticks = 0  # driven so far

    def begin(self, table: ActorTable) -> None:
        """Does nothing: channels do not know the actors."""

    def sensors(self) -> tuple[ChannelSpec, ...]:
        """Returns the sensors of all channels, which the backend measures."""
        return tuple(
            ChannelSpec(name, self.crew.noise, jumps_of(self.spec), PERIOD, -WARM_UP_CYCLES)
            for name in self.crew.channels
        )

    @property
    def cycle(self) -> int | None:
        """Returns the number of the cycle that the last tick began, negative in the warm-up; None: no one."""
        cycle, rest = divmod(self.ticks - 1, PERIOD)
        return None if rest else cycle - WARM_UP_CYCLES

    @property
    def mode(self) -> str:
        """Returns the name of the driving channel; "" in a minimal-risk stop."""
        return self.decision.driving

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the driving channel's command; in a minimal-risk stop it brakes on the first one's path.

        To be called every tick, which it counts.
        """
        self.ticks += 1
        if self.cycle is not None:
            self._think(self.cycle * CYCLE, frame)
        if self.driving is not None:
            return self.channels[self.driving].command
        return VehicleCommand(brake=MINIMAL_RISK_BRAKE, steer=self.channels[0].command.steer)

    def _think(self, t: float, frame: SensorFrame) -> None:
        """Updates every channel and chooses which one drives at t (s); sets `frames` and `decision`."""
        v_max = inf
        if self.guide is not None and (v_max := self.guide(t)):
            for channel in self.channels:
                channel.keep_below(v_max)
        self.frames: list[ChannelFrame] = [
            channel.update(read_sensor(frame, channel.name, ChannelView))
            for channel in self.channels
        ]
        scores = safety_scores(self.frames).tolist()
        names, drive_by = self.crew.channels, self.crew.drive_by
        if drive_by == ARBITER:
            progress = [c.v_planned for c in self.channels]
            unsure = [i for i, c in enumerate(self.channels) if c.abstains]
            choice = self.arbiter.update(t, self.frames, scores, progress, unsure)
        else:
            choice = Choice(names.index(drive_by), Reason.KEPT)
        if not v_max:
            choice = Choice(None, Reason.ORDERED)
        self.driving = choice.driving
        name = "" if choice.driving is None else names[choice.driving]
        self.decision = Decision(t, name, choice.reason.value, tuple(scores))


class ChannelRecorder(Sink):
    """Writes every cycle after the warm-up to the recording and to listeners; `ended` once it is over."""

    def __init__(
        self, crew: Crew, writer: ChannelWriter, listeners: Sequence[Listener] = ()
    ) -> None:
        segment = crew.segment
        self.crew, self.writer, self.listeners = crew, writer, listeners
        self.referee = Referee(segment.route, segment.car, CYCLE)
        self.left = round(crew.spec.duration / CYCLE)  # cycles to write
        self.ended = False
        self._t: float | None = None  # of the cycle under way, once cycles are written

    def begin(self, table: ActorTable) -> None:
        """Writes the context of the segment, before the first message."""
        about = _about(self.crew.spec, self.crew.segment)
        self._say(Context(0.0, about | weights_of(self.crew.spec, table)))

    def see(self, moment: Moment) -> None:
        """Notes the step's contacts; at the begin of a cycle writes what channels say and what is true."""
        crew, truth = self.crew, moment.truth
        if self._t is not None:
            self.referee.note_contacts(self._t, truth)
        if crew.cycle is None or crew.cycle < 0:
            return
        if self.referee.over or self.left == 0:
            self.ended = True
            return
        self.left -= 1
        self._t = crew.cycle * CYCLE
        self.referee.observe(truth, crew.decision)
        for channel, frame in enumerate(crew.frames):
            self._say(frame, channel)
        self._say(crew.decision)
        self._say(truth_frame(self._t, truth))
        for listener in self.listeners:
            listener.cycle_over(crew.cycle, self._t)

    def _say(self, item: Item, channel: int | None = None) -> None:
        """Writes an item to the recording and gives it to the listeners; None: of no channel."""
        self.writer.add(item, channel)
        for listener in self.listeners:
            listener.hear(channel, item)


class Street:
    """The script of a segment: people walk and ride, until the recording has ended."""

    def __init__(self, crew: Crew, recording: ChannelRecorder) -> None:
        self.crew, self.recording = crew, recording

    @property
    def ended(self) -> bool:
        """Returns True when the recording takes no more messages."""
        return self.recording.ended

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Returns the commands to walkers and cyclists at the begin of each cycle, else none."""
        if self.crew.cycle is None:
            return ()
        return self.crew.segment.crowd.commands(self.crew.cycle * CYCLE, truth)


def drive_segment(
    spec: RunSpec,
    path: Path,
    links: Links | None = None,
    guide: Guide | None = None,
    aboard: Sequence[Listener] = (),
) -> DriveOutcome:
    """Drives a segment and writes its recording to `path`, which appears only when complete.

    aboard: listeners besides those of `links`; the caller closes them. Returns the outcome; an error of
    the run is raised.
    """
    links = links or Links()
    segment = segment_of(spec)
    crew = Crew(spec, segment, guide)
    keep_server(spec.backend)
    backend = make_backend(spec.backend, WATCHDOG)
    part = path.with_suffix(".part")
    try:
        with (
            open_listeners(links, crew.crew.channels, path) as listeners,
            ChannelWriter(part, crew.crew.channels) as writer,
        ):
            recording = ChannelRecorder(crew, writer, [*listeners, *aboard])
            sinks = (recording, RealTime(DT)) if links.live else (recording,)
            specs = crew.sensors()
            asked = frozenset(channel.id for channel in specs)
            setup = replace(segment.setup, specs=specs, asked=asked)
            frame = backend.reset(setup, spec.seed)
            street = Street(crew, recording)
            failure = loop(backend, frame, crew, Unsupervised(), street, sinks)
    finally:
        backend.close()
    if failure is not None:
        raise failure
    os.replace(part, path)
    return recording.referee.outcome(route_of(spec).name, spec.seed, crew.crew.drive_by)


def truth_frame(t: float, truth: WorldTruth) -> TruthFrame:
    """Returns ego and actors within TRUTH_REACH m at `t` s as they truly are, for evaluation only."""
    s, table = truth.states, truth.table
    near = s.present & (np.hypot(s.x - s.x[0], s.y - s.y[0]) < TRUTH_REACH)
    near[0] = False
    rows = np.flatnonzero(near)
    state = np.column_stack([s.x, s.y, s.yaw, s.vx, s.vy])
    half = 0.5 * np.column_stack([table.length, table.width])
    corners = half[:, None, :] * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    return TruthFrame(
        t=t,
        ego=state[0].copy(),
        ego_polygon=corners[0],
        ego_mu=float(truth.mu[0].mean()),
        actors=state[rows],
        polygons=corners[rows],
        polygon_size=np.full(len(rows), 4, dtype=np.int64),
        ids=rows.astype(np.int64),
        classes=LABEL_OF[table.kind[rows]],
        mu=truth.mu[rows].mean(axis=1),
    )


def jumps_of(spec: RunSpec) -> float:
    """Returns the factor on how often a channel's position jumps: RISKY_JUMPS for risky drivers, else 1."""
    return RISKY_JUMPS if route_of(spec).stratum is Stratum.RISKY else 1.0


def weights_of(spec: RunSpec, table: ActorTable) -> dict[str, str]:
    """Returns as words the weights of each risky driver, by row in the true world, and of each jump.

    Empty among natural drivers.
    """
    if route_of(spec).stratum is not Stratum.RISKY:
        return {}
    drivers = [i for i, name in enumerate(table.names) if name.startswith(TRAFFIC)]
    found = {str(i): risky_character(spec.seed, i) for i in drivers}
    weights = {i: [round(c.of_headway, 6), round(c.of_gap, 6)] for i, c in found.items()}
    return {
        "weights": json.dumps(weights, separators=(",", ":")),
        "weight_of_jumps": f"{1.0 / jumps_of(spec):g}",
    }


def _about(spec: RunSpec, segment: Segment) -> dict[str, str]:
    """Returns the context of a segment as words: route, map, seed, driver, weather."""
    course, crew = route_of(spec), crew_of(spec)
    return {
        "route": course.place,
        "title": course.title,
        "map": segment.map.name,
        "map_hash": segment.map.content_hash,
        "seed": str(spec.seed),
        "drive_by": crew.drive_by,
        "noise": f"{crew.noise:g}",
        "version": __version__,
        "sun_altitude_deg": f"{spec.weather.sun_altitude_deg:g}",
        "precipitation": f"{spec.weather.precipitation:g}",
        **_variant(spec),
    }


def _variant(spec: RunSpec) -> dict[str, str]:
    """Returns variant, weather and stratum of a run whose route has a `base`; {} for one as published.

    ConfigError for a run that drives no route.
    """
    course = route_of(spec)
    if not course.base:
        return {}
    words = {"variant": course.name, "weather": spec.weather.name}
    return words | {"stratum": course.stratum.value}
