"""One driving channel: from its own view to what it says and what it would do."""

from __future__ import annotations

from math import cos, hypot, inf, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, ChannelView
from skidpad.core.geometry import footprint
from skidpad.core.kernels.jit import kernel
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import LightState, SemanticClass
from skidpad.roads.along import advance_point
from skidpad.roads.kernels import LaneArrays, project_point
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.stack.channels.control import Controller
from skidpad.stack.channels.planning import SPEED_FACTOR, PlanParams, find_blocks, roll_out
from skidpad.stack.channels.route import SEARCH, STEP, Line, RoutePath, locate
from skidpad.stack.channels.settings import CarModel, ChannelSettings
from skidpad.stack.channels.tracking import Tracker

V_MOVING = 0.5  # m/s, slower objects are predicted to stay
ALIGNED = 0.87  # cosine of 30 deg between motion and lane
OFFSET_MAX = 2.0  # m beside the centre line
CYCLE = 0.1  # s (C-022)
LINE_REACH = 100.0  # m in which lines on the path matter
YELLOW_BRAKE = 3.0  # m/s^2, stops at yellow if this is enough
HALT_SPEED = 0.3  # m/s, that counts as a stop
HALT_REACH = 4.0  # m between front and line in which a stop counts
YIELD_SPEED = 4.0  # m/s at a yield line before the road is seen to be free
CLEAR_REACH = 45.0  # m around a line in which other vehicles matter
CLEAR_TIME = 5.0  # s, critical gap of minor streets (HCM 2010, 4.1 to 7.1 s)
RELIEF = 1.5  # s for a change of driver before a light: dwell 1 s and the next one's own reaction
CORNERS = 4


class Channel:
    """Tracks, predicts and plans from its own views and the map; call `update` once per cycle."""

    def __init__(
        self, name: str, settings: ChannelSettings, car: CarModel, map: RoadMap, route: RoutePath
    ) -> None:
        self.name, self.settings, self.car = name, settings, car
        self.map, self.route = map, route
        self._params = PlanParams(0.5 * car.length, 0.5 * car.width)
        self._times = np.arange(0.0, settings.prediction_horizon + 1e-9, settings.prediction_step)
        self._polygon = footprint(0.0, 0.0, 0.0, car.length, car.width)
        self.tracker = Tracker(settings)
        self.controller = Controller(car, CYCLE)
        self.reset()

    def reset(self) -> None:
        """Resets plan, tracks and controllers of the channel to the start of the route."""
        self.tracker.reset()
        self.controller.reset()
        self.at = 0  # point of the route beside the ego
        self.halted: float | None = None  # s of the line at which it has stopped
        self.waiting = 0.0  # s at that line
        self.command = VehicleCommand()
        self.v_planned = 0.0  # m/s that the plan reaches at its end: how much it progresses
        self.abstains = False  # it does not know the line that it comes to

    def keep_below(self, v_max: float) -> None:
        """Plans from now on for no more than `v_max` (m/s, > 0); inf: as it would by itself."""
        factor = min(SPEED_FACTOR, v_max / float(self.route.points.limit.max()))
        self._params = self._params._replace(speed_factor=factor)

    def update(self, view: ChannelView) -> ChannelFrame:
        """Tracks, predicts and plans one cycle; returns the frame and sets `self.command`."""
        self.tracker.update(view)
        rows = self.tracker.confirmed_tracks
        objects = self.tracker.objects(view.ego)
        labels = np.ascontiguousarray(rows["label"])
        sizes = np.column_stack([rows["length"], rows["width"]])
        x, y, heading, v, rate = view.ego.tolist()
        path = self.route.points
        self.at, offset = locate(path, x, y, self.at, SEARCH)
        predictions = np.empty((len(rows), len(self._times), 2))
        z = float(path.z[self.at])
        predict(
            self.map.arrays,
            objects,
            labels,
            z,
            self.settings.lane_prediction,
            self._times,
            predictions,
        )
        plan = self._plan(view, offset, objects, sizes, predictions)
        self.abstains = self._comes_to_a_line_unseen(v)
        pose = (x, y, heading)
        self.command = self.controller.update(path, self.at, pose, v, rate, self.a_planned)
        return ChannelFrame(
            t=view.t,
            ego=np.array([x, y, heading, v * cos(heading), v * sin(heading)]),
            ego_polygon=self._polygon,
            plan=plan,
            objects=objects,
            polygons=_boxes(sizes),
            polygon_size=np.full(len(rows), CORNERS, dtype=np.int64),
            predictions=predictions,
            prediction_t=self._times,
            ids=rows["id"].copy() if self.settings.gives_ids else np.full(len(rows), -1, np.int64),
            classes=labels,
        )

    def _plan(
        self,
        view: ChannelView,
        offset: float,
        objects: Floats,
        sizes: Floats,
        predictions: Floats,
    ) -> Floats:
        """Returns the plan (n, 3) of x, y, t from the ego on along the route, slowed by blocks and stops.

        offset: m of the ego left of the route. Sets `a_planned`, m/s^2, and `v_planned`.
        """
        c, v = self.settings, float(view.ego[3])
        blocks = find_blocks(
            self.route.points, self.at, v, objects, sizes, predictions, self._times, self._params
        )
        stop = self._stop(view, objects, v)
        plan = np.empty((round(c.plan_horizon / c.plan_step) + 1, 3))
        self.a_planned = roll_out(
            self.route.points, self.at, offset, max(v, 0.0), blocks, stop, c.plan_horizon,
            c.plan_step, self._params, plan,
        )  # fmt: skip
        plan[0, :2] = view.ego[:2]
        last = plan[-1, :2] - plan[-2, :2]
        self.v_planned = hypot(*last.tolist()) / c.plan_step
        return plan

    def _stop(self, view: ChannelView, objects: Floats, v: float) -> float:
        """Returns the m from the ego's centre to the nearest line at which it must stop; inf: none."""
        front = self.at * STEP + 0.5 * self.car.length
        for line in self.route.lines:
            gap = line.s - front
            if gap < -1.0:
                continue
            if gap > LINE_REACH:
                break
            if self._must_stop(line, gap, view, objects, v):
                return line.s - self.at * STEP
        return inf

    def _comes_to_a_line_unseen(self, v: float) -> bool:
        """Returns whether a light or line that this channel does not obey is within its way of stopping.

        From where another channel can still take over and brake comfortably, to the line itself.
        """
        c = self.settings
        front = self.at * STEP + 0.5 * self.car.length
        way = v * RELIEF + v * v / (2.0 * self._params.b_comfort) + HALT_REACH
        return any(
            -1.0 <= line.s - front <= way
            and not (c.reads_lights if line.kind is SignalKind.LIGHT else c.reads_stop_lines)
            for line in self.route.lines
        )

    def _must_stop(
        self, line: Line, gap: float, view: ChannelView, objects: Floats, v: float
    ) -> bool:
        """Returns whether the ego must stop before a line `gap` m ahead, by light or by right of way.

        Never for what the channel does not read. Yellow counts where YELLOW_BRAKE is enough.
        """
        if line.kind is SignalKind.LIGHT:
            if not self.settings.reads_lights:
                return False
            state = view.lights.get(line.signal)
            can = v * v <= 2.0 * YELLOW_BRAKE * max(gap, 0.0)
            return state is LightState.RED or (state is LightState.YELLOW and can)
        if not self.settings.reads_stop_lines:
            return False
        return not self._may_pass(line, gap, objects, v, view.ego[:2])

    def _may_pass(self, line: Line, gap: float, objects: Floats, v: float, ego: Floats) -> bool:
        """Returns whether to pass a stop line after a stop, or a yield line when slow, when nothing comes.

        To be called once a cycle: it notes the halt at the line and counts the waiting.
        """
        if self.halted == line.s and gap > HALT_REACH:
            self.halted = None
        near = gap < HALT_REACH
        calm = v < (HALT_SPEED if line.kind is SignalKind.STOP else YIELD_SPEED)
        if near and calm and self.halted != line.s:
            self.halted, self.waiting = line.s, 0.0
        if self.halted != line.s:
            return False
        self.waiting += CYCLE
        if gap < 0.5 and v > HALT_SPEED:
            return True  # it is under way
        return self._road_is_free(line, objects, ego)

    def _road_is_free(self, line: Line, objects: Floats, ego: Floats) -> bool:
        """Returns whether no tracked object moves in the junction behind a line or will within CLEAR_TIME.

        Of those outside, only objects to the left of the ego that come nearer count, within CLEAR_REACH.
        """
        if not len(objects):
            return True
        path = self.route.points
        j = min(int(line.s / STEP) + 12, len(path.x) - 1)  # the middle of the junction
        to_x, to_y = float(path.x[j]) - objects[:, 0], float(path.y[j]) - objects[:, 1]
        distance = np.hypot(to_x, to_y)
        closing = (to_x * objects[:, 3] + to_y * objects[:, 4]) / np.maximum(distance, 1e-6)
        h = float(path.heading[self.at])
        side = cos(h) * (objects[:, 0] - ego[0]) + sin(h) * (objects[:, 1] - ego[1])
        coming = (distance < CLEAR_REACH) & (side > 0.0) & (closing > 1.0)
        coming &= distance - 6.0 < closing * CLEAR_TIME
        inside = (distance < 9.0) & (np.hypot(objects[:, 3], objects[:, 4]) > 0.5)
        return not bool((coming | inside).any())


def _boxes(sizes: Floats) -> Floats:
    """Returns (n, 4, 2) corners in m of boxes with length and width (n, 2), in their own frames."""
    half = 0.5 * sizes[:, None, :]
    signs = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    boxes: Floats = half * signs[None]
    return boxes


# Where tracked objects will be: along their lanes, or straight on.


PERSON = int(SemanticClass.PEDESTRIAN)


@kernel
def predict(
    lanes: LaneArrays,
    objects: Floats,
    labels: NDArray[np.int64],
    z: float,
    along_lanes: bool,
    times: Floats,
    out: Floats,
) -> None:
    """Writes positions of objects at `times` (p,) into out (n, p, 2), at constant speed.

    objects (n, 5): x, y, heading, vx, vy; z: m, height of the road for all. A vehicle that moves with its
    lane keeps its offset from the centre line and takes the straightest way on; everything else goes
    straight on, and what is slower than V_MOVING stays.
    """
    for i in range(objects.shape[0]):
        x, y, vx, vy = objects[i, 0], objects[i, 1], objects[i, 3], objects[i, 4]
        v = hypot(vx, vy)
        if v < V_MOVING:
            vx = vy = v = 0.0
        for k in range(times.size):
            out[i, k, 0], out[i, k, 1] = x + vx * times[k], y + vy * times[k]
        if not along_lanes or v == 0.0 or labels[i] == PERSON:
            continue
        lane, s, offset, _, _, _, heading, _, _ = project_point(lanes, x, y, z, True)
        if lane < 0 or abs(offset) > OFFSET_MAX:
            continue
        if vx * cos(heading) + vy * sin(heading) < ALIGNED * v:
            continue
        for k in range(times.size):
            there = advance_point(lanes, lane, s, v * times[k], heading)
            if there[0] < 0:
                break
            out[i, k, 0] = there[3] - offset * sin(there[6])
            out[i, k, 1] = there[4] + offset * cos(there[6])
