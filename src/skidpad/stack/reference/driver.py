"""A careful human-like driver: it is given a view of its own type, late and incomplete, and nothing else.

Car following, bends, lights and care for weather as the background's drivers have them
(docs/traffic.md); perception limits and reaction time from the literature. A model, not a human.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from math import inf, sqrt
from typing import Any

import numpy as np

from skidpad.core.errors import require_choice
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.sensor_types import read_sensor
from skidpad.core.setup import DT
from skidpad.core.specs import EyesSpec, SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.traffic.sight import DriverView, SeenActors
from skidpad.core.vocabulary import LightState, Supervision, Tier
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.stack.channels.control import Controller
from skidpad.stack.channels.route import Line
from skidpad.stack.channels.settings import CarModel
from skidpad.stack.reference.caution import (
    B_YELLOW,
    bend_speed,
    manner,
    sight_speed,
    speed_factor,
    too_fast,
)
from skidpad.stack.reference.following import Manner, acceleration
from skidpad.stack.reference.junctions import LOOK_FROM, V_THROUGH, GivingWay
from skidpad.stack.reference.person import Person, person_of
from skidpad.stack.reference.way import Body, Place, Way, anticipate_actors, gaps_ahead

EYES = "eyes"
KEYS = ("seed", "car", "cruise_kmh")
HELD = VehicleCommand(brake=1.0)  # while the supervisor drives; it overrides this anyway
LINE_MARGIN = 1.0  # m kept to a line
LINE_HEADWAY = 0.5  # s kept to it
PREVIEW = 10.0  # m beyond the comfortable braking distance for which limits and bends are looked at
PREVIEW_STEP = 4  # points between two places looked at
LIGHT_REACH = 150.0  # m
HALT, STANDING = 3.0, 0.5  # m to a stop line and m/s at which it counts as having stopped
PASSED = 1.5  # m beyond which a line is crossed and no longer given way at
COMPARED = 0.4  # s between two views from which slowing down is judged (ours)
REMEMBERED = 3.0  # s for which a light is taken to be as it was last seen


class ReferenceDriver:
    """One person at the wheel. Deterministic: commands depend on the views alone."""

    def __init__(
        self,
        map: RoadMap,
        person: Person,
        car: CarModel,
        dt: float = DT,
        cruise: float | None = None,
    ) -> None:
        """cruise: speed in m/s that is wanted instead of the person's share of the limit."""
        self.person, self.car, self.dt, self.cruise = person, car, dt, cruise
        self.way, self.giving_way = Way(map), GivingWay(map)
        self.controller = Controller(car, dt)
        self.reset()

    def reset(self) -> None:
        """Forgets what was seen before, as the car now stands elsewhere."""
        self.way.reset()
        self.controller.reset()
        self.lights: dict[int, tuple[int, LightState]] = {}
        self.stopping: int | None = None  # signal for which it has decided to stop
        self.halted: int | None = None  # stop sign at which it has stood
        self.views: deque[tuple[int, SeenActors]] = deque(maxlen=round(COMPARED / self.dt) + 1)
        self.report = StackReport()

    def act(self, view: DriverView) -> VehicleCommand:
        """Returns the driver's command for one view.

        Moderate braking off every lane. Call it once per tick.
        """
        place = self.way.update(view.pose)
        if place is None:  # off every lane
            self.report = StackReport(tier=Tier.NONE)
            return VehicleCommand(brake=0.5)
        v = max(view.speed, 0.0)
        m = manner(self.person, view.road, v)
        v_desired = self._desired_speed(view, place, v, m)
        a, tier = acceleration(v, v_desired, inf, 0.0, m), Tier.CRUISE
        if v > v_desired:
            a, tier = min(a, too_fast(v - v_desired, view.road, v)), Tier.BEND
        gap, v_lead = self._lead(view, place, v)
        if (a_follow := acceleration(v, v_desired, gap, v_lead, m)) < a:
            a, tier = a_follow, Tier.ACC_CLOSE
        line = self._line(view, place, v, m)
        a_line = acceleration(v, v_desired, line, 0.0, m._replace(headway=LINE_HEADWAY))
        if a_line < a:
            a, tier = a_line, Tier.LIGHT_STOP
        self.report = StackReport(
            tier=tier,
            detected=gap < inf,
            distance=gap if gap < inf else None,
            time_gap=gap / v if gap < inf and v > 0.5 else None,
            v_target=v_desired,
            lane_offset=place.offset,
        )
        pose = (view.pose.x, view.pose.y, view.pose.yaw)
        points = self.way.path.points
        return self.controller.update(points, place.at, pose, v, view.yaw_rate, a)

    def _desired_speed(self, view: DriverView, place: Place, v: float, m: Manner) -> float:
        """Returns the m/s that limits, bends and sight allow, each reached by comfortable braking."""
        points, road = self.way.path.points, view.road
        factor = speed_factor(road, v)
        end = place.at + int(v * v / (2.0 * m.b) + PREVIEW) + 1
        allowed = np.inf
        for k in range(place.at, min(end, len(points.x)), PREVIEW_STEP):
            wish = self.cruise
            if wish is None:
                wish = self.person.speed * float(points.limit[k])
            there = min(factor * wish, bend_speed(road, float(points.curvature[k])))
            way = max(k - place.s, 0.0)
            allowed = min(allowed, sqrt(there * there + 2.0 * m.b * way))
        return sight_speed(road, view.visibility, self.person.reaction, allowed)

    def _lead(self, view: DriverView, place: Place, v: float) -> tuple[float, float]:
        """Notes the view and returns m to the nearest actor in the way, and its m/s along the way.

        (inf, 0) where there is none.
        """
        self.views.append((view.tick, view.actors))
        if not len(view.actors.x):
            return inf, 0.0
        before_tick, before = self.views[0]
        span = (view.tick - before_tick) * self.dt
        expected = anticipate_actors(view.actors, before, span, view.age)
        body = Body(place.s, v, 0.5 * self.car.length, 0.5 * self.car.width)
        gaps, speeds = gaps_ahead(self.way.path.points, place.at, expected, body)
        nearest = int(np.argmin(gaps))
        return float(gaps[nearest]), max(float(speeds[nearest]), 0.0)

    def _line(self, view: DriverView, place: Place, v: float, m: Manner) -> float:
        """Notes the lights and returns the m to the nearest line at which it stops.

        0.1 at least; inf where it stops at none.
        """
        for signal, state in view.lights.items():
            self.lights[signal] = (view.tick, state)
        for line in self.way.path.lines:
            gap = line.s - place.s - 0.5 * self.car.length - LINE_MARGIN
            if gap < -0.5 * self.car.length or gap > LIGHT_REACH:
                continue
            if line.kind is SignalKind.LIGHT:
                stops = self._stops_for(line.signal, view.tick, gap, v, m)
            else:
                stops = gap > -PASSED and self._gives_way(line, view, place, gap, v, m)
            if stops:
                return max(gap, 0.1)
        return inf

    def _gives_way(
        self, line: Line, view: DriverView, place: Place, gap: float, v: float, m: Manner
    ) -> bool:
        """Returns whether it stops at a stop or yield line: by its sign, or as another comes too soon.

        gap: m from the front to LINE_MARGIN before the line. Notes that it stood at a stop sign.
        """
        if line.kind is SignalKind.STOP and self.halted != line.signal:
            if gap > HALT or v > STANDING:
                return True
            self.halted = line.signal
        if gap > LOOK_FROM:
            return v > V_THROUGH
        return self.giving_way.must_wait(
            self.way.path.points, place.at, gap + LINE_MARGIN, v, self.car.length, m.a_max,
            anticipate_actors(view.actors, view.actors, 0.0, view.age),
        )  # fmt: skip

    def _stops_for(self, signal: int, tick: int, gap: float, v: float, m: Manner) -> bool:
        """Returns whether it stops at a light; one not seen for REMEMBERED s may be red. Notes the decision.

        gap: m to the line; a stop once decided lasts until green or dark.
        """
        seen, state = self.lights.get(signal, (tick, LightState.UNKNOWN))
        if (tick - seen) * self.dt > REMEMBERED and state is not LightState.RED:
            state = LightState.UNKNOWN
        if state in (LightState.GREEN, LightState.OFF):
            if self.stopping == signal:
                self.stopping = None
            return False
        b = min(B_YELLOW, -m.a_min)
        if (
            state is LightState.YELLOW
            and self.stopping != signal
            and v * v > 2.0 * b * max(gap, 0.0)
        ):
            return False
        self.stopping = signal
        return True


class ReferenceStack:
    """Seats the reference driver in the car: hands it its view, and nothing else of the frame."""

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        """settings: `car`, what it knows of its car; `seed`, which person drives; `cruise_kmh`."""
        del specs
        for key in settings:
            require_choice("reference driver option", key, KEYS)
        self.person = person_of(int(settings.get("seed", 0)))
        cruise = settings.get("cruise_kmh")
        self.driver = ReferenceDriver(
            map,
            self.person,
            CarModel(**settings["car"]),
            cruise=None if cruise is None else mps_from_kmh(float(cruise)),
        )
        self.supervision = Supervision.NONE

    @property
    def report(self) -> StackReport:
        """What the driver thought in the last tick."""
        return self.driver.report

    @property
    def mode(self) -> str:
        """The tier that the driver minded most in the last tick, in lower case; "" before the first."""
        tier = self.report.tier
        return "" if tier is None else tier.name.lower()

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the eyes of this person as the only sensor."""
        return (EyesSpec(EYES, self.person.reaction),)

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the driver's command for the view of its eyes; HELD while a supervisor drives.

        The driver begins anew when the supervisor hands over.
        """
        if frame.supervision is not Supervision.NONE:
            self.supervision = frame.supervision
            return HELD
        if self.supervision is not Supervision.NONE:
            self.supervision = Supervision.NONE
            self.driver.reset()
        return self.driver.act(read_sensor(frame, EYES, DriverView))
