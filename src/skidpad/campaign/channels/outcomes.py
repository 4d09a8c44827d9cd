"""What became of a drive: collisions, red lights run, stalls, and how the arbiter acted (C-9)."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np

from skidpad.core.channels import Decision
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import LightState
from skidpad.recording.channels.drives import DriveOutcome, Ending, extend_way
from skidpad.roads.lanes import SignalKind
from skidpad.stack.channels.route import SEARCH, STEP, RoutePath, locate
from skidpad.stack.channels.settings import CarModel

V_STANDING = 0.3  # m/s
STALL_TIME = 60.0  # s standing without a red light or a standing vehicle ahead
STUCK_TIME = 180.0  # s standing for any reason: a red phase lasts 32 s
QUEUE_REACH = 12.0  # m between centres to the vehicle in front, in a queue
QUEUE_HALF_WIDTH = 1.5  # m
RED_REACH = 60.0  # m to a red light that explains standing
LOST = 8.0  # m beside the route
AGAIN = 3.0  # s within which a contact with the same actor is the same collision


class Referee:
    """Counts distance, contacts, red lights and stalls in the true world; `over` ends the drive early."""

    def __init__(self, route: RoutePath, car: CarModel, dt: float) -> None:
        self.route, self.car, self.dt = route, car, dt
        self.over = False
        self.ended = Ending.TIME
        self.cycles = self.switches = self.reds = self.stalls = self.at = 0
        self.distance = self.stood = self.minimal_risk = 0.0
        self.driving: dict[str, float] = {}
        self.hits: list[bool] = []
        self.way: list[tuple[float, float]] = []
        self._last: dict[tuple[int, str], float] = {}
        self._place: tuple[float, float] | None = None
        self._driver: str | None = None
        self._front = 0.0

    def observe(self, truth: WorldTruth, decision: Decision) -> None:
        """Takes in one cycle of the true world; sets `over` when the ego stalled, lost or ended its route."""
        s = truth.states
        x, y, v = float(s.x[0]), float(s.y[0]), hypot(float(s.vx[0]), float(s.vy[0]))
        if self._place is not None:
            self.distance += hypot(x - self._place[0], y - self._place[1])
        self._place = (x, y)
        extend_way(self.way, x, y)
        self.cycles += 1
        if self._driver is not None and decision.driving != self._driver:
            self.switches += 1
        self._driver = decision.driving
        if decision.driving:
            self.driving[decision.driving] = self.driving.get(decision.driving, 0.0) + self.dt
        else:
            self.minimal_risk += self.dt
        self.at, offset = locate(self.route.points, x, y, self.at, SEARCH)
        self._lines(truth)
        self._standing(v, truth)
        if abs(offset) > LOST or self.at * STEP > self.route.length - 30.0:
            self.over, self.ended = True, Ending.OFF_ROUTE

    def note_contacts(self, t: float, truth: WorldTruth) -> None:
        """Counts the contacts of one tick at `t` s; those with the same body within AGAIN s are one."""
        s = truth.states
        for contact in truth.contacts:
            key = (contact.actor, contact.static)
            if t - self._last.get(key, -AGAIN) >= AGAIN:
                yaw = float(s.yaw[0])
                dx, dy = contact.x - float(s.x[0]), contact.y - float(s.y[0])
                ahead = cos(yaw) * dx + sin(yaw) * dy
                self.hits.append(ahead > 0.3 * self.car.length)
            self._last[key] = t

    def _lines(self, truth: WorldTruth) -> None:
        """Counts each red light whose line the ego's front has passed since the last call."""
        front = self.at * STEP + 0.5 * self.car.length
        for line in self.route.lines:
            if line.kind is not SignalKind.LIGHT or not self._front < line.s <= front:
                continue
            if truth.lights.get(line.signal) is LightState.RED:
                self.reds += 1
        self._front = max(front, self._front)

    def _standing(self, v: float, truth: WorldTruth) -> None:
        """Adds the ego's standing up; ends the drive after STALL_TIME s, STUCK_TIME where it is explained.

        A red light or a standing vehicle ahead explains it.
        """
        if v >= V_STANDING:
            self.stood = 0.0
            return
        self.stood += self.dt
        waits = self._red_ahead(truth) or _queues(truth)
        limit = STUCK_TIME if waits else STALL_TIME
        if self.stood > limit:
            self.stalls += 1
            self.over, self.ended = True, Ending.STALLED

    def _red_ahead(self, truth: WorldTruth) -> bool:
        """Returns True when a light that is not green lies within RED_REACH m ahead on the route."""
        here = self.at * STEP
        return any(
            line.kind is SignalKind.LIGHT
            and -5.0 < line.s - here < RED_REACH
            and truth.lights.get(line.signal) is not LightState.GREEN
            for line in self.route.lines
        )

    def outcome(self, route: str, seed: int, drive_by: str) -> DriveOutcome:
        """Returns the outcome of the drive as a row of results."""
        return DriveOutcome(
            route=route,
            seed=seed,
            drive_by=drive_by,
            driven_s=self.cycles * self.dt,
            distance_m=self.distance,
            collisions=len(self.hits),
            collisions_struck=sum(self.hits),
            red_lights_run=self.reds,
            stalls=self.stalls,
            ended=self.ended,
            switches=self.switches,
            minimal_risk_s=self.minimal_risk,
            driving_s=dict(sorted(self.driving.items())),
            way=tuple(self.way),
        )


def _queues(truth: WorldTruth) -> bool:
    """Returns True when an actor stands within QUEUE_REACH m right in front of the ego."""
    s = truth.states
    dx, dy = s.x[1:] - s.x[0], s.y[1:] - s.y[0]
    c, sn = cos(float(s.yaw[0])), sin(float(s.yaw[0]))
    ahead, left = c * dx + sn * dy, c * dy - sn * dx
    stands = s.present[1:] & (np.hypot(s.vx[1:], s.vy[1:]) < V_STANDING)
    near = (ahead > 0.0) & (ahead < QUEUE_REACH) & (np.abs(left) < QUEUE_HALF_WIDTH)
    return bool((stands & near).any())
