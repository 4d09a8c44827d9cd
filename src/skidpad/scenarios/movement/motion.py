"""What a scenario demands of one actor: a change over time or distance, and a lane to keep to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import atan2, copysign, cos, hypot, pi, sin, sqrt

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.states import VehicleCommand
from skidpad.roads.queries import LanePoint
from skidpad.scenarios.movement.following import Followed, follow_lane
from skidpad.scenarios.movement.network import Network, Place
from skidpad.simulation.scripted import ActorDriver, Demand, Motion

SLOW = 1e-6  # m/s, nothing moves
REACHED = 1e-6  # m from the end of a road, which is the end
STEEPEST_TURN = pi / 2.0 - 1e-3  # rad, of an actor against its lane while it goes sideways
CHANGED = 1e-3  # of that length in a step, beyond which it is measured
SQUEEZED = 0.1  # least length of a path beside a bend's inner side, per length of the lane


class Shape(Enum):
    """How a quantity goes from one value to another."""

    STEP = "step"
    LINEAR = "linear"
    SINUSOIDAL = "sinusoidal"
    CUBIC = "cubic"


STEEPEST = {Shape.LINEAR: 1.0, Shape.SINUSOIDAL: pi / 2.0, Shape.CUBIC: 1.5}  # of the mean rate
# largest second derivative for a span of 1 in a duration of 1; a straight line is read as a cubic
SHARPEST = {Shape.LINEAR: 6.0, Shape.SINUSOIDAL: pi * pi / 2.0, Shape.CUBIC: 6.0}

LONGEST = 1e150  # of a span, whose square is a number


def progress(shape: Shape, u: float) -> tuple[float, float, float]:
    """Returns the share covered at u in [0, 1] and its first two derivatives by u.

    Shape.STEP is not meant.
    """
    if shape is Shape.LINEAR:
        return u, 1.0, 0.0
    if shape is Shape.SINUSOIDAL:
        return 0.5 - 0.5 * cos(pi * u), 0.5 * pi * sin(pi * u), 0.5 * pi * pi * cos(pi * u)
    return u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u), 6.0 - 12.0 * u


@dataclass(frozen=True, slots=True)
class Transition:
    """Goes from `start` to `end` while something (time in s, or distance in m) goes from 0 to `span`."""

    start: float
    end: float
    span: float
    shape: Shape

    def at(self, p: float) -> tuple[float, float, float]:
        """Returns the value and its first two derivatives at `p`; the end, and zeros, from `span` on."""
        if self.over(p):
            return self.end, 0.0, 0.0
        share, rate, bend = progress(self.shape, p / self.span)
        size = self.end - self.start
        return (
            self.start + share * size,
            rate * size / self.span,
            bend * size / min(self.span, LONGEST) ** 2,
        )

    def over(self, p: float) -> bool:
        """Tells whether the end of the transition is reached."""
        return self.shape is Shape.STEP or p >= self.span - 1e-9


class Guide:
    """Keeps to a lane at a demanded speed; a change of lane is a sideways shift of the offset.

    v, a: demanded speed and its rate; offset: m left of the lane's centre as the lane runs, with
    its rate and bend in time; along: -1 where the actor looks against the lane; turn: the heading
    that it keeps against the lane; roads: to take at forks.
    """

    def __init__(self, network: Network, place: Place, v: float) -> None:
        point, pose = place.lane, place.pose
        self.network, self._base = network, point
        self.followed: Followed | None = None  # the answer of this tick, whose point is the base
        self.free = pose  # where there is no lane: straight on
        self.v, self.a = v, 0.0
        self.dv = self.da = 0.0  # of a disturbance, on top of v and a
        self.pace: float | None = None  # speed of this step's way, where it is not v
        self.aside = 0.0  # m sideways in this step, without a heading of its own
        self.leap = 0.0  # m along the way that this step puts it further, without a speed
        self.offset = 0.0 if point is None else point.offset
        self.offset_rate = self.offset_bend = 0.0
        self.adds_offset = False  # the motion aside comes on top of the way along the lane
        self.roads: tuple[int, ...] = ()
        self.at_end = False
        look = 0.0 if point is None else wrap_angle(pose.yaw - point.heading)
        self.along = 1.0 if abs(look) <= pi / 2.0 else -1.0
        self.turn = look if self.along > 0.0 else wrap_angle(look - pi)

    @property
    def base(self) -> LanePoint | None:
        """The reference point on the lane's centre, made when it is asked for; None without a lane."""
        if self.followed is not None:
            lane, s, offset, x, y, z, heading, curvature, width, *_ = self.followed
            road, lane_id = self.network.map.name_of(lane)
            self.base = LanePoint(
                lane, s, x, y, z, heading, curvature, width, road, lane_id, offset
            )
        return self._base

    @base.setter
    def base(self, point: LanePoint | None) -> None:
        """Sets the reference point; None: there is no lane."""
        self._base, self.followed = point, None

    @property
    def v_now(self) -> float:
        """Returns the demanded speed with its disturbance, m/s."""
        return self.v + self.dv

    def advance(self, motion: Motion | Pose) -> None:
        """Moves the reference point on, to abreast of the actor; at the end of the road it stays."""
        if self.base is None:
            return
        dx, dy = motion.x - self.base.x, motion.y - self.base.y
        forward = dx * cos(self.base.heading) + dy * sin(self.base.heading)
        further = self.network.ahead(self.base, forward, self.roads)
        self.at_end, self.base = further is None, further or self.base

    def place(self, pose: Pose) -> Place:
        """Returns a pose of the actor with the lane that it keeps to."""
        return Place(pose, None if self.base is None else replace(self.base, offset=self.offset))

    def shift_to(self, lane_id: int) -> float | None:
        """Makes another lane across the road the reference; returns the way left to it, m.

        None where there is no such lane, or no lane at all: the reference stays.
        """
        if self.base is None:
            return None
        target = self.network.beside(self.base, lane_id)
        if target is None:
            return None
        old = self.network.aside(self.base, self.offset)
        point, left = self.network.abreast(target, old.x, old.y)
        if cos(point.heading - self.base.heading) < 0.0:
            self.along, self.offset_rate = -self.along, -self.offset_rate
        self.base, self.offset = point, left
        return -left

    def preview(self, way: float, offset: float) -> Pose | None:
        """Returns the place `way` m further along at an offset; None at the road's end or without a lane."""
        if self.base is None:
            return None
        sense = self.along if self.v >= 0.0 else -self.along
        further = self.network.ahead(self.base, sense * way, self.roads)
        return None if further is None else self.network.aside(further, offset)

    def demand(self, motion: Motion) -> Demand:
        """Moves the reference point abreast of an actor, and returns what a driver has to do."""
        self.advance(motion)
        if self.base is None:
            return Demand(self.v_now, self.a + self.da, 0.0, 0.0, 0.0, 0.0, reverse=self.v < 0.0)
        heading = self.base.heading if self.along > 0.0 else self.base.heading + pi
        c, s = cos(heading), sin(heading)
        dx, dy = motion.x - self.base.x, motion.y - self.base.y
        left = dy * c - dx * s
        drift = motion.vy * c - motion.vx * s
        return Demand(
            v=0.0 if self.at_end else self.v_now,
            a=0.0 if self.at_end else self.a + self.da,
            curvature=self.along * self.base.curvature,
            error=left - self.along * self.offset,
            error_rate=drift - self.along * self.offset_rate,
            a_lateral=self.along * self.offset_bend,
            reverse=self.v < 0.0,
        )

    def command(self, motion: Motion, driver: ActorDriver) -> VehicleCommand:
        """Moves the reference point abreast of an actor, and returns what its driver does.

        By one kernel, without the reference point as an object, where it goes forwards without a route.
        """
        network, before, base = self.network, self.followed, self._base
        if base is None or self.v < 0.0 or self.roads or network.even_forks:
            return driver.command(motion, self.demand(motion))
        if before is None:
            lane, s, x, y = base.lane, base.s, base.x, base.y
            heading, curvature = base.heading, base.curvature
        else:
            lane, s, _, x, y, _, heading, curvature, _, _, _, _ = before
        found = follow_lane(
            network.map.held, driver.hands, lane, s, x, y, heading, curvature,
            motion.x, motion.y, motion.yaw, motion.vx, motion.vy, self.v + self.dv,
            self.a + self.da, self.along, self.offset, self.offset_rate, self.offset_bend,
        )  # fmt: skip
        self.at_end = found[0] < 0
        if not self.at_end:
            self.followed = found
        return VehicleCommand(found[9], found[10], found[11])

    def ideal(self, dt: float) -> Pose:
        """Moves on by dt s exactly as demanded and returns the pose there.

        What the speed, leap and way aside of this one step were is used up.
        """
        v, self.pace = (self.v if self.pace is None else self.pace) + self.dv, None
        leap, aside, self.leap, self.aside = self.leap, self.aside, 0.0, 0.0
        way = v * dt
        if self.base is None:
            if self.at_end:
                self.v = 0.0
                return self.free
            self.free = self.free.moved(forward=way + leap)
            return self.free
        drift = 0.0 if self.adds_offset else abs(self.offset_rate) * dt
        sideways = min(drift + abs(aside), abs(way))
        forward = sqrt(way * way - sideways * sideways)
        self._move(self._along_lane(self.along * ((forward if way >= 0.0 else -forward) + leap)))
        return self._current_pose()

    def _along_lane(self, way: float) -> float:
        """Returns the m along the lane's centre that `way` m beside it lead.

        Where the bend changes on the way they are measured.
        """
        assert self.base is not None
        bend, offset = self.base.curvature, self.offset
        distance = way / max(1.0 - bend * offset, SQUEEZED)
        further = self.network.ahead(self.base, distance, self.roads) if offset else None
        if further is None or abs((further.curvature - bend) * offset) < CHANGED:
            return distance
        here, there = (self.network.aside(p, offset) for p in (self.base, further))
        moved = hypot(there.x - here.x, there.y - here.y)
        return distance * abs(way) / moved if moved > 0.0 else distance

    def _move(self, distance: float) -> None:
        """Moves the base point by a distance in m along the roads; at the end of the road it stops."""
        assert self.base is not None
        if self.at_end and distance == 0.0:
            return
        further = self.network.ahead(self.base, distance, self.roads)
        if further is not None:
            self.at_end, self.base = self._is_last(further, distance), further
            return
        if self.at_end:
            self.v = 0.0  # it stands at the end of the road, and has no speed to go on with
        self.at_end = True
        rest = self._rest(distance)
        if rest is not None:
            self.base = rest

    def _is_last(self, point: LanePoint, distance: float) -> bool:
        """Returns whether a place that is reached by this distance is the end of the road."""
        length = float(self.network.map.lanes.length[point.lane])
        left = length - point.s if distance > 0.0 else point.s
        return (
            left < REACHED
            and self.network.ahead(point, copysign(2.0 * REACHED, distance), self.roads) is None
        )

    def _rest(self, distance: float) -> LanePoint | None:
        """Returns the last place before the road's end within `distance` m; None where there is none."""
        assert self.base is not None
        low, high = 0.0, abs(distance)
        sign = 1.0 if distance > 0.0 else -1.0
        found = None
        for _ in range(20):
            middle = 0.5 * (low + high)
            further = self.network.ahead(self.base, sign * middle, self.roads)
            if further is None:
                high = middle
            else:
                low, found = middle, further
        return found

    def _current_pose(self) -> Pose:
        """Returns the pose in the world at the lateral offset, with the yaw turned for a change of offset."""
        assert self.base is not None
        pose = self.network.aside(self.base, self.offset)
        turn = self.turn
        if self.offset_rate and abs(self.v) > SLOW:
            drift = 0.0 if self.adds_offset else self.offset_rate
            forward = sqrt(max(self.v**2 - drift**2, 0.0))
            across = self.offset_rate * self.network.lean(self.base)
            lean = min(max(atan2(across, forward), -STEEPEST_TURN), STEEPEST_TURN)
            turn = self.along * (lean if self.v > 0.0 else -lean)
        yaw = pose.yaw + turn if self.along > 0.0 else pose.yaw + pi + turn
        return Pose(pose.x, pose.y, pose.z, yaw=wrap_angle(yaw))
