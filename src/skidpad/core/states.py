"""States of vehicles, commands to them, what a stack says about itself, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.objects.slots import fill_slots
from skidpad.core.vocabulary import DetectionStatus, LightSource, LightState, Tier


@fill_slots
@dataclass(frozen=True, slots=True)
class VehicleCommand:
    """What a driver does: pedals in [0, 1], steer in [-1, 1] with left positive (ISO 8855).

    Attributes:
        throttle: Pedal, 0 to 1.
        brake: Pedal, 0 to 1.
        steer: -1 to 1, left positive.
        handbrake: Pulled: locks the rear wheels.
        reverse: The gear is reverse.

    Example:
        >>> VehicleCommand(throttle=0.3, steer=0.05)
    """

    throttle: float = 0.0
    brake: float = 0.0
    steer: float = 0.0
    handbrake: bool = False
    reverse: bool = False


class ActorStates(NamedTuple):
    """States of n actors as arrays of shape (n,), world frame, SI. Index 0 is the ego.

    The position is the centre of the box's footprint at road height; the velocity is that point's.
    A named tuple of arrays, so that kernels take it as it is.

    Attributes:
        x: m.
        y: m.
        z: m.
        yaw: rad.
        pitch: Body attitude relative to the horizontal.
        roll: Body attitude, rad.
        vx: m/s, world frame.
        vy: m/s, world frame.
        yaw_rate: rad/s.
        ax: Body frame, forward.
        ay: Body frame, left.
        present: False: not (or no longer) in the world.
    """

    x: Floats
    y: Floats
    z: Floats
    yaw: Floats
    pitch: Floats
    roll: Floats
    vx: Floats
    vy: Floats
    yaw_rate: Floats
    ax: Floats
    ay: Floats
    present: NDArray[np.bool_]

    @classmethod
    def empty(cls, n: int) -> ActorStates:
        """Returns n actors at the origin, at rest, not present."""
        x, y, z, yaw, pitch, roll, vx, vy, yaw_rate, ax, ay = np.zeros((11, n))
        present = np.zeros(n, dtype=np.bool_)
        return cls(x, y, z, yaw, pitch, roll, vx, vy, yaw_rate, ax, ay, present)

    def copy(self) -> ActorStates:
        """Returns independent arrays (a frame is valid until the next step, decision X-11)."""
        return ActorStates._make(a.copy() for a in self)

    def pose(self, i: int) -> Pose:
        """Returns the pose of actor i."""
        return Pose(
            float(self.x[i]),
            float(self.y[i]),
            float(self.z[i]),
            float(self.roll[i]),
            float(self.pitch[i]),
            float(self.yaw[i]),
        )


@dataclass(frozen=True, slots=True)
class ActorTable:
    """What does not change about n actors during a run; row 0 is the ego. Arrays of shape (n,).

    Attributes:
        names: By which events and pages call them.
        types: Vehicle type ids of physics, or "pedestrian", "bicycle", prop ids.
        kind: ActorKind.
        length: m, of the box.
        width: m, of the box.
        height: m, of the box.
        rgb: (n, 3) paint.
    """

    names: tuple[str, ...]
    types: tuple[str, ...]
    kind: NDArray[np.uint8]
    length: Floats
    width: Floats
    height: Floats
    rgb: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.names)


@fill_slots
@dataclass(frozen=True, slots=True)
class EgoEstimate:
    """What localisation and the ego's own sensors say."""

    pose: Pose
    speed: float  # m/s along the body, negative in reverse
    yaw_rate: float  # rad/s, left positive
    ax: float  # m/s^2
    ay: float
    wheel_speeds: tuple[float, float, float, float]  # m/s at the rim: FL, FR, RL, RR
    gear: int  # -1 reverse, 0 neutral, 1.. forward


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """A contact that began in a tick (A-029)."""

    tick: int  # number of the tick
    actor: int  # index of the actor that was touched by the sensor's owner; -1: static
    static: str  # "" for a vehicle, else "guardrail", "wall", "pole", ...
    impulse: float  # N s, of the contact
    v_closing: float  # m/s, positive when closing
    x: float  # m, world frame, place of the contact
    y: float  # m, world frame, place of the contact


@dataclass(frozen=True, slots=True)
class TrafficContact:
    """A contact of a background actor, not of the ego, that began in a tick."""

    tick: int  # number of the tick
    actor: int  # index of the actor that was touched
    other: int  # -1: something that stands
    v_closing: float  # m/s, positive when closing


@dataclass(frozen=True, slots=True)
class LaneInvasion:
    """The ego's outline crossed a lane marking (A-030)."""

    tick: int  # number of the tick
    marking: str  # "solid", "broken", "none", ...
    road: int  # OpenDRIVE id of the road


@fill_slots
@dataclass(frozen=True, slots=True)
class StackReport:
    """What a stack says about one tick, for the recording; every field may be absent.

    Distances in m from the sensor, None: no target. Nothing here feeds back into control.
    """

    status: DetectionStatus | None = None  # where the measured distance comes from
    tier: Tier | None = None  # rule of the hierarchy that acted
    detected: bool | None = None  # there is a measured distance
    distance: float | None = None  # m, measured, as the tiers use it
    time_gap: float | None = None  # s, distance over own speed
    bumper: float | None = None  # m, by the camera in the bumper
    roof: float | None = None  # m, by the camera on the roof
    fused: float | None = None  # m, of both cameras, before the median
    radar_pre: float | None = None  # m, nearest point after the pre-filter
    radar_lane: float | None = None  # m, nearest point that passed the lane check
    radar_velocity: float | None = None  # m/s, negative closing
    radar_points: int | None = None  # number of radar points after the pre-filter
    v_target: float | None = None  # m/s, cruise target
    light_distance: float | None = None  # m, to the stop line of the light
    light_state: LightState | None = None  # state of the light ahead
    light_source: LightSource | None = None  # how the light was found
    light_stop: bool | None = None  # a stop is requested
    hsv: LightState | None = (
        None  # state of the light by its colour in the image; none: not evaluated
    )
    lane_offset: float | None = None  # m, left positive
    yaw_error: float | None = None  # rad, to the lane
    curvature: float | None = None  # 1/m at the reference point
    resume_timer: float | None = None  # s, since the last tick at a stop; none: no stop yet


@fill_slots
@dataclass(frozen=True, slots=True)
class WorldTruth:
    """The simulator's truth after a step: for recording, supervision and evaluation only (A-014)."""

    tick: int
    table: ActorTable
    states: ActorStates
    mu: Floats  # (n, 4) friction at the tyres FL, FR, RL, RR; NaN where there is no tyre
    commands: Floats  # (n, 5) throttle, brake, steer, handbrake, reverse as applied
    lights: dict[int, LightState]  # by signal id of the map
    contacts: tuple[ContactEvent, ...]  # of the ego, that began in this tick
    invasions: tuple[LaneInvasion, ...]
    background: tuple[TrafficContact, ...] = ()  # of all others, that began in this tick
    put_back: tuple[int, ...] = ()  # actors of the background, stuck or astray (decision M-7)
    moved_on: tuple[int, ...] = ()  # actors of the background moved from afar to near the ego
    rolled: tuple[int, ...] = ()  # actors, the ego too, that came to lie on their side in this tick
    notices: tuple[str, ...] = ()  # what else happened in this tick: a wreck was put back, ...
