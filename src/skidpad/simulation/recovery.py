"""The recovery supervisor: gets the ego going again after a crash, on every backend (A-179 to A-201).

It stands between stack and backend. Each tick `observe` reads the truth and says in which phase the
tick is; `act` turns the stack's command into what is applied, and may relocate the ego. It knows
nothing of how the backend works, and the stack knows nothing of the truth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, sin

from skidpad.core.errors import require_range
from skidpad.core.geometry import Pose, mps_from_kmh
from skidpad.core.kernels.jit import Held, hold, kernel
from skidpad.core.objects.slots import fill_slots
from skidpad.core.states import ActorStates, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Clearance, RelocationReason, Supervision, Tier
from skidpad.roads.kernels import LaneArrays, project_point
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation.clear_place import find_clear_place
from skidpad.simulation.standing import has_reason, is_slow, stops_of

BRAKE_TIME = 0.5  # s, A-181
REVERSE_TIME = 2.0  # s, A-182
REVERSE_THROTTLE = 0.4
REVERSE_STEER_GAIN = 0.5
REVERSE_STEER_MAX = 0.3
LIFT = 0.5  # m above the road, so that no wheel begins inside it
COOL_DOWN = 3.0  # s, A-185
GRACE = 8.0  # s without the stuck detector after a relocation, A-188
WRONG_WAY_DOT = -0.5  # cosine of 120 deg, A-196
LIGHT_REACH = 30.0  # m to a stop line that explains standing
OFF_ROAD_TIME = 1.0  # s with all wheels off every lane (decision R-6)
OFF_ROAD_LIMIT = 3.0  # m that the car's middle lies beyond the road's edge

# by the stack; a member that is looked up in its class takes longer than the test
DRIVEN = Supervision.NONE
FULL_STOP = VehicleCommand(brake=1.0, handbrake=True)
HELD = VehicleCommand(brake=1.0)
ROLLING = VehicleCommand()
LEAVING = (RelocationReason.OFF_ROAD, RelocationReason.ROLL_OVER)  # it may be far from all lanes
HOLDING = frozenset(
    {Tier.STOPPED_BEHIND_CAR, Tier.APPROACH, Tier.ACC_HOLD, Tier.LIGHT_STOP, Tier.HOLDING_AT_LINE}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoverySettings:
    """What the sources leave open about recovery."""

    warm_up: float = 0.5  # s with brakes held; 1.5 as listed (D-076)
    release_speed: float = 5.5  # m/s given at its end; 0 as listed (D-077)
    clearance: Clearance = Clearance.OTHERS  # D-080
    grace: float = GRACE  # s, A-188
    stuck_time: float = 10.0  # s, A-200
    stuck_speed: float = mps_from_kmh(1.0)  # m/s, A-200

    def __post_init__(self) -> None:
        require_range("recovery.warm_up", self.warm_up, 0.05, 10.0)
        require_range("recovery.release_speed", self.release_speed, 0.0, 30.0)
        require_range("recovery.grace", self.grace, 0.0, 60.0)
        require_range("recovery.stuck_time", self.stuck_time, 1.0, 3600.0)
        require_range("recovery.stuck_speed", self.stuck_speed, 0.0, 5.0)


@dataclass(frozen=True, slots=True)
class Moved:
    """A relocation as it is recorded (A-194)."""

    reason: RelocationReason
    shift: float  # m moved back along the lane
    old: Pose
    new: Pose
    clear: bool  # False: no free place was found, the last one was taken


@dataclass(frozen=True, slots=True)
class Relocate:
    """A request to the backend; `moved` is None when only the speed changes (A-187)."""

    pose: Pose
    v: float
    moved: Moved | None = None


@fill_slots
@dataclass(frozen=True, slots=True)
class Action:
    """What is done in a tick: the command that is applied, after a relocation if there is one."""

    command: VehicleCommand
    relocate: Relocate | None = None
    notice: str = ""


class Supervisor:
    """State: phase, its age, cool-down and grace, time near standstill, counters."""

    def __init__(self, map: RoadMap, settings: RecoverySettings, dt: float) -> None:
        self.map, self.settings, self.dt = map, settings, dt
        self.stops = stops_of(map)
        self.reset()

    def reset(self) -> None:
        """Resets phase, counters and memory for the begin of a run."""
        self.phase = Supervision.NONE
        self.left = 0  # ticks of the present phase still to come
        self.cool_down = 0  # ticks
        self.grace = 0  # ticks
        self.standing = 0  # ticks
        self.recoveries = 0
        self.contacts_seen = 0  # index into the collision history
        self.reason = RelocationReason.COLLISION
        self.truth: WorldTruth | None = None
        self._states: ActorStates | None = None  # those of `_held`
        self.off = 0  # ticks with all wheels off every lane
        self.over = False  # the ego lies on its side
        self.first: LanePoint | None = None  # where the run began
        # lane, s, offset, as long as there was one
        self._last: tuple[int, float, float] | None = None

    def observe(self, truth: WorldTruth) -> Supervision:
        """Returns the phase of the tick that `truth` begins, a new one where it is due.

        Call it once per tick.
        """
        self.truth = truth
        self.contacts_seen += len(truth.contacts)
        self.over |= 0 in truth.rolled
        if self.phase is not DRIVEN:
            if self.left == 0:
                self._next_phase()
        elif truth.contacts and self.cool_down == 0:
            self.recoveries += 1
            self._begin(Supervision.BRAKE, BRAKE_TIME, RelocationReason.COLLISION)
        elif self.over:
            self._begin(Supervision.REALIGN, 0.0, RelocationReason.ROLL_OVER)
        elif (reason := self._astray(truth)) is not None:
            self._begin(Supervision.REALIGN, 0.0, reason)
        return self.phase

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """Returns what is applied in this tick, given the stack's own command and report; after `observe`.

        Counts the tick down; may begin a relocation of an ego that is stuck.
        """
        assert self.truth is not None, "observe() comes first"
        if self.cool_down:
            self.cool_down -= 1
        if self.grace:
            self.grace -= 1
        if self.left:
            self.left -= 1
        if self.phase is not DRIVEN:
            return self._recover(self.truth.states)
        if self._is_stuck(self.truth, report):
            self._begin(Supervision.REALIGN, 0.0, RelocationReason.STUCK)
            return self._realign(self.truth.states)
        return Action(command)

    def pass_ticks(self, ticks: int, last: tuple[int, float, float], standing: int) -> None:
        """Takes in so many ticks in which the stack drove, as it should.

        last: lane, s and offset there; standing: ticks without motion or reason by then.
        """
        self.cool_down = max(self.cool_down - ticks, 0)
        self.grace = max(self.grace - ticks, 0)
        self.standing, self.off = standing, 0
        self._last = last

    def _recover(self, states: ActorStates) -> Action:
        """Returns the action of a phase in which the supervisor drives."""
        if self.phase is Supervision.BRAKE:
            return Action(FULL_STOP)
        if self.phase is Supervision.REVERSE:
            return Action(self._reverse(states))
        if self.phase is Supervision.REALIGN:
            return self._realign(states)
        return self._warm_up(states)

    def _begin(self, phase: Supervision, duration: float, reason: RelocationReason) -> None:
        """Begins a phase that lasts `duration` in s and clears the counters."""
        self.phase, self.left = phase, round(duration / self.dt)
        self.reason, self.standing, self.off = reason, 0, 0

    def _next_phase(self) -> None:
        """Begins the phase that follows the current one when its time is over."""
        if self.phase is Supervision.BRAKE:
            self._begin(Supervision.REVERSE, REVERSE_TIME, self.reason)
        elif self.phase is Supervision.REVERSE:
            self._begin(Supervision.REALIGN, 0.0, self.reason)
        elif self.phase is Supervision.WARM_UP:
            self._begin(Supervision.NONE, 0.0, self.reason)

    def _find_lane(self, states: ActorStates) -> LanePoint | None:
        """Returns the place on a lane where the ego is; None off all lanes."""
        x, y, z = float(states.x[0]), float(states.y[0]), float(states.z[0])
        return self.map.project(x, y, z)

    def _reverse(self, states: ActorStates) -> VehicleCommand:
        """Returns the command that drives backwards towards the lane, straight without one (A-182).

        By the cross product of the heading and the vector to the lane in m, the lane's lateral distance.
        The published one is CARLA-handed: in ISO 8855 both it and the steer change sign, so the formula
        keeps its form.
        """
        place = self._find_lane(states)
        steer = 0.0
        if place is not None:
            dx, dy = place.x - float(states.x[0]), place.y - float(states.y[0])
            yaw = float(states.yaw[0])
            lateral = cos(yaw) * dy - sin(yaw) * dx
            steer = min(max(-REVERSE_STEER_GAIN * lateral, -REVERSE_STEER_MAX), REVERSE_STEER_MAX)
        return VehicleCommand(throttle=REVERSE_THROTTLE, steer=steer, reverse=True)

    def _realign(self, states: ActorStates) -> Action:
        """Returns the action that puts the ego on the lane; without a lane, one that waits (A-192).

        Begins the warm-up (A-183 to A-186, A-198).
        """
        assert self.truth is not None
        nearest = self._find_lane(states)
        if self.reason is RelocationReason.ROAD_END:
            nearest = self.first
        elif self.reason in LEAVING and nearest is None:
            nearest = None if self._last is None else self.map.at(*self._last)
        if nearest is None:
            return Action(FULL_STOP, notice="no driving lane near the ego, relocation is retried")
        place, shift, clear = find_clear_place(
            self.map, nearest, self.truth, self.settings.clearance
        )
        new = replace(place.pose, z=place.z + LIFT)
        self.over = False
        moved = Moved(self.reason, shift, states.pose(0), new, clear)
        self.cool_down = round(COOL_DOWN / self.dt)
        self.grace = round(self.settings.grace / self.dt)
        self._begin(Supervision.WARM_UP, self.settings.warm_up, self.reason)
        notice = "" if clear else "no free place found, the ego was put near another vehicle"
        if self.reason is RelocationReason.ROAD_END:
            notice = "the map ends there, the ego was put back where it began"
        return Action(HELD, Relocate(new, 0.0, moved), notice)

    def _warm_up(self, states: ActorStates) -> Action:
        """Returns the action while the ego is held, and then its release along its lane."""
        if self.left > 0:
            return Action(HELD)
        place = self._find_lane(states)
        yaw = float(states.yaw[0]) if place is None else place.heading
        pose = replace(states.pose(0), yaw=yaw)
        return Action(ROLLING, Relocate(pose, self.settings.release_speed))

    def _astray(self, truth: WorldTruth) -> RelocationReason | None:
        """Returns why the ego is put back although it touched nothing, None where it is not.

        Wrong way, off the road, or over the end of the map. Notes the place on a lane.
        """
        states = truth.states
        lane, s, offset, turned, inside = find_ego(self.map.held, self._hold(states))
        if lane >= 0:
            self._last = lane, s, offset
            if self.first is None:
                self.first = self.map.at(lane, s, offset)
            # more than 120 deg off; lanes of a crossing lead all ways
            if turned < WRONG_WAY_DOT and self.map.lanes.junction[lane] < 0:
                return RelocationReason.WRONG_WAY
        if inside or self._last is None:
            self.off = 0
            return None
        if not self._has_left(truth):
            return None
        x, y = float(states.x[0]), float(states.y[0])
        ended = is_past_the_end(self.map, x, y, self.map.at(*self._last))
        return RelocationReason.ROAD_END if ended else RelocationReason.OFF_ROAD

    def _has_left(self, truth: WorldTruth) -> bool:
        """Returns whether all wheels are off every lane for a second, or the car far beyond the edge (R-6).

        Counts the ticks.
        """
        states, table = truth.states, truth.table
        x, y, z, yaw = states.x[:1], states.y[:1], states.z[:1], states.yaw[:1]
        size = float(table.length[0]), float(table.width[0])
        if not self.map.edge.off(x, y, z, yaw, *size)[0]:
            self.off = 0
            return False
        self.off += 1
        beyond = float(self.map.edge.beyond(x, y, z)[0])
        return self.off * self.dt >= OFF_ROAD_TIME or beyond > OFF_ROAD_LIMIT

    def _is_stuck(self, truth: WorldTruth, report: StackReport | None) -> bool:
        """Returns whether the ego is near standstill for too long without a reason to stand (A-200).

        Counts the ticks.
        """
        slow = is_slow(self._hold(truth.states), self.settings.stuck_speed)
        if not slow or self.grace > 0 or self._has_reason(truth, report):
            self.standing = 0
            return False
        self.standing += 1
        return self.standing * self.dt >= self.settings.stuck_time

    def _has_reason(self, truth: WorldTruth, report: StackReport | None) -> bool:
        """Returns whether the stack says that it holds, or an actor or a red light stands ahead."""
        if report is not None and report.tier in HOLDING:
            return True
        held, stops = self._hold(truth.states), self.stops
        lit = stops.show(truth.lights)
        return bool(has_reason(self.map.held, held, stops.lane, stops.s, lit, LIGHT_REACH))

    def _hold(self, states: ActorStates) -> Held[ActorStates]:
        """Returns the states for kernels; they are held anew when they are another object."""
        if states is not self._states:
            self._states, self._held = states, hold(states)
        return self._held


def is_past_the_end(map: RoadMap, x: float, y: float, last: LanePoint) -> bool:
    """Returns whether a vehicle left over the end of a lane that leads nowhere: there the map ends.

    x, y: m, where it is now. last: its last place on a lane.
    """
    lanes, drivable = map.lanes, map.arrays.drivable
    if last.s < lanes.length[last.lane] - 0.01 or any(
        drivable[lane] for lane in map.successors(last.lane)
    ):
        return False
    dx, dy = x - last.x, y - last.y
    ahead = dx * cos(last.heading) + dy * sin(last.heading)
    return ahead > abs(dy * cos(last.heading) - dx * sin(last.heading))


@kernel
def find_ego(
    map: Held[LaneArrays], held: Held[ActorStates]
) -> tuple[int, float, float, float, bool]:
    """Returns the ego's lane (-1: none), s and offset, the cosine of its yaw error, and if it is inside.

    Inside is less than half the lane's width from its centre.
    """
    states = held.value
    x, y = states.x[0], states.y[0]
    lane, s, offset, px, py, _, heading, _, width = project_point(
        map.value, x, y, states.z[0], True
    )
    if lane < 0:
        return -1, s, offset, 1.0, False
    return lane, s, offset, cos(heading - states.yaw[0]), hypot(x - px, y - py) < 0.5 * width
