"""The recovery supervisor, row by row: phases, times, places, wrong-way and standstill."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.setup import DT
from skidpad.core.states import (
    ActorStates,
    ActorTable,
    ContactEvent,
    StackReport,
    VehicleCommand,
    WorldTruth,
)
from skidpad.core.vocabulary import LightState, RelocationReason, Supervision, Tier
from skidpad.roads.bundled import load_map
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation import clear_place, recovery
from skidpad.simulation.recovery import (
    Action,
    Clearance,
    RecoverySettings,
    Supervisor,
)
from support.stadium import WIDTH, stadium

MAP = load_map("figure8")
assert MAP.ego_start is not None
START = MAP.ahead(MAP.place(MAP.ego_start), 300.0)
assert START is not None
DRIVING = VehicleCommand(throttle=0.3)
HIT = ContactEvent(0, -1, "guardrail", 1000.0, 5.0, 0.0, 0.0)


def truth(
    ego: Pose, others: Sequence[Pose] = (), *, v: float = 5.0, contact: bool = False
) -> WorldTruth:
    """A world with the ego and other cars of its size."""
    n = 1 + len(others)
    states = ActorStates.empty(n)
    for i, pose in enumerate([ego, *others]):
        states.x[i], states.y[i], states.z[i], states.yaw[i] = pose.x, pose.y, pose.z, pose.yaw
        states.present[i] = True
    states.vx[0], states.vy[0] = v * cos(ego.yaw), v * sin(ego.yaw)
    table = ActorTable(
        names=tuple(f"a{i}" for i in range(n)),
        types=("hatchback",) * n,
        kind=np.zeros(n, dtype=np.uint8),
        length=np.full(n, 4.0),
        width=np.full(n, 1.8),
        height=np.full(n, 1.5),
        rgb=np.zeros((n, 3), dtype=np.uint8),
    )
    contacts = (HIT,) if contact else ()
    return WorldTruth(0, table, states, np.ones((n, 4)), np.zeros((n, 5)), {}, contacts, ())


def supervisor(**settings: object) -> Supervisor:
    return Supervisor(MAP, RecoverySettings(**settings), DT)  # type: ignore[arg-type]


def play(
    s: Supervisor, ticks: int, ego: Pose, others: Sequence[Pose] = (), **world: object
) -> list[tuple[Supervision, Action]]:
    """Phases and actions over some ticks; a contact happens in the first only."""
    rows = []
    contact = bool(world.pop("contact", False))
    for k in range(ticks):
        phase = s.observe(truth(ego, others, contact=contact and k == 0, **world))  # type: ignore[arg-type]
        rows.append((phase, s.act(DRIVING)))
    return rows


def beside(forward: float, left: float = 0.0, place: LanePoint = START) -> Pose:
    return place.pose.moved(forward, left)


@pytest.mark.req("A-179", "A-180", "A-181", "A-182", "A-183", "A-186", "A-187", "A-193")
def test_a_contact_runs_through_all_phases_with_their_times() -> None:
    s = supervisor()
    rows = play(s, 65, beside(0.0, 1.0), contact=True)
    phases = [phase for phase, _ in rows]
    count = {p: phases.count(p) for p in Supervision}
    assert count[Supervision.BRAKE] == round(0.5 / DT)
    assert count[Supervision.REVERSE] == round(2.0 / DT)
    assert count[Supervision.REALIGN] == 1
    assert count[Supervision.WARM_UP] == round(0.5 / DT)
    assert phases[-1] is Supervision.NONE
    assert phases == sorted(phases[:-4]) + phases[-4:], "the order is that of the enum"
    assert (s.recoveries, s.contacts_seen) == (1, 1)
    actions = dict(rows)
    brake, reverse = actions[Supervision.BRAKE].command, actions[Supervision.REVERSE].command
    assert (brake.throttle, brake.brake, brake.handbrake, brake.steer) == (0.0, 1.0, True, 0.0)
    assert (reverse.throttle, reverse.brake, reverse.reverse) == (0.4, 0.0, True)
    placed = actions[Supervision.REALIGN].relocate
    assert placed is not None
    assert placed.v == 0.0
    assert (placed.pose.x, placed.pose.y) == pytest.approx((START.x, START.y), abs=1e-3)
    assert placed.pose.z == pytest.approx(START.z + 0.5)
    assert placed.pose.yaw == pytest.approx(START.heading, abs=1e-3)
    released = actions[Supervision.WARM_UP].relocate
    assert released is not None
    assert (released.v, released.moved) == (5.5, None)
    assert actions[Supervision.NONE].command == DRIVING


# -0.5 times the cross product of a unit vector along the ego and the vector to the lane in m, by hand:
# along the lane it is the lateral distance; turned by 60 deg against the lane, half of that.
@pytest.mark.req("A-182")
@pytest.mark.parametrize(
    ("left", "turn_deg", "steer"),
    [
        (0.05, 0.0, 0.025),
        (0.2, 0.0, 0.1),
        (0.5, 0.0, 0.25),
        (-0.5, 0.0, -0.25),
        (0.5, 60.0, 0.125),
        (0.5, -60.0, 0.125),
        (0.62, 0.0, 0.3),
        (-1.5, 0.0, -0.3),
        (0.0, 30.0, 0.0),
    ],
)
def test_reversing_steers_by_the_printed_formula(
    left: float, turn_deg: float, steer: float
) -> None:
    s = supervisor()
    turned = replace(beside(0.0, left), yaw=START.heading + turn_deg * pi / 180.0)
    action = play(s, 20, turned, contact=True)[-1][1]
    assert action.command.steer == pytest.approx(steer, abs=2e-3)


@pytest.mark.req("A-184", "A-194")
@pytest.mark.parametrize(
    ("others", "shift"),
    [
        ([], 0.0),
        ([(10.0, 0.0)], 8.0),
        ([(10.0, 2.6)], 0.0),
        ([(10.0, -2.4)], 8.0),
        ([(15.1, 0.0)], 0.0),
        ([(14.9, 0.0)], 8.0),
        ([(10.0, 0.0), (-1.0, 0.0)], 24.0),
        ([(-6.0, 0.0)], 0.0),
    ],
)
def test_the_ego_is_put_behind_whatever_stands_ahead(
    others: list[tuple[float, float]], shift: float
) -> None:
    s = supervisor()
    rows = play(s, 51, beside(0.0), [beside(f, l) for f, l in others], contact=True)
    placed = rows[-1][1].relocate
    assert placed is not None
    assert placed.moved is not None
    assert placed.moved.shift == shift
    assert placed.moved.clear
    assert placed.moved.reason is RelocationReason.COLLISION
    back = (START.x - placed.pose.x, START.y - placed.pose.y)
    assert np.hypot(*back) == pytest.approx(shift, abs=0.1)


@pytest.mark.req("A-184")
def test_the_search_ends_after_four_shifts_and_says_so() -> None:
    queue = [beside(-8.0 * k + 6.0) for k in range(6)]
    action = play(supervisor(), 51, beside(0.0), queue, contact=True)[-1][1]
    assert action.relocate is not None
    assert action.relocate.moved is not None
    assert (action.relocate.moved.shift, action.relocate.moved.clear) == (32.0, False)
    assert "no free place" in action.notice


@pytest.mark.req("A-184")
def test_the_listing_lets_the_ego_obstruct_itself() -> None:
    # With a car 10 m ahead the first shift is right; the ego, then 8 m ahead, forces the second.
    action = play(
        supervisor(clearance=Clearance.LISTING), 51, beside(0.0), [beside(10.0)], contact=True
    )[-1][1]
    assert action.relocate is not None
    assert action.relocate.moved is not None
    assert action.relocate.moved.shift == 16.0


@pytest.mark.req("M-12")
@pytest.mark.parametrize(("height", "shift"), [(3.9, 8.0), (4.1, 0.0), (-4.1, 0.0), (8.0, 0.0)])
def test_a_car_on_the_bridge_obstructs_nobody(height: float, shift: float) -> None:
    above = replace(beside(10.0), z=START.z + height)
    action = play(supervisor(), 51, beside(0.0), [above], contact=True)[-1][1]
    assert action.relocate is not None
    assert action.relocate.moved is not None
    assert action.relocate.moved.shift == shift


@pytest.mark.req("A-185", "A-189")
def test_contacts_in_the_cool_down_start_nothing() -> None:
    s = supervisor()
    play(s, 51, beside(0.0), contact=True)
    quiet = round(3.0 / DT)
    for _ in range(quiet - 1):
        phase = s.observe(truth(beside(0.0), contact=True))
        assert phase in (Supervision.WARM_UP, Supervision.NONE)
        s.act(DRIVING)
    play(s, 2, beside(0.0))
    assert s.observe(truth(beside(0.0), contact=True)) is Supervision.BRAKE
    assert s.recoveries == 2


@pytest.mark.req("A-192")
def test_without_a_lane_the_ego_waits_braked_and_tries_again() -> None:
    s = supervisor()
    play(s, 50, beside(0.0), contact=True)
    nowhere = Pose(1.0e5, 1.0e5)
    for phase, action in play(s, 5, nowhere):
        assert phase is Supervision.REALIGN
        assert action.relocate is None
        assert action.command.brake == 1.0
        assert "retried" in action.notice
    assert play(s, 1, beside(0.0))[0][1].relocate is not None


@pytest.mark.req("A-196", "A-198", "A-199")
@pytest.mark.parametrize(
    ("turn", "corrected"),
    [(0.0, False), (119.0, False), (121.0, True), (-121.0, True), (180.0, True)],
)
def test_more_than_120_degrees_is_wrong_way(turn: float, corrected: bool) -> None:
    pose = replace(beside(0.0), yaw=START.heading + turn * pi / 180.0)
    phase, action = play(supervisor(), 1, pose)[0]
    assert (phase is Supervision.REALIGN) == corrected
    assert (action.relocate is not None) == corrected
    if action.relocate is not None:
        assert action.relocate.moved is not None
        assert action.relocate.moved.reason is RelocationReason.WRONG_WAY


@pytest.mark.req("A-196")
def test_where_lanes_cross_no_way_through_is_the_wrong_one() -> None:
    """Seen in town: straight on through a junction, nearest to a lane that crosses."""
    pose = Pose(-198.25001454484334, 0.6816554613788428, yaw=1.5708)
    phase, action = play(Supervisor(load_map("town"), RecoverySettings(), DT), 1, pose)[0]
    assert (phase, action.relocate) == (Supervision.NONE, None)


@pytest.mark.req("A-197")
def test_far_from_any_lane_nothing_is_wrong_way() -> None:
    phase, action = play(supervisor(), 1, Pose(1.0e5, 0.0, yaw=3.0))[0]
    assert phase is Supervision.NONE
    assert action.command == DRIVING


@pytest.mark.parametrize("lane", [True, False])
def test_an_ego_that_rolled_over_is_put_back_on_a_lane(lane: bool) -> None:
    s = supervisor()
    play(s, 1, beside(0.0))
    pose = beside(0.0, 1.0 if lane else 4000.0)
    phase, action = s.observe(replace(truth(pose), rolled=(0,))), s.act(DRIVING)
    assert phase is Supervision.REALIGN
    assert action.relocate is not None
    assert action.relocate.moved is not None
    assert action.relocate.moved.reason is RelocationReason.ROLL_OVER
    assert not reasons(play(s, 60, beside(0.0)))


def test_another_vehicle_that_rolled_over_moves_no_ego() -> None:
    s = supervisor()
    s.observe(replace(truth(beside(0.0), [beside(30.0)]), rolled=(1,)))
    assert s.act(DRIVING).relocate is None


TOWN = RoadMap(bake(stadium("sidewalk").encode(), "elsewhere"))
ON_STREET = Pose(150.0, -0.5 * WIDTH)


def street(**settings: object) -> Supervisor:
    """The supervisor of a town without barriers, which has seen the ego on its street."""
    s = Supervisor(TOWN, RecoverySettings(**settings), DT)  # type: ignore[arg-type]
    play(s, 1, ON_STREET)
    return s


def reasons(rows: Sequence[tuple[Supervision, Action]]) -> dict[int, RelocationReason]:
    """Why the ego was moved, by the row."""
    placed = {k: a.relocate.moved for k, (_, a) in enumerate(rows) if a.relocate}
    return {k: moved.reason for k, moved in placed.items() if moved is not None}


@pytest.mark.req("R-6")
def test_a_second_on_the_pavement_with_all_wheels_is_a_departure() -> None:
    beside_it = Pose(150.0, -WIDTH - 1.2)  # wheels at 0.756 m from the middle: 0.44 m off
    rows = play(street(), 40, beside_it)
    k, reason = next(iter(reasons(rows).items()))
    assert (k + 1, reason) == (round(1.0 / DT), RelocationReason.OFF_ROAD)
    assert [p for p, _ in rows[: k + 1]] == [Supervision.NONE] * k + [Supervision.REALIGN]
    placed = rows[k][1].relocate
    assert placed is not None
    assert (placed.pose.x, placed.pose.y) == pytest.approx((150.0, -0.5 * WIDTH), abs=1e-3)
    assert rows[k + 1][0] is Supervision.WARM_UP


@pytest.mark.req("R-6")
def test_with_a_wheel_on_the_road_or_back_in_time_nobody_is_moved() -> None:
    one_wheel = Pose(150.0, -WIDTH - 0.7)
    assert not reasons(play(street(), 100, one_wheel))
    s = street()
    for _ in range(5):
        assert not reasons(play(s, round(1.0 / DT) - 1, Pose(150.0, -WIDTH - 1.2)))
        assert not reasons(play(s, 1, ON_STREET))


@pytest.mark.req("R-6")
@pytest.mark.parametrize(("beyond", "at_once"), [(2.9, False), (3.1, True)])
def test_more_than_three_metres_beyond_the_edge_is_a_departure_at_once(
    beyond: float, at_once: bool
) -> None:
    rows = play(street(), 1, Pose(150.0, -WIDTH - beyond))
    assert bool(reasons(rows)) is at_once


@pytest.mark.req("R-6")
def test_who_flew_out_of_reach_is_put_where_the_road_was_left() -> None:
    rows = play(street(), 1, Pose(150.0, -80.0))
    placed = rows[0][1].relocate
    assert placed is not None
    assert (placed.pose.x, placed.pose.y) == pytest.approx((150.0, -0.5 * WIDTH), abs=1e-3)


@pytest.mark.req("R-6")
def test_where_the_map_ends_nobody_has_left_the_road() -> None:
    cut = RoadMap(bake(stadium(closed=False).encode(), "cut"))
    s = Supervisor(cut, RecoverySettings(), DT)
    play(s, 1, ON_STREET)
    play(s, 1, Pose(299.0, -0.5 * WIDTH))
    rows = play(s, 1, Pose(305.5, -0.5 * WIDTH))
    assert list(reasons(rows).values()) == [RelocationReason.ROAD_END]
    placed = rows[0][1].relocate
    assert placed is not None
    assert placed.pose.x == pytest.approx(ON_STREET.x, abs=1e-3)
    assert "map ends" in rows[0][1].notice


@pytest.mark.req("A-200", "A-188")
def test_ten_seconds_near_standstill_and_the_ego_is_moved() -> None:
    s = supervisor()
    ticks = round(10.0 / DT)
    rows = play(s, ticks, beside(0.0), v=0.2)
    assert all(a.relocate is None for _, a in rows[:-1])
    moved = rows[-1][1].relocate
    assert moved is not None
    assert moved.moved is not None
    assert moved.moved.reason is RelocationReason.STUCK
    # Grace: the timer begins anew only 8 s after the relocation.
    again = play(s, round(18.0 / DT) + 20, beside(0.0), v=0.0)
    when = [k for k, (_, a) in enumerate(again) if a.relocate and a.relocate.moved]
    assert when == [pytest.approx(round(18.0 / DT), abs=2)]


@pytest.mark.req("A-200")
@pytest.mark.parametrize(("kmh", "moved"), [(0.99, True), (1.01, False)])
def test_near_standstill_is_below_1_km_per_h(kmh: float, moved: bool) -> None:
    rows = play(supervisor(), round(12.0 / DT), beside(0.0), v=kmh / 3.6)
    assert any(a.relocate is not None for _, a in rows) is moved


@pytest.mark.req("A-200")
@pytest.mark.parametrize(
    ("tier", "moved"),
    [(Tier.HOLDING_AT_LINE, False), (Tier.STOPPED_BEHIND_CAR, False), (Tier.CRUISE, True)],
)
def test_who_holds_for_a_reason_is_not_stuck(tier: Tier, moved: bool) -> None:
    s = supervisor()
    seen = []
    for _ in range(round(11.0 / DT)):
        s.observe(truth(beside(0.0), v=0.0))
        seen.append(s.act(DRIVING, StackReport(tier=tier)).relocate)
    assert any(seen) == moved


def is_moved(ego: Pose, others: Sequence[Pose] = ()) -> bool:
    """Whether an ego that stands there for 11 s is put elsewhere."""
    rows = play(supervisor(), round(11.0 / DT), ego, others, v=0.0)
    return any(a.relocate is not None for _, a in rows)


@pytest.mark.req("A-200", "M-12")
@pytest.mark.parametrize(
    ("other", "moved"),
    [((8.0, 0.0, 0.0), False), ((14.9, 0.0, 0.0), False), ((15.1, 0.0, 0.0), True),
     ((8.0, 2.4, 0.0), False), ((8.0, -2.6, 0.0), True),
     ((8.0, 0.0, 3.9), False), ((8.0, 0.0, 4.1), True)],
)  # fmt: skip
def test_standing_behind_a_car_is_no_reason_to_be_moved(
    other: tuple[float, float, float], moved: bool
) -> None:
    forward, left, height = other
    pose = beside(forward, left)
    assert is_moved(beside(0.0), [replace(pose, z=START.z + height)]) == moved


@pytest.mark.req("A-200")
@pytest.mark.parametrize(
    ("before", "state", "stuck"),
    [
        (5.0, LightState.RED, False),
        (5.0, LightState.YELLOW, False),
        (5.0, LightState.GREEN, True),
        (29.0, LightState.RED, False),
        (31.0, LightState.RED, True),
    ],
)
def test_standing_at_a_red_light_is_no_reason_to_be_moved(
    before: float, state: LightState, stuck: bool
) -> None:
    row = int(np.flatnonzero((MAP.signals.kind == 0) & (MAP.signals.s > 40.0))[0])
    line = MAP.at(int(MAP.signals.lane[row]), float(MAP.signals.s[row]) - before)
    s = supervisor()
    seen = []
    for _ in range(round(11.0 / DT)):
        world = replace(truth(line.pose, v=0.0), lights={int(MAP.signals.id[row]): state})
        s.observe(world)
        seen.append(s.act(DRIVING).relocate)
    assert any(seen) == stuck


@pytest.mark.req("A-186", "A-187")
def test_as_listed_the_ego_starts_from_rest_after_a_longer_warm_up() -> None:
    s = supervisor(warm_up=1.5, release_speed=0.0)
    rows = play(s, 90, beside(0.0), contact=True)
    assert [p for p, _ in rows].count(Supervision.WARM_UP) == round(1.5 / DT)
    speeds = [a.relocate.v for _, a in rows if a.relocate is not None]
    assert speeds == [0.0, 0.0]


def test_settings_out_of_range_name_the_field() -> None:
    with pytest.raises(ConfigError, match=r"recovery\.warm_up"):
        RecoverySettings(warm_up=-1.0)


# Constants of recovery and of its clear place, each with the test that notices 10 % more and less (M-14).
GUARDED = {
    "REVERSE_STEER_GAIN": test_reversing_steers_by_the_printed_formula,
    "REVERSE_STEER_MAX": test_reversing_steers_by_the_printed_formula,
    "WRONG_WAY_DOT": test_more_than_120_degrees_is_wrong_way,
    "CLEAR_AHEAD": test_the_ego_is_put_behind_whatever_stands_ahead,
    "CLEAR_ASIDE": test_the_ego_is_put_behind_whatever_stands_ahead,
    "SHIFT_BACK": test_the_ego_is_put_behind_whatever_stands_ahead,
    "LEVEL": test_a_car_on_the_bridge_obstructs_nobody,
    "LIGHT_REACH": test_standing_at_a_red_light_is_no_reason_to_be_moved,
}


@pytest.mark.req("M-14")
@pytest.mark.parametrize("factor", [0.9, 1.1])
@pytest.mark.parametrize("name", GUARDED)
def test_a_changed_constant_is_noticed(
    name: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    test: Any = GUARDED[name]
    (mark,) = (m for m in test.pytestmark if m.name == "parametrize")
    module = recovery if hasattr(recovery, name) else clear_place
    monkeypatch.setattr(module, name, factor * getattr(module, name))
    noticed = 0
    for row in mark.args[1]:
        try:
            test(*row)
        except AssertionError:
            noticed += 1
    assert noticed


def test_without_a_clearance_test_the_nearest_place_is_taken() -> None:
    s = supervisor(clearance=Clearance.NONE)
    rows = play(s, 53, beside(0.0), [beside(10.0)], contact=True)
    moved = next(a.relocate.moved for _, a in rows if a.relocate is not None)
    assert moved is not None
    assert (moved.shift, moved.clear) == (0.0, False)


@pytest.mark.req("A-188")
@pytest.mark.parametrize("grace", [8.0, 0.0])
def test_the_grace_puts_the_stuck_detector_off(grace: float) -> None:
    s = supervisor(grace=grace)
    play(s, 65, beside(0.0), contact=True)
    rows = play(s, 400, beside(0.0), v=0.0)
    stuck = next(k for k, (phase, _) in enumerate(rows, 65) if phase is Supervision.WARM_UP)
    after = stuck * DT - 2.55  # since it was put back
    assert after == pytest.approx(10.0 + max(grace, 0.5), abs=0.25)
