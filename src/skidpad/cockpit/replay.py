"""A stored run as moments again: what was logged, with pictures drawn anew from the poses.

Replay and live drive show moments through the same screen. What a log does not hold is absent:
radar points and roll; pitch is told from acceleration and the road, brake lamps of others from
their deceleration.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import fields
from functools import cached_property
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np

from skidpad.campaign.driving.loop import Moment
from skidpad.campaign.driving.readings import ENVELOPE
from skidpad.campaign.runs.road import load_road
from skidpad.campaign.runs.stored import read_run
from skidpad.campaign.takeover.desk import beam_of
from skidpad.cockpit.hud import mean_grip, round_value
from skidpad.cockpit.indicators import FAR, NEAR, every, least_of, measure_ahead
from skidpad.cockpit.source import Curves, Said, Seat, index_at
from skidpad.core.arrays import Floats
from skidpad.core.errors import FileError
from skidpad.core.frames import RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Functions, Lamps, Outside, Pedals, Sky, Timed, Wheel
from skidpad.core.run import AdasDriver, Function, RunSpec
from skidpad.core.states import (
    ActorStates,
    ActorTable,
    ContactEvent,
    EgoEstimate,
    LaneInvasion,
    StackReport,
    VehicleCommand,
    WorldTruth,
)
from skidpad.core.vocabulary import DetectionStatus, LightSource, LightState, Supervision, Tier
from skidpad.evidence.bodies import body
from skidpad.evidence.pairs import together
from skidpad.physics.types import vehicle_types
from skidpad.recording.run.events import LightChange, Notice, Relocation, RolledOver
from skidpad.recording.run.inputs import read_inputs
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import TICKS, read_log
from skidpad.recording.run.readings import RecordedSensor, describe_row, read_readings
from skidpad.simulation.recovery import Action, Moved, Relocate
from skidpad.stack.control.text import mode_text

LEAST_WAY, MOST_WAY = 0.3, 12.0  # m in two ticks, between which a grade can be told
BRAKING_AX = -1.5  # m/s^2, below which the brake lamps of others are shown lit; our choice
SPEED_LIMIT = f"{ENVELOPE}.speed_mps"
WORDS: dict[str, type[Any]] = {
    "status": DetectionStatus,
    "tier": Tier,
    "light_state": LightState,
    "light_source": LightSource,
    "hsv": LightState,
    "detected": bool,
    "light_stop": bool,
    "radar_points": int,
}


class RecordedRun:
    """Gives the moments of a run's folder in any order."""

    def __init__(self, folder: Path) -> None:
        """FileError for a folder that holds no run, or a damaged one."""
        self.folder, self.log, self.spec = folder, *read_folder(folder)
        self.map, self.seed, self.step = load_road(folder, self.log.header), self.spec.seed, 1
        if self.map.content_hash != self.log.header.map_hash:
            raise FileError(f"{folder}: the map {self.log.header.map} is another one today")
        self.seats = seats_of(self.spec, read_inputs(folder, self.spec.inputs))
        self._seat_ticks = [s.tick for s in self.seats]
        self._lights = [e for e in self.log.events if isinstance(e, LightChange)]
        self._light_ticks = [e.tick for e in self._lights]
        bodies = vehicle_types()
        self._pitch_gradient = np.array(
            [bodies[t].pitch_gradient if t in bodies else 0.0 for t in self.log.table.types]
        )
        told = ((e.tick, told_of(e)) for e in self.log.events)
        self.marks = [(tick, *words) for tick, words in told if words is not None]

    @property
    def table(self) -> ActorTable:
        """Returns the actors of the recorded run, the ego first."""
        return self.log.table

    @property
    def ticks(self) -> int:
        """Returns how many moments there are."""
        return len(self.log)

    def tick(self, k: int) -> int:
        """Returns the tick of moment k."""
        return int(self.log.tick[k])

    def crash(self, k: int) -> Pose | None:
        """Returns the ego's pose at its contact that is nearest in time; None: there was none."""
        if not self.log.contacts:
            return None
        tick = self.tick(k)
        nearest = index_at(self, min(self.log.contacts, key=lambda c: abs(c.tick - tick)).tick)
        a = self.log.actors
        x, y, z, yaw = (float(v[nearest, 0]) for v in (a.x, a.y, a.z, a.yaw))
        return Pose(x, y, z, yaw=yaw)

    def collisions(self, k: int) -> int:
        """Returns how many contacts of the ego there were up to moment k."""
        return sum(1 for c in self.log.contacts if c.tick <= self.tick(k))

    @cached_property
    def _readings(self) -> tuple[dict[str, RecordedSensor], dict[int, dict[str, float]]]:
        """Returns the further sensors and functions by id, and what they said by tick; empty without any."""
        found = read_readings(self.folder)
        if found is None:
            return {}, {}
        rows = {row.pop("tick"): row for row in found.table.to_dicts()}
        return {sensor.id: sensor for sensor in found.sensors}, rows

    def readings(self, k: int) -> list[tuple[str, str]]:
        """Returns what further sensors and functions said in moment k: names and numbers as text."""
        sensors, rows = self._readings
        return describe_row(sensors, rows.get(self.tick(k), {}))

    def seat(self, k: int) -> Seat:
        """Returns what the person at the desk had set in moment k."""
        tick = int(self.log.tick[k])
        return self.seats[max(bisect_right(self._seat_ticks, tick) - 1, 0)]

    def moment(self, k: int) -> Moment:
        """Returns moment k, 0 <= k < ticks, of the log; images, radar and wheel speeds are not recorded."""
        log, tick = self.log, int(self.log.tick[k])
        truth = self._truth(k, tick)
        ego = EgoEstimate(
            pose=Pose(float(log.ego.x[k]), float(log.ego.y[k]), yaw=float(log.ego.yaw[k])),
            speed=float(log.ego.speed[k]),
            yaw_rate=float(log.ego.yaw_rate[k]),
            ax=float(log.ego.ax[k]),
            ay=float(log.ego.ay[k]),
            wheel_speeds=(float("nan"),) * 4,
            gear=int(log.ego.gear[k]),
        )
        frame = SensorFrame(
            tick, ego, {}, {}, RadarPoints.none(), truth.lights, truth.contacts, truth.invasions,
            Supervision(int(log.supervision[k])),
        )  # fmt: skip
        report = report_of(log, k)
        seat = self.seat(k)
        lca = seat.functions is not None and Function.LCA in seat.functions
        mode = f"MANUAL [{seat.method}]" if seat.manual else mode_text(report, lca)
        command = _command(log.requested, k)
        action = Action(command, self._relocation(tick))
        return Moment(frame, truth, Said(report, mode), command, report, action)

    def _truth(self, k: int, tick: int) -> WorldTruth:
        """Returns the true world of moment `k` from the log, with the events of its tick."""
        log = self.log
        a = log.actors
        n = len(log.table)
        row = {f: getattr(a, f)[k].astype(np.float64) for f in a._fields}
        states = ActorStates(
            **row, pitch=self._pitch(k), roll=np.zeros(n), present=log.present[k].astype(np.bool_)
        )
        commands = np.zeros((n, 5))
        commands[:, 1] = row["ax"] < BRAKING_AX
        commands[0] = [getattr(log.applied, f)[k] for f in log.applied._fields]
        here = [e for e in log.events if e.tick == tick]
        return WorldTruth(
            tick,
            log.table,
            states,
            log.mu[k].astype(np.float64),
            commands,
            {e.signal: e.state for e in self._lights[: bisect_right(self._light_ticks, tick)]},
            tuple(e for e in here if isinstance(e, ContactEvent)),
            tuple(e for e in here if isinstance(e, LaneInvasion)),
        )

    def _pitch(self, k: int) -> Floats:
        """Returns (n,) pitch in rad: the road's grade from the way before and after, and the body's by ax."""
        a = self.log.actors
        before, after = max(k - 1, 0), min(k + 1, self.ticks - 1)
        dx, dy, dz = (v[after] - v[before] for v in (a.x, a.y, a.z))
        along = dx * np.cos(a.yaw[k]) + dy * np.sin(a.yaw[k])
        known = (np.abs(along) > LEAST_WAY) & (np.abs(along) < MOST_WAY)
        grade = np.divide(dz, along, out=np.zeros(len(dz)), where=known)
        pitch: Floats = -grade - self._pitch_gradient * a.ax[k]
        return pitch

    def _relocation(self, tick: int) -> Relocate | None:
        """Returns the relocation of the ego in the tick; None where it was not moved."""
        for e in self.log.relocations:
            if e.tick == tick:
                return Relocate(e.new, 0.0, Moved(e.reason, e.shift, e.old, e.new, True))
        return None

    def curves(self, part: slice | None = None) -> Curves:
        """Returns speed, its limit, tier, time to collision, gap and grip at the moments of `part`.

        None: at about CURVE of them.
        """
        log = self.log
        part = every(len(log)) if part is None else part
        tiers = [None if isnan(v) else int(v) for v in log.report.tier[part].tolist()]
        bodies = [body(log, i) for i in range(len(log.table))]
        there = np.column_stack([together(log, 0, i) for i in range(len(bodies))])
        ahead = measure_ahead(bodies, there)
        grip = [round_value(mean_grip(mu)) for mu in log.mu[part, 0]]
        speed = np.round(log.v_ego[part] * 3.6, 1).tolist()
        near = least_of(ahead.ttc, NEAR, part), least_of(ahead.gap, FAR, part)
        return Curves(speed, tiers, *near, grip, limit=self._limits(part))

    def _limits(self, part: slice) -> list[float | None]:
        """Returns the speed envelope's limit in km/h at the moments of `part`; [] in a run without one."""
        sensors, rows = self._readings
        if ENVELOPE not in sensors:
            return []
        said = (rows.get(tick, {}).get(SPEED_LIMIT) for tick in self.log.tick[part].tolist())
        return [None if v is None else round_value(3.6 * v, 1) for v in said]


def told_of(event: Any) -> tuple[str, str] | None:
    """Returns kind and text of an event worth a mark; None for others."""
    match event:
        case ContactEvent():
            return "crash", f"contact with {event.static or 'a vehicle'}"
        case RolledOver(actor=0):
            return "crash", "rolled over"
        case Relocation():
            return "put back", event.reason.name.lower().replace("_", " ")
        case LaneInvasion() if event.marking == "solid":
            return "marking", "solid marking crossed"
        case Notice():
            return "notice", event.text
    return None


def read_folder(folder: Path) -> tuple[RunLog, RunSpec]:
    """Returns log and description of a run; FileError in one sentence for anything else."""
    if not (folder / TICKS).is_file():
        raise FileError(f"{folder} is not the folder of a run: it has no {TICKS}")
    spec = read_run(folder)
    log = read_log(folder)
    if not len(log):
        raise FileError(f"{folder} holds a run that ended before its first tick")
    return log, spec


def seats_of(spec: RunSpec, inputs: tuple[Timed, ...]) -> list[Seat]:
    """Returns how the desk stood from which tick on, in order; the first one is how the run began."""
    functions = tuple(spec.driver.functions) if isinstance(spec.driver, AdasDriver) else None
    outside = Outside(weather=spec.weather, grip=spec.grip, range_model=spec.settings.sensors.range)
    now = Seat(-1, outside, False, "keyboard", functions, None)
    seats = [now]
    for timed in inputs:
        now = _after(now, timed)
        seats.append(now)
    return seats


def _after(now: Seat, timed: Timed) -> Seat:
    """Returns the seat after an input of a person."""
    one, tick = timed.input, timed.tick
    outside, manual, method = now.outside, now.manual, now.method
    functions, lamps = now.functions, now.lamps
    match one:
        case Wheel():
            manual = one.manual
        case Pedals():
            method = one.method.value
        case Functions():
            functions = one.on
        case Lamps():
            lamps = one.switch
        case Sky():
            outside = Outside(weather=one.weather, grip=one.grip, range_model=one.range)
    if lamps is not None:
        beam = beam_of(lamps, outside.weather)
        outside = Outside(
            weather=outside.weather, grip=outside.grip, range_model=outside.range_model, beam=beam
        )
    return Seat(tick, outside, manual, method, functions, lamps)


def report_of(log: RunLog, k: int) -> StackReport:
    """Returns what the stack reported in moment k; a field without a value is None."""
    values: dict[str, Any] = {}
    for field in fields(StackReport):
        value = float(getattr(log.report, field.name)[k])
        if not isnan(value):
            kind = WORDS.get(field.name)
            values[field.name] = value if kind is None else kind(int(value))
    return StackReport(**values)


def _command(series: Any, k: int) -> VehicleCommand:
    """Returns the vehicle command at moment `k` of a series."""
    throttle, brake, steer, handbrake, reverse = (float(v[k]) for v in series)
    return VehicleCommand(throttle, brake, steer, bool(handbrake), bool(reverse))
