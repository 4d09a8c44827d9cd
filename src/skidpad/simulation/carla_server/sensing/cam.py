"""Cooperative awareness messages: when a station sends one, and the bytes of it.

Rules and contents are CARLA's (public source, CaService), after ETSI EN 302 637-2; the layout is that
of its LibITS.h as the 0.9.16 client copies it, for a machine with 64-bit longs. Yaw rate and lateral
acceleration have CARLA's signs (right positive), vertical acceleration contains gravity. Times count
from the beginning of the episode, for a server has no wall clock; lengths are in 0.1 m, as ETSI says.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose, wrap_angle

EARLY = 1e-4  # s, so that a period of whole ticks is met in spite of rounding
DISTANCE, TURN_DEG, CHANGE = 4.0, 4.0, 0.5  # m, deg and m/s after which a new one is sent
LOW_DYNAMICS = 3  # messages after which the longest period holds again (assumed)
ROAD_SIDE = 0.5  # s between messages of stations that do not drive
LIGHTS_EVERY = 0.5  # s between the parts of low frequency
CAM, CUSTOM, VERSION = 2, 0, 2  # ids of messages; version of the protocol
VEHICLE_PART, ROAD_SIDE_PART = 1, 2
STATIONS = {"bicycle": 2, "motorcycle": 4, "car": 5, "bus": 6, "van": 7, "truck": 7}
EMERGENCY, ROAD_SIDE_UNIT, PUBLIC = 10, 15, 1
EMERGENCY_ROLE, BUS = 6, 6
LAMPS = {2: 0, 4: 1, 32: 2, 16: 3, 64: 5, 128: 6, 1: 7}  # ETSI's bit by flag of VehicleLightState

LONG = "<i8"


def _record(*fields: Any) -> np.dtype[Any]:
    """Returns the structured dtype of the fields, aligned as by a C compiler."""
    made: np.dtype[Any] = np.dtype(list(fields), align=True)
    return made


def _longs(*names: str) -> np.dtype[Any]:
    """Returns the structured dtype of long integers with these names."""
    return _record(*((name, LONG) for name in names))


VALUE = _longs("value", "confidence")
HEADER = _longs("version", "message", "station")
PLACE = _longs("latitude", "longitude", "major", "minor", "orientation", "altitude", "confidence")
VEHICLE = _record(
    ("heading", VALUE),
    ("speed", VALUE),
    ("direction", LONG),
    ("length", VALUE),
    ("width", LONG),
    ("forward", VALUE),
    ("curvature", VALUE),
    ("curvature_mode", LONG),
    ("yaw_rate", VALUE),
    ("has_control", "?"),
    ("control", "u1"),
    ("has_lane", "?"),
    ("lane", LONG),
    ("has_wheel", "?"),
    ("wheel", VALUE),
    ("has_left", "?"),
    ("left", VALUE),
    ("has_up", "?"),
    ("up", VALUE),
    ("has_class", "?"),
    ("class", LONG),
    ("has_toll", "?"),
    ("toll", _record(("place", LONG, 2), ("id", LONG), ("has_id", "?"))),
)
LIST = (LONG, 3)  # pointers of a list in the client's memory: null, as lists are always empty
LOW = _record(("present", LONG), ("role", LONG), ("lamps", "u1"), ("points", LONG), ("path", *LIST))
BODY = _record(
    ("time", LONG),
    ("station", LONG),
    ("place", PLACE),
    ("present", LONG),
    ("vehicle", VEHICLE),
    ("zones", LONG),
    ("zone", *LIST),
    ("low", LOW),
)
AWARENESS = _record(("power", "<f4"), ("header", HEADER), ("body", BODY))
TEXT_BYTES = 100  # of a custom message, its closing zero included
TEXT = _record(("power", "<f4"), ("header", HEADER), ("text", f"S{TEXT_BYTES}"))

NO_ELLIPSE, NO_HEADING, NO_ALTITUDE = 4095, 3601, 15  # ETSI TS 102 894-2's words for "unavailable"
NO_ACCELERATION, NO_CURVATURE, NO_CURVATURE_CONFIDENCE = 102, 30001, 7
NO_YAW_RATE, NO_YAW_CONFIDENCE, NO_LENGTH_CONFIDENCE = 32767, 8, 4
MOST_YAW_RATE, MOST_ACCELERATION, OUT_OF_RANGE = 32766, 160, 161
MOST_SPEED = 16382  # cm/s


@dataclass(frozen=True, slots=True)
class Motion:
    """What a station tells of itself, noise included; CARLA's axes and signs."""

    latitude: float  # deg
    longitude: float
    altitude: float  # m
    heading: float = 0.0  # deg from north, clockwise
    speed: float = 0.0  # m/s along the body, negative backwards
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s^2 of an IMU: with gravity
    yaw_rate: float = 0.0  # deg/s
    size: tuple[float, float] = (0.0, 0.0)  # m, length and width
    lamps: int = 0  # flags of VehicleLightState


@dataclass(slots=True)
class Rhythm:
    """Decides when the next message is due."""

    shortest: float  # s
    longest: float
    fixed: bool
    period: float = 0.0
    low: int = 0  # messages since something happened
    last: float | None = None  # s, of the last message
    last_low: float | None = None  # s, of the last one with the part of low frequency
    pose: Pose = Pose(0.0, 0.0)  # told last
    speed: float = 0.0

    def due(self, time: float, pose: Pose, speed: float | None) -> bool:
        """Returns whether a message goes out now; if so, counts from it.

        time: s; speed: m/s, None for a station that does not drive, which sends every ROAD_SIDE s.
        """
        waited = self.longest if self.last is None else time - self.last + EARLY
        if speed is None:
            going = self.last is None or waited >= ROAD_SIDE
        elif waited < self.shortest:
            going = False
        elif self.fixed or self.last is None or self._has_changed(pose, speed):
            self.period, self.low = min(waited, self.longest), 0
            going = True
        else:
            going = waited >= self.period
            self.low += going
            self.period = self.longest if self.low >= LOW_DYNAMICS else self.period
        if going:
            self.last, self.pose, self.speed = time, pose, speed or 0.0
        return going

    def _has_changed(self, pose: Pose, speed: float) -> bool:
        """Returns whether heading, position or speed changed beyond the limits since the last message."""
        turned = abs(degrees(wrap_angle(pose.yaw - self.pose.yaw)))
        gone = np.hypot(np.hypot(pose.x - self.pose.x, pose.y - self.pose.y), pose.z - self.pose.z)
        return bool(turned > TURN_DEG or gone > DISTANCE or abs(speed - self.speed) > CHANGE)

    def tells_lamps(self, time: float) -> bool:
        """Returns whether this message has the part of low frequency; if so, counts from it."""
        told = self.last_low is None or time - self.last_low + EARLY >= LIGHTS_EVERY
        if told:
            self.last_low = time
        return told


def awareness(
    station: int, type: int, time: float, motion: Motion, lamps: bool
) -> NDArray[np.void]:
    """Returns one message of a station, `time` s after the episode began.

    type: ETSI's station type; lamps: with the part of low frequency.
    """
    message = np.zeros((), dtype=AWARENESS)
    message["header"] = (VERSION, CAM, station)
    body = message["body"]
    body["time"], body["station"] = round(1000.0 * time) % 65536, type
    body["place"] = (
        10 * round(1e6 * motion.latitude),
        10 * round(1e6 * motion.longitude),
        NO_ELLIPSE,
        NO_ELLIPSE,
        NO_HEADING,
        round(100.0 * motion.altitude),
        NO_ALTITUDE,
    )
    if type == ROAD_SIDE_UNIT:
        body["present"] = ROAD_SIDE_PART
        return message
    body["present"] = VEHICLE_PART
    _tell(body["vehicle"], motion)
    if lamps:
        low = body["low"]
        low["present"] = 1
        low["role"] = {EMERGENCY: EMERGENCY_ROLE, BUS: PUBLIC}.get(type, 0)
        low["lamps"] = sum(1 << (7 - bit) for flag, bit in LAMPS.items() if motion.lamps & flag)
    return message


def _tell(part: NDArray[np.void], motion: Motion) -> None:
    """Writes heading, speed, size, acceleration and yaw rate into a message, in its units and codes."""
    part["heading"] = (round(10.0 * (motion.heading % 360.0)), 10)
    part["speed"] = (min(round(100.0 * max(motion.speed, 0.0)), MOST_SPEED), 3)
    part["direction"] = int(motion.speed < 0.0)
    part["length"] = (round(10.0 * motion.size[0]), NO_LENGTH_CONFIDENCE)
    part["width"] = round(10.0 * motion.size[1])
    for name, value in zip(("forward", "left", "up"), motion.force, strict=True):
        tenths = round(10.0 * value)
        known = abs(tenths) <= MOST_ACCELERATION
        part[name] = (tenths if known else OUT_OF_RANGE, NO_ACCELERATION)
    part["has_left"] = part["has_up"] = True
    part["curvature"] = (NO_CURVATURE, NO_CURVATURE_CONFIDENCE)
    rate = round(100.0 * motion.yaw_rate)
    known = abs(rate) <= MOST_YAW_RATE
    part["yaw_rate"] = (rate if known else NO_YAW_RATE, NO_YAW_CONFIDENCE)


def custom(station: int, text: bytes) -> NDArray[np.void]:
    """Returns a client's own message; what is longer than TEXT_BYTES is cut."""
    message = np.zeros((), dtype=TEXT)
    message["header"] = (VERSION, CUSTOM, station)
    message["text"] = text[: TEXT_BYTES - 1]
    return message
