"""The log of a run as an ASAM OSI 3 trace of GroundTruth messages (extra `osi`).

Frames and units are ours: ISO 8855, SI. A trace is a row of messages, each behind its length in four
bytes, little endian (OSI 3.8, "OSI trace file formats").
"""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, sin
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from skidpad.core.errors import ConfigError, InputError, MissingExtra
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.vocabulary import ActorKind, LightState
from skidpad.recording.files import write_bytes
from skidpad.recording.formats.osi_udp import send_osi
from skidpad.recording.run.lamps import Lamp, LampChange, lamps_of
from skidpad.recording.run.log import RunLog

if TYPE_CHECKING:
    from osi3.osi_groundtruth_pb2 import GroundTruth

BRAKING = 0.05  # of a pedal, above which brake lamps shine, as in the embedded world
LAMP_FIELDS: Mapping[Lamp, tuple[str, ...]] = {  # fields of LightState by lamp
    Lamp.LOW_BEAM: ("head_light",),
    Lamp.HIGH_BEAM: ("high_beam",),
    Lamp.FOG: ("front_fog_light", "rear_fog_light"),
    Lamp.FOG_FRONT: ("front_fog_light",),
    Lamp.FOG_REAR: ("rear_fog_light",),
    Lamp.REVERSING: ("reversing_light",),
    Lamp.PLATE: ("license_plate_illumination_rear",),
    Lamp.SPECIAL: ("emergency_vehicle_illumination",),
}
INDICATORS = {Lamp.WARNING: "WARNING", Lamp.LEFT: "LEFT", Lamp.RIGHT: "RIGHT"}
Tilts = Mapping[tuple[int, str], tuple[float, float]]  # roll and pitch by ms and entity
EGO = 0  # row of the log's tables; an actor's id is its row
NANO = 1_000_000_000
VEHICLES = {  # MovingObject.VehicleClassification.Type
    ActorKind.CAR: "TYPE_CAR",
    ActorKind.VAN: "TYPE_VAN",
    ActorKind.TRUCK: "TYPE_HEAVY_TRUCK",
    ActorKind.BUS: "TYPE_BUS",
    ActorKind.MOTORCYCLE: "TYPE_MOTORCYCLE",
    ActorKind.BICYCLE: "TYPE_BICYCLE",
}
# One message per bulb: colour, what lights it, m below the highest (assumption).
BULBS = (
    ("COLOR_RED", LightState.RED, 0.0),
    ("COLOR_YELLOW", LightState.YELLOW, 0.3),
    ("COLOR_GREEN", LightState.GREEN, 0.6),
)
BULB = 0.2  # m, diameter (assumption)
FIRST_BULB = 100_000  # id; those of actors are smaller
# Upper bounds of classes, EnvironmentalConditions of OSI 3.8
RAIN = (
    (0.1, "NONE"), (0.5, "VERY_LIGHT"), (1.9, "LIGHT"), (8.1, "MODERATE"), (34.0, "HEAVY"),
    (149.0, "VERY_HEAVY"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class World:
    """What a log does not know of where it was driven; what is left out is not told."""

    projection: str = ""  # PROJ text
    map_reference: str = ""
    heads: Mapping[int, Pose] = field(default_factory=dict)  # of traffic lights, by signal id
    rain_mm_h: float | None = None
    road: GroundTruth | None = None  # lanes, boundaries and signs, for the first message
    tilt: Tilting | None = None
    lamps: tuple[LampChange, ...] = ()  # of vehicles, that a scenario file has switched
    tilts: Tilts = field(default_factory=dict)  # by trajectories of a scenario file


class Tilting(Protocol):
    """Tells how the ground tilts a body."""

    def at(self, x: float, y: float, z: float, yaw: float) -> tuple[float, float]:
        """Returns roll and pitch, rad."""
        ...


def write_osi(file: Path, log: RunLog, world: World | None = None) -> int:
    """Writes the trace and returns the number of messages, one per moment of the log.

    MissingExtra without the extra. ConfigError for a name without `.osi`, by which readers know the
    format. InputError for a log without a moment.
    """
    if file.suffix != ".osi":
        raise ConfigError(f"--osi takes a file that ends in .osi, got {file}")
    if not len(log):
        raise InputError("the log is empty: there is nothing to write as OSI")
    messages = (truth.SerializeToString() for truth in moments(log, world or World()))
    write_bytes(file, b"".join(struct.pack("<I", len(m)) + m for m in messages))
    return len(log)


def send_run(address: tuple[str, int], log: RunLog, world: World | None = None) -> int:
    """Sends a run as UDP datagrams at the pace of its times; returns the number of messages."""
    rows = zip(log.t.tolist(), moments(log, world or World()), strict=True)
    return send_osi(address, ((t, truth.SerializeToString()) for t, truth in rows))


def moments(log: RunLog, world: World) -> Iterator[GroundTruth]:
    """Yields one GroundTruth message per row of the log."""
    osi3 = library()
    still = _still(osi3, world)
    lamps = _Lamps(log)
    for k in range(len(log)):
        truth = osi3.osi_groundtruth_pb2.GroundTruth()
        truth.CopyFrom(still)
        nanos = round(float(log.t[k]) * NANO)
        truth.timestamp.seconds, truth.timestamp.nanos = divmod(nanos, NANO)
        if k == 0 and world.road is not None:
            truth.MergeFrom(world.road)
        for i in range(len(log.table)):
            if log.present[k, i]:
                moving = truth.moving_object.add()
                _write_actor(moving, log, k, i, world)
                write_lamps_of(moving, log, k, i, world.lamps)
        for signal, state in lamps.at(int(log.tick[k])).items():
            if signal in world.heads:
                _light(truth, signal, state, world.heads[signal])
        yield truth


def library() -> Any:
    """Returns the package osi3; MissingExtra without it."""
    try:
        import osi3.osi_groundtruth_pb2
    except ImportError:
        raise MissingExtra("writing OSI", "osi") from None
    return osi3


def _still(osi3: Any, world: World) -> GroundTruth:
    """Returns a message with what holds for the whole run."""
    truth: GroundTruth = osi3.osi_groundtruth_pb2.GroundTruth()
    options = osi3.osi_version_pb2.DESCRIPTOR.GetOptions()
    truth.version.CopyFrom(options.Extensions[osi3.osi_version_pb2.current_interface_version])
    truth.host_vehicle_id.value = EGO
    truth.proj_string, truth.map_reference = world.projection, world.map_reference
    if world.rain_mm_h is not None:
        k = bisect_right([bound for bound, _ in RAIN], world.rain_mm_h)
        name = RAIN[k][1] if k < len(RAIN) else "EXTREME"
        conditions = truth.environmental_conditions
        conditions.precipitation = conditions.Precipitation.Value(f"PRECIPITATION_{name}")
    return truth


def _write_actor(object: Any, log: RunLog, k: int, i: int, world: World) -> None:
    """Writes an actor: its box's centre is its place.

    Roll and pitch are those of its trajectory, else of the road under it.
    """
    a, table, base = log.actors, log.table, object.base
    yaw, height = float(a.yaw[k, i]), float(table.height[i])
    object.id.value = i
    base.dimension.length, base.dimension.width = float(table.length[i]), float(table.width[i])
    base.dimension.height = height
    base.position.x, base.position.y = float(a.x[k, i]), float(a.y[k, i])
    base.position.z = float(a.z[k, i]) + 0.5 * height
    where = float(a.x[k, i]), float(a.y[k, i]), float(a.z[k, i])
    roll, pitch = (0.0, 0.0) if world.tilt is None else world.tilt.at(*where, yaw)
    moment = round(1000.0 * float(log.t[k])), table.names[i]
    roll, pitch = world.tilts.get(moment, (roll, pitch))
    base.orientation.yaw, base.orientation.pitch, base.orientation.roll = (
        wrap_angle(yaw),
        pitch,
        roll,
    )
    base.velocity.x, base.velocity.y = float(a.vx[k, i]), float(a.vy[k, i])
    base.velocity.z = base.acceleration.z = 0.0
    ax, ay, c, s = float(a.ax[k, i]), float(a.ay[k, i]), cos(yaw), sin(yaw)
    base.acceleration.x, base.acceleration.y = ax * c - ay * s, ax * s + ay * c
    base.orientation_rate.yaw = float(a.yaw_rate[k, i])
    kind = ActorKind(int(table.kind[i]))
    if kind in VEHICLES:
        object.type = object.TYPE_VEHICLE
        types = object.vehicle_classification
        types.type = types.Type.Value(VEHICLES[kind])
        object.vehicle_attributes.SetInParent()  # a vehicle has them, though no log knows axles
    else:
        object.type = object.TYPE_PEDESTRIAN if kind is ActorKind.PEDESTRIAN else object.TYPE_OTHER
    reference = object.source_reference.add()
    reference.reference, reference.type = "skidpad", "actor"
    reference.identifier.append(table.names[i])


def _light(truth: GroundTruth, signal: int, state: LightState, head: Pose) -> None:
    """Adds a traffic light to the message, an entry for each bulb; x is the way that it looks."""
    for n, (colour, lit, below) in enumerate(BULBS):
        bulb = truth.traffic_light.add()
        bulb.id.value = FIRST_BULB + len(BULBS) * signal + n
        base, kind = bulb.base, bulb.classification
        base.dimension.length = base.dimension.width = base.dimension.height = BULB
        base.position.x, base.position.y, base.position.z = head.x, head.y, head.z - below
        base.orientation.yaw = head.yaw
        kind.color = kind.Color.Value(colour)
        kind.mode = kind.MODE_CONSTANT if state is lit else kind.MODE_OFF
        kind.icon = kind.ICON_NONE
        reference = bulb.source_reference.add()
        reference.type = "net.asam.opendrive"
        reference.identifier.append(f"signal_id:{signal}")


class _Lamps:
    """What traffic lights show, from the log's changes; asked in the order of ticks."""

    def __init__(self, log: RunLog) -> None:
        self.changes, self.done = log.lights, 0
        self.states: dict[int, LightState] = {}

    def at(self, tick: int) -> Mapping[int, LightState]:
        """Returns the states of lamps by signal id; ticks must not fall from call to call."""
        while self.done < len(self.changes) and self.changes[self.done].tick <= tick:
            change = self.changes[self.done]
            self.states[change.signal] = change.state
            self.done += 1
        return self.states


def write_lamps_of(moving: Any, log: RunLog, k: int, i: int, changes: Sequence[LampChange]) -> None:
    """Writes the lamps of actor i at row k of the log, as far as anything says how they are."""
    if moving.type != moving.TYPE_VEHICLE:
        return
    if i == EGO:
        state = moving.vehicle_classification.light_state
        braking = float(log.applied.brake[k]) > BRAKING
        state.brake_light_state = _brake(state, braking)
        state.reversing_light = _generic(state, bool(log.applied.reverse[k] > 0.0))
    if changes:
        t = float(log.t[k])
        found = lamps_of(changes, t, log.table.names[i])
        if found:
            _write_switched(moving.vehicle_classification.light_state, found, t)


def _write_switched(state: Any, found: Mapping[Lamp, LampChange], t: float) -> None:
    """Writes the lamps that a file switches at `t` s into an OSI vehicle's light state."""
    for lamp, change in found.items():
        lit = change.is_lit(t)
        for name in LAMP_FIELDS.get(lamp, ()):
            setattr(state, name, _generic(state, lit))
        if lamp is Lamp.BRAKE:
            state.brake_light_state = _brake(state, lit)
    switched = [lamp for lamp in INDICATORS if lamp in found]
    if switched:
        shine = [lamp for lamp in switched if found[lamp].is_lit(t)]
        both = {Lamp.LEFT, Lamp.RIGHT} <= set(shine)
        word = "WARNING" if both else INDICATORS[shine[0]] if shine else "OFF"
        state.indicator_state = state.IndicatorState.Value(f"INDICATOR_STATE_{word}")


def _generic(state: Any, lit: bool) -> Any:
    """Returns OSI's value of a lamp that is on or off."""
    word = "ON" if lit else "OFF"
    return state.GenericLightState.Value(f"GENERIC_LIGHT_STATE_{word}")


def _brake(state: Any, lit: bool) -> Any:
    """Returns OSI's value of brake lamps that are on or off."""
    word = "NORMAL" if lit else "OFF"
    return state.BrakeLightState.Value(f"BRAKE_LIGHT_STATE_{word}")
