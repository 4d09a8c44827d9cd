"""One segment: world, channels, scores, arbiter, recording (decision L-5).

    each 0.1 s:  view   = suite.observe(truth)         one per channel; nothing else is seen
                 frame  = channel.update(view)
                 scores = safety_scores(frames)        from evidence
                 choice = arbiter.update(frames, scores)
                 record frames, choice and truth; the chosen channel's command drives

`/truth` and `/context` are written for evaluation; no channel reads them.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from skidpad import __version__
from skidpad.campaign.backends import WATCHDOG, keep_server, make_backend
from skidpad.campaign.channel_outcomes import Referee
from skidpad.campaign.channel_routes import DrivenRoute
from skidpad.campaign.channel_world import Segment, segment_of
from skidpad.core.channels import ChannelFrame, Context, Decision, TruthFrame
from skidpad.core.errors import ConfigError, require_range
from skidpad.core.run import BackendChoice
from skidpad.core.setup import DT
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.core.vocabulary import ActorKind
from skidpad.evidence.channels.risk import safety_scores
from skidpad.recording.channel_drives import ARBITER, DriveOutcome
from skidpad.recording.channels import ChannelWriter
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.sensors.channel_presets import senses_of
from skidpad.sensors.channel_suite import CYCLE, ChannelSuite
from skidpad.sensors.objects import LABELS
from skidpad.simulation.backend import Backend
from skidpad.stack.channels.arbiter import Arbiter, ArbiterSettings, Choice, Reason
from skidpad.stack.channels.channel import Channel
from skidpad.stack.channels.settings import settings_of

TICKS = round(CYCLE / DT)
DEADLINE_S = 3600.0
WARM_UP = 3.0  # s before the recording begins: tracks exist then (C-12)
TRUTH_REACH = 120.0  # m around the ego within which the true world is recorded
MINIMAL_RISK_BRAKE = 0.4  # of full brake, about 4 m/s^2 (UN R157 5.1.6: at most 4 m/s^2)
LABEL_OF = np.array([LABELS[kind] for kind in ActorKind], dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentPlan:
    """What one recording is made of; two equal plans give equal recordings."""

    route: DrivenRoute
    channels: tuple[str, ...]
    seed: int
    duration: float = 600.0  # s
    drive_by: str = ARBITER  # or the name of the channel that drives alone
    noise: float = 1.0
    backend: BackendChoice = BackendChoice()

    def __post_init__(self) -> None:
        if len(set(self.channels)) != len(self.channels) or not self.channels:
            raise ConfigError(f"channels must be different names, got {list(self.channels)}")
        if self.drive_by != ARBITER and self.drive_by not in self.channels:
            raise ConfigError(
                f"drive-by must be {ARBITER} or one of {', '.join(self.channels)}, "
                f"got {self.drive_by!r}"
            )
        require_range("noise", self.noise, 0.0, 10.0)

    @property
    def name(self) -> str:
        """File name without suffix."""
        return f"{self.route.name}-{self.seed:05d}"

    @property
    def deadline_s(self) -> float:
        """Wall time after which the segment counts as hanging."""
        return DEADLINE_S

    def resolved(self) -> dict[str, Any]:
        """Everything that decides the segment, as plain data; where a server is does not."""
        plain: dict[str, Any] = msgspec.to_builtins(self)
        return plain | {"backend": self.backend.resolved()}


def drive_segment(plan: SegmentPlan, path: Path) -> DriveOutcome:
    """Drive a segment and write its recording to `path`, which appears only when complete."""
    map = load_map(plan.route.map)
    segment = segment_of(plan.route, map, plan.seed, plan.duration)
    keep_server(plan.backend)
    backend = make_backend(plan.backend, WATCHDOG)
    part = path.with_suffix(".part")
    try:
        with ChannelWriter(part, plan.channels) as writer:
            outcome = _loop(plan, map, segment, backend, writer)
    finally:
        backend.close()
    os.replace(part, path)
    return outcome


class _Crew:
    """The channels of a drive with their suites and arbiter."""

    def __init__(self, plan: SegmentPlan, map: RoadMap, segment: Segment, truth: WorldTruth):
        self.plan = plan
        self.suites = [
            ChannelSuite(
                name, senses_of(name), map.roadside, truth.table, plan.route.weather, plan.seed,
                noise=plan.noise,
            )
            for name in plan.channels
        ]  # fmt: skip
        self.channels = [
            Channel(name, settings_of(name), segment.car, map, segment.route)
            for name in plan.channels
        ]
        self.arbiter = Arbiter(plan.channels, ArbiterSettings(preferred=plan.channels[0]))

    def cycle(self, t: float, truth: WorldTruth) -> tuple[list[ChannelFrame], Decision]:
        """What every channel says at time t, and who drives."""
        frames = [
            channel.update(suite.observe(t, truth.states, truth.lights))
            for channel, suite in zip(self.channels, self.suites, strict=True)
        ]
        scores = safety_scores(frames).tolist()
        if self.plan.drive_by == ARBITER:
            progress = [c.v_planned for c in self.channels]
            choice = self.arbiter.update(t, frames, scores, progress)
        else:
            choice = Choice(self.plan.channels.index(self.plan.drive_by), Reason.KEPT)
        self.driving = choice.driving
        name = "" if choice.driving is None else self.plan.channels[choice.driving]
        return frames, Decision(t, name, choice.reason.value, tuple(scores))

    def command(self) -> VehicleCommand:
        """The driving channel's; in a minimal-risk stop brake along the first channel's path."""
        if self.driving is not None:
            return self.channels[self.driving].command
        return VehicleCommand(brake=MINIMAL_RISK_BRAKE, steer=self.channels[0].command.steer)


def _loop(
    plan: SegmentPlan,
    map: RoadMap,
    segment: Segment,
    backend: Backend,
    writer: ChannelWriter,
) -> DriveOutcome:
    backend.reset(segment.setup, plan.seed)
    truth = backend.truth()
    crew = _Crew(plan, map, segment, truth)
    referee = Referee(segment.route, segment.car, CYCLE)
    writer.write_context(Context(0.0, _about(plan, map)))
    warm = round(WARM_UP / CYCLE)
    cycles = round(plan.duration / CYCLE)
    for k in range(-warm, cycles):
        t = k * CYCLE
        frames, decision = crew.cycle(t, truth)
        words = segment.crowd.commands(t, truth)
        if k >= 0:
            referee.observe(truth, decision)
            for name, frame in zip(plan.channels, frames, strict=True):
                writer.write(name, frame)
            writer.write_decision(decision)
            writer.write_truth(truth_frame(t, truth))
        command = crew.command()
        for tick in range(TICKS):
            backend.step(command, words if tick == 0 else ())
            truth = backend.truth()
            if k >= 0:
                referee.touched(t, truth)
        if k >= 0 and referee.over:
            break
    return referee.outcome(plan.route.name, plan.seed, plan.drive_by)


def truth_frame(t: float, truth: WorldTruth) -> TruthFrame:
    """The true world around the ego, for evaluation only."""
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


def _about(plan: SegmentPlan, map: RoadMap) -> dict[str, str]:
    return {
        "route": plan.route.name,
        "title": plan.route.title,
        "map": map.name,
        "map_hash": map.content_hash,
        "seed": str(plan.seed),
        "drive_by": plan.drive_by,
        "noise": f"{plan.noise:g}",
        "version": __version__,
        "sun_altitude_deg": f"{plan.route.weather.sun_altitude_deg:g}",
        "precipitation": f"{plan.route.weather.precipitation:g}",
    }
