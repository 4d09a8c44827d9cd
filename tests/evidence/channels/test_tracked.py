"""The profile `tracked`: safe distances against stopping simulated, filters, votes, positions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skidpad.core.channels import Cycle
from skidpad.core.errors import ConfigError
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Profile
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.judging.truth.simulator import least_gap
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings, drive_events
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.grip import OwnGrip, planned_acceleration
from skidpad.evidence.channels.tracked.tracks import Lookout, Tracks
from skidpad.evidence.channels.tracked.vote import CHI2_LIMIT, Tracked, parting
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive, frame
from support.examples import examples

TAILGATED, TAILGATING = HazardType.EGO_TAILGATED, HazardType.EGO_TAILGATING
LOCALISATION, UNSEEN = HazardType.INCONSISTENT_LOCALISATION, HazardType.UNSEEN_BY_A_CHANNEL
EGO = (0.0, 0.0, 0.0, 15.0, 0.0)


@given(
    v_follower=st.floats(0.5, 45.0),
    v_leader=st.floats(0.0, 45.0),
    grip=st.sampled_from([0.9, 0.5, 0.15]),
)
@settings(max_examples=examples(300), derandomize=True)
def test_the_safe_distance_is_the_least_that_stopping_step_by_step_needs(
    v_follower, v_leader, grip
):
    need = SafeDistance.on(grip).of(v_follower, v_leader)
    assert need >= 0.0
    assert least_gap(need + 0.05, v_leader, grip, v_follower, grip) > 0.0
    if need > 0.3:  # it looks at 200 moments, of which one may be 0.3 m too early on ice
        assert least_gap(need - 0.3, v_leader, grip, v_follower, grip) <= 0.0


def test_without_a_word_the_road_is_dry():
    assert SafeDistance.on(0.9) == SafeDistance()


def test_the_published_case_follows_the_published_formula():
    rss = SafeDistance(response=1.0, a_response=3.5, b_follower=4.0, b_leader=8.0)
    expected = 20.0 + 1.75 + 23.5**2 / 8.0 - 20.0**2 / 16.0  # v rho + a rho^2/2 + ...
    assert rss.of(20.0, 20.0) == pytest.approx(expected)
    assert rss.of(5.0, 40.0) == 0.0


def test_a_track_finds_gap_and_speed_through_noise():
    rng = np.random.default_rng(2)
    lookout, tracks, misses = Lookout(), Tracks(SafeDistance()), []
    for k in range(100):
        t = 0.1 * k
        x = -30.0 + 1.0 * t  # closes at 1 m/s
        row = (15 * t + x + rng.normal(0, 0.4), rng.normal(0, 0.2), 0.0, 16 + rng.normal(0, 0.5), 0)
        tracks.update(t, lookout.see(frame(t, (15 * t, 0, 0, 15.0, 0), [row], ids=[4])))
        (track,) = tracks
        misses.append((track.gap - (-x - 4.5), track.v - 16.0))
    late = np.array(misses[30:])
    assert track.behind
    assert (np.abs(late.mean(axis=0)) < 0.2).all()
    assert late[:, 0].std() < 0.3


SHARP = (Eyes("a"), Eyes("b"))


def found(objects, eyes=SHARP, duration=6.0, ego=EGO, grip=0.9):
    world = World(ego, np.array(objects, dtype=float).reshape(-1, 5))
    told = MonitorSettings(profile=Profile.TRACKED, keep_worlds=False, grip=grip)
    monitor = Monitor([e.name for e in eyes], told)
    for cycle in cycles(drive(world, eyes, duration)):
        monitor.update(cycle)
    return {e.key: e for e in drive_events(monitor)[0]}


def test_who_is_told_of_ice_asks_for_more_room():
    behind = [(-14.0, 0, 0, 15.0, 0)]  # 9.5 m: more than 9 m when dry, less than 15 m on ice
    assert not found(behind)
    assert set(found(behind, grip=0.3)) == {TAILGATED}
    with pytest.raises(ConfigError, match="grip is a setting of the rules `tracked`"):
        MonitorSettings(profile=Profile.PRACTICAL, grip=0.2)
    with pytest.raises(ConfigError, match=r"grip must be between 0.05 and 1.5, got 3"):
        MonitorSettings(profile=Profile.TRACKED, grip=3.0)


@pytest.mark.req("C-120", "C-122", "C-123")
@pytest.mark.parametrize(
    ("objects", "expected"),
    [
        ([(-11.0, 0, 0, 15.0, 0)], {TAILGATED}),  # 6.5 m; 9.0 m are safe at 54 km/h
        ([(-16.0, 0, 0, 15.0, 0)], set()),  # 11.5 m
        ([(11.0, 0, 0, 15.0, 0)], {TAILGATING}),
        ([(16.0, 0, 0, 15.0, 0)], set()),
        ([(11.0, 0, 0, 22.0, 0)], set()),  # it draws away
        ([(-11.0, 3.5, 0, 15.0, 0), (11.0, -3.5, 0, 15.0, 0)], set()),  # other lanes
        ([(40.0, 0, np.pi, -15.0, 0)], set()),  # oncoming
        ([(20.0, -20.0, np.pi / 2, 0, 10.0)], set()),  # crossing
    ],
)
def test_who_is_too_near_on_the_same_way_is_found(objects, expected):
    events = found(objects)
    assert set(events) == expected
    assert all(e.t_start <= 1.5 for e in events.values())  # confirmed, and smoothed over 1 s


@pytest.mark.req("C-122", "C-123")
def test_a_channel_that_does_not_see_it_is_a_hazard_of_its_own():
    follower = [(-11.0, 0, 0, 15.0, 0)]
    blind = (Eyes("a", 0.1), Eyes("b", 0.1, blind=(0,)))
    assert set(found(follower, blind)) == {TAILGATED, UNSEEN}
    assert set(found(follower, (Eyes("a", 0.1), Eyes("b", 0.1)))) == {TAILGATED}


def cycle_frames(tracked, rows, count, ids=(1,)):
    """Feed `count` cycles in which channel i reports its object at rows[i]; None: nothing."""
    for k in range(count):
        t = 0.1 * k
        frames = [
            frame(t, EGO, [] if row is None else [row], ids=[] if row is None else list(ids))
            for row in rows
        ]
        signals = tracked.update(t, frames)
    return signals


@pytest.mark.req("C-023")
def test_the_channels_vote():
    near, far = (-11.0, 0, 0, 15.0, 0), (-14.5, 0, 0, 15.0, 0)
    assert cycle_frames(Tracked("abc"), [near, far, far], 20)[Signal.REAR_DEFICIT] == 0.0
    assert cycle_frames(Tracked("abc"), [near, near, far], 20)[Signal.REAR_DEFICIT] > 0.0
    alone = cycle_frames(Tracked("abc"), [near, None, None], 20)
    assert alone[Signal.REAR_DEFICIT] > 0.0  # who does not see it says nothing about it
    assert alone[Signal.UNSEEN_DEFICIT] > 0.0


def test_a_flicker_is_no_alarm_and_a_hole_does_not_end_one():
    """By hand: of 11 cycles the median counts, so 5 are too few and 6 are enough; 0.5 s late."""
    tracked, flicker, hole = Tracked("ab"), [0.0] * 20, [1.0] * 20
    flicker[10:15] = [1.0] * 5
    hole[12:15] = [0.0] * 3
    side = Signal.REAR_DEFICIT
    assert not any(tracked._smooth(side, 0.1 * k, value) for k, value in enumerate(flicker))
    tracked = Tracked("ab")
    seen = [tracked._smooth(side, 0.1 * k, value) for k, value in enumerate(hole)]
    assert seen == [0.0] * 5 + [1.0] * 15
    each = Tracked("ab", smoothing=0.0)
    assert [each._smooth(side, 0.1 * k, value) for k, value in enumerate(hole)] == hole


def test_it_is_confirmed_for_half_a_second_and_ends_when_the_gap_is_surely_long():
    near = (-11.0, 0, 0, 15.0, 0)
    assert cycle_frames(Tracked("ab"), [near, near], 4)[Signal.REAR_DEFICIT] == 0.0
    tracked, seen = Tracked("ab"), []
    for k in range(160):
        t = 0.1 * k
        row = (-10.0 - 0.4 * t, 0, 0, 14.6, 0)  # it falls back
        f = frame(t, EGO, [row], ids=[1])
        seen.append(tracked.update(t, [f, f])[Signal.REAR_DEFICIT] > 0.0)
    changes = np.flatnonzero(np.diff(np.array(seen, dtype=int)))
    assert len(changes) == 2  # on once, off once: no flicker at the limit


@pytest.mark.req("C-121")
@pytest.mark.parametrize(
    ("offset", "alarms"),
    [((0.0, 0.0), 0), ((0.4, 0.0), 0), ((1.7, 0.0), 1), ((0.0, 2.5), 1), ((2.5, 0.0), 1)],
)
def test_positions_are_inconsistent_beyond_what_their_accuracy_explains(offset, alarms):
    eyes = (Eyes("a", ego_noise=0.1), Eyes("b", ego_noise=0.1, ego_offset={5.0: offset}))
    events = found([], eyes, duration=60.0)
    assert len(events) == alarms
    if alarms:
        assert 5.0 <= events[LOCALISATION].t_start <= 5.6
    assert pytest.approx(27.63, abs=0.01) == CHI2_LIMIT


@pytest.mark.req("C-128")
def test_plans_part_where_their_footprints_share_no_ground():
    straight = frame(0.0, EGO)  # 15 m/s, 4.5 m long: a standing plan is left behind after 0.3 s
    t = np.arange(16) * 0.2
    stops = frame(0.0, EGO, plan=np.column_stack([0 * t, 0 * t, t]))
    left = frame(0.0, EGO, plan=np.column_stack([15 * t, 0.9 * t, t]))
    assert parting(straight, straight) == np.inf
    assert parting(straight, stops) == 0.5
    assert parting(straight, left) == 2.5  # 1.8 m after 2 s, seen at the next half second
    shifted = frame(0.0, (0.0, 5.0, 0.0, 15.0, 0.0))
    assert parting(straight, shifted) == np.inf  # places differ, plans do not


def test_nothing_and_nonsense_are_survived():
    tracked = Tracked("ab")
    nan = frame(0.0, (np.nan,) * 5)
    for k, frames in enumerate([[None, None], [nan, None], [nan, nan], [frame(0.3, EGO), nan]]):
        signals = tracked.update(0.1 * k, frames)
    assert signals[Signal.REAR_DEFICIT] == signals[Signal.FRONT_DEFICIT] == 0.0
    assert np.isnan(signals[Signal.OFFSET_CHI2])
    standing = frame(0.4, (3.0, 1.0, 0.5, 0.0, 0.0))._replace(plan=np.tile([3.0, 1.0, 0.0], (9, 1)))
    for k in range(4, 9):
        tracked.update(0.1 * k, [standing, standing])
    other = Monitor(["a", "b"], MonitorSettings(profile=Profile.PRACTICAL))
    evidence = next(iter(cycles(drive(World(), (Eyes("a"), Eyes("b")), 0.2))))
    values = other.update(evidence).signals.values
    assert np.isnan(values[Signal.REAR_DEFICIT])  # other profiles do not track


def test_a_channel_whose_ego_has_no_outline_says_nothing_of_gaps_and_plans():
    monitor = Monitor(["a", "b"])
    bare = frame(0.0, (3.0, 1.0, 0.5, 0.0, 0.0))._replace(ego_polygon=np.zeros((0, 2)))
    for k in range(12):
        signals = monitor.update(Cycle(k, 0.1 * k, (bare, bare))).signals.values
    assert np.isnan(signals[Signal.PLANS_APART])
    assert not signals[Signal.REAR_DEFICIT] > 0.0


def shown_grip(v, got, asked, cycles=25):
    """What a car shows that changes its speed by `got` m/s^2 where its plans ask for `asked`."""
    own, s = OwnGrip(), np.arange(16) * 0.25
    for k in range(cycles):
        now = v + 0.1 * k * got
        plan = np.column_stack([now * s + 0.5 * asked * s**2, 0 * s, s])
        one = frame(0.1 * k, (0.0, 0.0, 0.0, now, 0.0), plan=plan)
        own.update(0.1 * k, [one, one])
    return own


def test_a_car_that_gets_less_than_it_asks_for_shows_the_grip():
    braking = shown_grip(15.0, -0.85 * 0.12 * G, -5.0)
    assert braking.grip == pytest.approx(0.12)
    driving = shown_grip(2.0, 0.5 * 0.12 * G, 1.5)  # half the weight on the driven axle
    assert driving.grip == pytest.approx(0.12)
    assert shown_grip(15.0, -4.6, -5.0).grip is None  # it gets what it asks for
    assert shown_grip(20.0, 0.3, 1.5).grip is None  # an engine at its end
    assert shown_grip(2.0, 0.5, 1.5, cycles=14).grip is None  # pedals are slow
    assert shown_grip(0.0, 0.0, 1.5).grip is None  # held by its brake


def test_a_car_that_gets_more_than_the_grip_allows_disproves_it():
    own = shown_grip(2.0, 0.5 * 0.12 * G, 1.5)
    for k in range(25, 45):
        s = np.arange(16) * 0.25
        v = 10.0 - 0.1 * (k - 25) * 4.0
        plan = np.column_stack([v * s - 2.0 * s**2, 0 * s, s])
        own.update(0.1 * k, [frame(0.1 * k, (0.0, 0.0, 0.0, v, 0.0), plan=plan)])
    assert own.grip is None


def test_plans_of_two_minds_and_broken_ones_show_nothing():
    own = OwnGrip()
    s = np.arange(16) * 0.25
    for k in range(25):
        v = 2.0 + 0.05 * k
        go = frame(0.1 * k, (0, 0, 0, v, 0), plan=np.column_stack([v * s + s**2, 0 * s, s]))
        stop = go._replace(plan=np.column_stack([v * s - s**2, 0 * s, s]))
        own.update(0.1 * k, [go, stop])
    assert own.grip is None
    assert planned_acceleration(go._replace(plan=go.plan[:3])) is None
    assert planned_acceleration(go._replace(plan=np.zeros((9, 3)))) is None
    own.update(9.0, [None, go._replace(plan=np.full((9, 3), np.nan))])
    own.update(9.1, [None, None])


def test_a_position_that_leaves_its_odometry_is_inconsistent_though_channels_are_near():
    """1.5 m between two channels is within what the chi-square explains; a leap of 1.5 m is not."""
    tracked, leaps = Tracked("ab"), []
    for k in range(40):
        x, jump = 1.5 * k, (1.5 if k >= 20 else 0.0)
        one, two = (frame(0.1 * k, (x, y, 0.0, 15.0, 0.0)) for y in (0.0, jump))
        signals = tracked.update(0.1 * k, [one, two])
        leaps.append(signals[Signal.POSITION_LEAP])
        assert not signals[Signal.OFFSET_CHI2] > CHI2_LIMIT
    np.testing.assert_allclose(leaps[:20], 0.0, atol=1e-9)
    np.testing.assert_allclose(leaps[20:25], 1.5)
    np.testing.assert_allclose(leaps[26:], 0.0, atol=1e-9)
    assert np.isnan(tracked.update(4.0, [None, None])[Signal.POSITION_LEAP])


def test_a_car_that_slides_leaves_its_odometry_and_no_position_is_wrong():
    tracked, alone = Tracked("ab"), Tracked("a")
    for k in range(20):
        slides = frame(0.1 * k, (1.5 * k, 0.4 * k, 0.0, 15.0, 0.0))  # sideways at 4 m/s
        both = tracked.update(0.1 * k, [slides, slides])
        one = alone.update(0.1 * k, [slides])
    assert both[Signal.POSITION_LEAP] == pytest.approx(0.0, abs=1e-9)
    assert one[Signal.POSITION_LEAP] == pytest.approx(2.0)  # a lone channel cannot tell
