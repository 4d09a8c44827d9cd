"""Channels track, predict and plan from their own views; the arbiter chooses (C-9)."""

from math import hypot

import numpy as np
import pytest

from skidpad.core.channels import ChannelView
from skidpad.core.vocabulary import LightState, SemanticClass
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import SignalKind
from skidpad.stack.channels.arbiter import Arbiter, Reason
from skidpad.stack.channels.channel import Channel
from skidpad.stack.channels.route import route_path
from skidpad.stack.channels.settings import CarModel, load_channel_settings
from skidpad.stack.channels.tracking import Tracker

CAR = CarModel(length=3.8, width=1.7, wheelbase=2.5, steer_max=1.2, a_drive=4.0, a_brake=9.0)
LAV, TFUSE = load_channel_settings("lav_like"), load_channel_settings("tfuse_like")


def view(t, ego=(0, 0, 0, 0, 0), objects=(), lights=None, late=0.0, label=SemanticClass.CAR):
    rows = np.array(objects, dtype=float).reshape(-1, 5)
    return ChannelView(
        t, np.array(ego, dtype=float), t - late, rows, np.full(len(rows), int(label)), lights or {}
    )


def town_channel(settings, lanes=(18, 71, 30), s=10.0):
    map = load_map("town")
    route = route_path(map, lanes, s)
    return Channel("test", settings, CAR, map, route), route


def pose_at(route, s, v):
    p = route.points
    k = int(s)
    return (float(p.x[k]), float(p.y[k]), float(p.heading[k]), v, 0.0)


@pytest.mark.req("C-020", "C-026")
def test_tracks_find_position_velocity_and_identity():
    rng = np.random.default_rng(3)
    tracker = Tracker(LAV)
    for k in range(60):
        t = 0.1 * k
        x, y = 30.0 - 4.0 * t, 5.0 + 1.0 * t
        noise = rng.normal(0.0, 0.1, 2)
        if k % 7 != 3:
            tracker.update(view(t, (0, 0, 0, 0, 0), [(x + noise[0], y + noise[1], 3.0, 4.5, 1.9)]))
        else:
            tracker.update(view(t))
    found = tracker.objects(np.array([100.0, 50.0, 0.0]))
    assert len(found) == 1
    assert found[0, :2] == pytest.approx([100 + 30 - 4 * 5.9, 50 + 5 + 5.9], abs=0.4)
    assert found[0, 3:] == pytest.approx([-4.0, 1.0], abs=0.6)
    assert tracker.confirmed_tracks["id"].tolist() == [0]
    for k in range(60, 70):
        tracker.update(view(0.1 * k))
    assert len(tracker.objects(np.zeros(3))) == 0


@pytest.mark.req("C-020", "C-026")
@pytest.mark.parametrize("v", [36.0, -36.0, 24.0])
def test_whoever_drives_at_motorway_speed_becomes_a_track(v):
    """Between two cycles a car goes farther than a track's gate; the second sight must still be of it."""
    tracker = Tracker(LAV)
    for k in range(6):
        t = 0.1 * k
        heading = 0.0 if v > 0 else np.pi
        seen = (20.0 + (v - 30.0) * t, 3.5, heading, 4.5, 1.9)
        tracker.update(view(t, (30.0 * t, 0, 0, 30.0, 0), [seen]))
        if k == LAV.confirm - 1:
            assert tracker.confirmed_tracks["id"].tolist() == [0]
    (found,) = tracker.objects(tracker.pose)
    assert found[:2] == pytest.approx([30.0 * t + 20.0 + (v - 30.0) * t, 3.5], abs=0.2)
    assert found[3:] == pytest.approx([v, 0.0], abs=1.5)


@pytest.mark.req("C-026")
def test_a_standing_car_stands_while_the_ego_turns_and_drives():
    """The odometry frame: ego motion gives objects no velocity, latency included."""
    tracker = Tracker(LAV)
    x = y = h = 0.0
    places = []
    for k in range(50):
        places.append((x, y, h))
        px, py, ph = places[max(k - 1, 0)]
        dx, dy = 40.0 - px, 20.0 - py
        c, s = np.cos(ph), np.sin(ph)
        rel = (c * dx + s * dy, -s * dx + c * dy, -ph, 4.5, 1.9)
        tracker.update(view(0.1 * k, (x, y, h, 8.0, 0.2), [rel], late=0.1 if k else 0.0))
        middle = h + 0.01
        x, y, h = x + 0.8 * np.cos(middle), y + 0.8 * np.sin(middle), h + 0.02
    found = tracker.objects(np.array(places[-1]))
    assert found[0, :2] == pytest.approx([40.0, 20.0], abs=0.1)
    assert hypot(found[0, 3], found[0, 4]) < 0.2


@pytest.mark.req("C-020", "C-022", "C-024", "C-025")
def test_plan_lengths_and_shapes():
    for settings, end in ((LAV, 4.0), (TFUSE, 2.0)):
        channel, route = town_channel(settings)
        frame = channel.update(view(0.0, pose_at(route, 20, 8.0)))
        assert frame.plan[0] == pytest.approx([*pose_at(route, 20, 0)[:2], 0.0])
        assert frame.plan[-1, 2] == pytest.approx(end)
        assert (np.diff(frame.plan[:, 2]) > 0).all()
        assert frame.ego_polygon.shape == (4, 2)


@pytest.mark.req("C-024")
def test_only_who_recognises_lines_stops_at_them():
    ends = []
    for settings in (LAV, TFUSE):
        channel, route = town_channel(settings)
        line = next(x for x in route.lines if x.kind is SignalKind.STOP)
        s, v = line.s - 40.0, 8.0
        slowest = v
        for k in range(120):
            channel.update(view(0.1 * k, pose_at(route, s, v)))
            v = max(v + 0.1 * channel.a_planned, 0.0)
            s += 0.1 * v
            if s < line.s:
                slowest = min(slowest, v)
        ends.append((slowest, s - line.s))
    assert ends[0][0] < 0.3
    assert ends[1][0] > 3.0
    assert ends[0][1] > 0.0, "after its stop it goes on"


@pytest.mark.req("C-024")
def test_red_stops_only_channels_that_read_lights():
    lanes = (0, 40, 9)
    for settings, stops in ((LAV, True), (TFUSE, False)):
        channel, route = town_channel(settings, lanes)
        line = next(x for x in route.lines if x.kind is SignalKind.LIGHT)
        s, v = line.s - 60.0, 12.0
        for k in range(100):
            channel.update(
                view(0.1 * k, pose_at(route, s, v), lights={line.signal: LightState.RED})
            )
            v = max(v + 0.1 * channel.a_planned, 0.0)
            s += 0.1 * v
        assert (s + 1.9 < line.s) == stops


@pytest.mark.req("C-9", "C-024")
@pytest.mark.parametrize(
    ("kind", "lanes"), [(SignalKind.STOP, (18, 71, 30)), (SignalKind.LIGHT, (0, 40, 9))]
)
def test_who_does_not_obey_a_line_abstains_from_where_another_can_stop_to_the_line(kind, lanes):
    for settings, abstains in ((LAV, False), (TFUSE, True)):
        channel, route = town_channel(settings, lanes)
        line = next(x for x in route.lines if x.kind is kind)
        for before, inside in ((60.0, False), (22.0, True), (2.0, True), (-8.0, False)):
            if line.s - before < 1.0:
                continue
            channel.reset()
            channel.at = int(line.s - before)
            channel.update(view(0.0, pose_at(route, line.s - before, 8.0)))
            assert channel.abstains is (abstains and inside), (kind, before)


@pytest.mark.req("C-026")
def test_keeps_clear_of_a_leader_and_of_who_crosses():
    channel, route = town_channel(LAV)
    s, v = 20.0, 10.0
    for k in range(100):
        gap = 75.0 - s
        channel.update(view(0.1 * k, pose_at(route, s, v), [(gap, 0.0, 0.0, 4.5, 1.9)]))
        v = max(v + 0.1 * channel.a_planned, 0.0)
        s += 0.1 * v
    assert s < 75.0 - 0.5 * (4.5 + CAR.length)
    assert v < 1.0
    person, route = town_channel(LAV)
    for k in range(12):
        y = -6.0 + 0.14 * k
        ahead = 10.0 + 0.8 * k
        row = [(45.0 - ahead, y, 1.57, 0.5, 0.6)]
        person.update(
            view(0.1 * k, pose_at(route, ahead, 8.0), row, label=SemanticClass.PEDESTRIAN)
        )
    assert person.a_planned < -0.5


@pytest.mark.req("C-093", "C-096")
class TestArbiter:
    def arbiter(self, preferred="a"):
        return Arbiter(("a", "b"), preferred)

    def run(self, arbiter, rows, frames=(1, 1)):
        """rows: (t, score a, score b)."""
        alive = [object() if f else None for f in frames]
        return [arbiter.update(t, alive, (a, b), (5.0, 9.0)) for t, a, b in rows]

    def test_preferred_while_safe_and_back_after_the_dwell(self):
        arbiter = self.arbiter()
        rows = [(0.1 * k, 0.9, 0.9) for k in range(5)]
        rows += [(0.1 * k, 0.5, 0.9) for k in range(5, 20)]
        rows += [(0.1 * k, 0.9, 0.9) for k in range(20, 40)]
        chosen = [c.driving for c in self.run(arbiter, rows)]
        assert chosen[:10] == [0] * 10, "dwell 1 s after the start"
        assert chosen[10:25] == [1] * 15, "wanted again at 2.0 s, for half a second"
        assert chosen[25:] == [0] * 15

    def test_a_moment_below_the_limit_relieves_nobody(self):
        rows = [(0.1 * k, 0.5 if k % 10 > 5 else 0.9, 0.9) for k in range(60)]
        assert {c.driving for c in self.run(self.arbiter(), rows)} == {0}

    def test_a_driver_below_the_lower_limit_is_relieved_without_waiting(self):
        rows = [(0.1 * k, 0.9, 0.9) for k in range(15)] + [(1.5, 0.1, 0.9)]
        assert self.run(self.arbiter(), rows)[-1].driving == 1

    def test_when_none_is_safe_a_little_safer_is_not_worth_a_change(self):
        rows = [(0.1 * k, 0.5, 0.55 if k < 30 else 0.65) for k in range(60)]
        chosen = [c.driving for c in self.run(self.arbiter(), [(0.0, 0.9, 0.9), *rows[1:]])]
        assert chosen[:30] == [0] * 30
        assert chosen[-1] == 1

    def test_a_driver_that_cannot_see_the_light_is_relieved_at_once_and_comes_back(self):
        arbiter = self.arbiter()
        alive, scores, progress = [object(), object()], (0.9, 0.5), (9.0, 5.0)

        def chosen(since, until, abstaining):
            times = [0.1 * k for k in range(since, until)]
            return [arbiter.update(t, alive, scores, progress, abstaining) for t in times]

        assert {c.driving for c in chosen(0, 3, ())} == {0}
        relieved = chosen(3, 30, (0,))  # within the dwell, and although the other is less safe
        assert {c.driving for c in relieved} == {1}
        assert relieved[0].reason is Reason.LIGHTS
        assert chosen(30, 60, ())[-1].driving == 0
        assert {c.driving for c in chosen(60, 70, (0, 1))} == {0}, "all abstain: as ever"

    def test_a_channel_that_abstains_drives_where_no_other_is_alive(self):
        arbiter = self.arbiter()
        choices = [
            arbiter.update(0.1 * k, [object(), None], (0.9, np.nan), (9.0, 0.0), (0,))
            for k in range(10)
        ]
        assert choices[-1].driving == 0

    def test_without_preference_the_most_progressing(self):
        assert self.run(self.arbiter(None), [(0.0, 0.9, 0.85)])[0].driving == 1

    def test_highest_score_when_none_is_safe(self):
        choice = self.run(self.arbiter(), [(0.0, 0.3, 0.7)])[0]
        assert (choice.driving, choice.reason) == (1, Reason.START)

    def test_minimal_risk_stop_at_once_and_back(self):
        arbiter = self.arbiter()
        choices = self.run(
            arbiter, [(0.0, 0.9, 0.9), (0.1, 0.1, 0.15), (0.2, 0.9, 0.9), (1.2, 0.9, 0.9)]
        )
        assert [c.driving for c in choices] == [0, None, None, 0]
        assert choices[1].reason is Reason.MINIMAL_RISK

    def test_silence_of_three_cycles_is_death(self):
        arbiter = self.arbiter()
        self.run(arbiter, [(0.0, 0.9, 0.9)])
        quiet = [self.run(arbiter, [(t, np.nan, 0.9)], (0, 1))[0] for t in (0.1, 0.2, 0.3)]
        assert [c.driving for c in quiet] == [0, 0, 1]
        assert quiet[-1].reason is Reason.FAILOVER
        silent = [self.run(arbiter, [(t, np.nan, np.nan)], (0, 0))[0] for t in (0.4, 0.5, 0.6)]
        assert silent[-1].reason is Reason.ALL_SILENT
        assert silent[-1].driving is None
