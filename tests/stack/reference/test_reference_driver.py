"""The reference driver: it sees late and not everything, stops where it must, and is never wild."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference_driver import (
    DT,
    MEDIAN,
    STOP_LANE,
    STOP_S,
    STOP_SIGN,
    X_MAJOR,
    car,
    drive,
    seat,
)
from skidpad.core.frames import RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorCommand
from skidpad.core.states import EgoEstimate, VehicleCommand
from skidpad.core.traffic.sight import DriverView, RoadLook, SeenActors
from skidpad.core.vocabulary import LightState, Supervision
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.traffic.idm import Character, idm
from skidpad.stack.reference.caution import (
    believed_friction,
    bend_speed,
    manner,
    sight_speed,
    speed_factor,
    too_fast,
)
from skidpad.stack.reference.following import Manner, acceleration, free_acceleration, wanted_gap
from skidpad.stack.reference.junctions import V_THROUGH, travel_time
from skidpad.stack.reference.person import person_of
from support.examples import examples

ROADS = st.sampled_from(list(RoadLook))
SPEEDS = st.floats(0.0, 60.0)
QUEUE = tuple(car(f"q{i}", 600.0 + 7.0 * i) for i in range(3))


def nobody() -> SeenActors:
    empty = np.zeros(0)
    return SeenActors(
        np.zeros(0, np.int64), np.zeros(0, np.uint8), *[empty] * 8, np.zeros(0, np.bool_)
    )


def view_at(pose: Pose, v: float, tick: int = 0, **others) -> DriverView:
    fields = {
        "age": 0.0,
        "actors": nobody(),
        "lights": {},
        "road": RoadLook.DRY,
        "visibility": 300.0,
    }
    return DriverView(tick=tick, pose=pose, speed=v, yaw_rate=0.0, **{**fields, **others})


# --- it gets its view and nothing else


def test_of_a_frame_it_is_handed_the_view_alone():
    class Sealed(dict):
        def __getitem__(self, key):
            assert key == "eyes", f"it read {key}"
            return super().__getitem__(key)

    stack = seat()
    pose = load_map("straight").place(load_map("straight").ego_start).pose
    view = view_at(pose, 20.0)
    sealed = object()
    frame = SensorFrame(
        tick=0, ego=sealed, images=sealed, segments=sealed, radar=sealed, lights=sealed,
        extra=Sealed(eyes=view),
    )  # fmt: skip
    assert stack.tick(frame) == seat().driver.act(view)


def test_what_is_out_of_sight_does_not_change_its_commands():
    """The car behind the lorry drives as it likes: the commands are the same bytes."""

    def cars(v_hidden: float):
        def move(k, truth):
            return [
                ActorCommand("lorry", command=VehicleCommand(throttle=0.3)),
                ActorCommand("hidden", command=VehicleCommand(throttle=v_hidden)),
                ActorCommand("behind", command=VehicleCommand(brake=1.0 - v_hidden)),
            ]

        return move

    actors = (
        car("lorry", 140.0, 15.0, kind="truck"),
        car("hidden", 165.0, 15.0),
        car("behind", 60.0, 15.0),
    )
    a, b = (drive(*actors, v=15.0, seconds=4.0, move=cars(u)) for u in (0.2, 0.6))
    assert a.commands == b.commands
    shown = (replace(actors[0], type="hatchback"), car("hidden", 165.0, 15.0, lane=-3), actors[2])
    assert drive(*shown, v=15.0, seconds=4.0, move=cars(0.2)).commands != a.commands


# --- late


def test_a_leader_that_brakes_is_answered_after_the_reaction_time():
    def onset(reaction: float) -> float:
        def move(k, truth):
            pedal = VehicleCommand(brake=0.5) if k >= 40 else VehicleCommand(throttle=0.25)
            return [ActorCommand("lead", command=pedal)]

        stack = seat(person=replace(MEDIAN, reaction=reaction, headway=1.5))
        log = drive(car("lead", 136.0, 20.0), v=20.0, seconds=6.0, move=move, stack=stack)
        assert not log.contacts
        pressed = [k for k, c in enumerate(log.commands) if k >= 40 and c.brake > 0.1]
        return (pressed[0] - 40) * DT

    fast, slow = onset(0.5), onset(1.5)
    assert fast >= 0.5
    assert slow >= 1.5
    assert slow - fast == pytest.approx(1.0, abs=0.3)


# --- it stops


@pytest.mark.parametrize("weather", ["clear-noon", "clear-night", "rain-noon", "snow", "icy_30"])
def test_it_stops_behind_a_standing_queue_at_the_speed_it_chose(weather):
    log = drive(*QUEUE, v=10.0, seconds=100.0, weather=weather, until=lambda t: t.tick > 200 and
                np.hypot(t.states.vx[0], t.states.vy[0]) < 0.05)  # fmt: skip
    assert log.contacts == 0
    assert log.v[-1] < 0.1
    assert 0.5 < log.gap[-1] < 6.0


def test_it_drives_slower_the_worse_the_road():
    weathers = {"clear-noon": 25, "rain_20": 24, "rain-noon": 19, "snow": 15, "icy_30": 9}
    fastest = [drive(v=v, seconds=40.0, weather=w).v[-1] for w, v in weathers.items()]
    assert fastest == sorted(fastest, reverse=True)
    assert fastest[0] > 25.0
    assert fastest[-1] < 12.0


def test_it_stops_at_red_goes_at_green_and_takes_an_unseen_light_for_red():
    map = load_map("figure8")
    row = int(np.flatnonzero(map.signals.kind == 0)[0])
    lane, s, signal = (
        int(map.signals.lane[row]),
        float(map.signals.s[row]),
        int(map.signals.id[row]),
    )

    def brakes(lights, ticks=1, v=14.0) -> float:
        stack = seat("figure8")
        for k in range(ticks):
            place = map.at(lane, s - 40.0 + v * DT * k)
            command = stack.driver.act(view_at(place.pose, v, tick=k, lights=lights))
        return command.brake

    assert brakes({signal: LightState.RED}) > 0.1
    assert brakes({signal: LightState.GREEN}) == 0.0
    assert brakes({signal: LightState.YELLOW}) > 0.1
    yellow, green = (brakes({signal: s}, v=22.0) for s in (LightState.YELLOW, LightState.GREEN))
    assert yellow == green, "too late to stop in comfort"
    assert brakes({}) > 0.1


# --- laws


@given(v=SPEEDS, gap=st.floats(0.0, 300.0), v_lead=SPEEDS, road=ROADS, wish=st.floats(0.0, 60.0))
def test_acceleration_is_bounded_and_falls_as_the_gap_shrinks(v, gap, v_lead, road, wish):
    m = manner(MEDIAN, road, v)
    a = acceleration(v, wish, gap, v_lead, m)
    assert isfinite(a)
    assert m.a_min <= a <= m.a_max
    assert acceleration(v, wish, 0.5 * gap, v_lead, m) <= a + 1e-12
    assert acceleration(v, wish, gap, v_lead + 1.0, m) >= a - 1e-12


@given(v=st.floats(0.5, 40.0), wish=st.floats(41.0, 80.0))
def test_at_the_wanted_gap_the_speed_is_kept(v, wish):
    m = manner(MEDIAN, RoadLook.DRY, v)
    assert acceleration(v, wish, wanted_gap(v, v, m), v, m) == pytest.approx(0.0, abs=1e-9)


@given(v=st.floats(0.0, 50.0), wish=st.floats(0.1, 50.0), b=st.floats(0.5, 3.0))
def test_alone_it_accelerates_as_the_drivers_of_the_background(v, wish, b):
    m = Manner(1.0, 1.4, b, -8.0)
    theirs = idm(v, wish, np.inf, 0.0, Character(1.0, 1.4, b, -8.0))
    assert free_acceleration(v, wish, m) == pytest.approx(theirs)


@given(road=ROADS, v=SPEEDS, dv=st.floats(0.0, 10.0))
def test_speed_never_raises_the_friction_believed_in_nor_the_speed_chosen(road, v, dv):
    assert believed_friction(road, v + dv) <= believed_friction(road, v)
    assert 0.4 < speed_factor(road, v) <= 1.0


@given(road=ROADS, see=st.floats(15.0, 300.0), more=st.floats(0.0, 100.0), slow=st.floats(0.0, 2.0))
def test_who_sees_farther_or_reacts_faster_drives_no_slower(road, see, more, slow):
    v = sight_speed(road, see, 0.5, 40.0)
    assert sight_speed(road, see + more, 0.5, 40.0) >= v - 0.2
    assert sight_speed(road, see, 0.5 + slow, 40.0) <= v + 0.2


@given(road=ROADS, v=SPEEDS, excess=st.floats(0.0, 30.0))
def test_who_is_too_fast_brakes_the_firmer_the_faster(road, v, excess):
    a = too_fast(excess, road, v)
    assert -4.0 <= a <= 0.0
    assert too_fast(excess + 1.0, road, v) <= a


@given(road=ROADS, bend=st.floats(1e-4, 0.2))
def test_a_tighter_bend_is_driven_slower(road, bend):
    assert bend_speed(road, 1.1 * bend) < bend_speed(road, bend)
    assert bend_speed(road, -bend) == bend_speed(road, bend)


@settings(max_examples=examples(60))
@given(data=st.data())
def test_its_commands_are_never_wild(data):
    """Whatever is seen, from wherever: finite pedals in their ranges, the same from equal views."""
    draw = data.draw
    n = draw(st.integers(0, 4))
    far = st.floats(-400.0, 400.0)

    def column(values):
        return np.array(draw(st.lists(values, min_size=n, max_size=n)), dtype=np.float64)

    actors = SeenActors(
        np.arange(n), np.zeros(n, np.uint8), 300.0 + column(far), column(far), column(st.floats(-5, 5)),
        column(st.floats(-4, 4)), column(st.floats(-50, 50)), column(st.floats(-50, 50)),
        column(st.floats(0.2, 20)), column(st.floats(0.2, 3)), np.zeros(n, np.bool_),
    )  # fmt: skip
    pose = Pose(draw(st.floats(50, 600)), draw(st.floats(-30, 30)), 0.0, yaw=draw(st.floats(-4, 4)))
    view = view_at(pose, draw(st.floats(-5, 60)), age=draw(st.floats(0, 3)), actors=actors,
                   road=draw(ROADS), visibility=draw(st.floats(5, 300)))  # fmt: skip
    command = SEATED.driver.act(view)
    SEATED.driver.reset()
    assert SEATED.driver.act(view) == command
    SEATED.driver.reset()
    assert 0.0 <= command.throttle <= 1.0
    assert 0.0 <= command.brake <= 1.0
    assert -1.0 <= command.steer <= 1.0


SEATED = seat()


def test_equal_drives_give_equal_commands():
    a, b = (drive(*QUEUE, v=20.0, seconds=5.0) for _ in range(2))
    assert a.commands == b.commands


def test_while_the_supervisor_drives_it_holds_and_then_starts_afresh():
    stack = seat()
    pose = load_map("straight").place(load_map("straight").ego_start).pose
    frame = SensorFrame(
        tick=0, ego=EgoEstimate(pose, 0, 0, 0, 0, (0, 0, 0, 0), 1), images={}, segments={},
        radar=RadarPoints.none(), lights={}, supervision=Supervision.WARM_UP,
    )  # fmt: skip
    stack.driver.stopping = 3
    assert stack.tick(frame).brake == 1.0
    view = view_at(pose, 0.0)
    after = replace(frame, supervision=Supervision.NONE, extra={"eyes": view})
    assert stack.tick(after).throttle > 0.0
    assert stack.driver.stopping is None


def test_a_seed_is_a_person_and_a_careful_one():
    people = [person_of(seed) for seed in range(300)]
    assert people == [person_of(seed) for seed in range(300)]
    assert len(set(people)) == 300
    assert all(p.headway >= p.reaction for p in people)
    assert all(p.speed <= 1.0 for p in people)
    assert np.median([p.reaction for p in people]) == pytest.approx(0.9, abs=0.1)


# --- giving way


def at_the_stop_sign(*others: tuple[float, float], v: float = 0.0, halted: bool = True):
    """The command 2 m before town's stop line; others: (m before the junction, m/s) on the ring."""
    stack, map = seat("town"), load_map("town")
    stack.driver.halted = STOP_SIGN if halted else None
    n = len(others)
    seen = nobody()
    if n:
        distance, speed = np.array(others).T
        seen = SeenActors(
            np.arange(1, n + 1), np.zeros(n, np.uint8), np.full(n, X_MAJOR), -distance, np.zeros(n),
            np.full(n, 0.5 * np.pi), np.zeros(n), speed, np.full(n, 4.0), np.full(n, 1.8),
            np.zeros(n, np.bool_),
        )  # fmt: skip
    place = map.at(STOP_LANE, STOP_S - 0.5 * stack.driver.car.length - 1.5)
    return stack.driver.act(view_at(place.pose, v, actors=seen))


def test_it_halts_at_a_stop_sign_then_goes_when_nobody_comes():
    assert at_the_stop_sign(v=5.0, halted=False).brake > 0.0
    assert at_the_stop_sign(halted=False).throttle > 0.0
    assert at_the_stop_sign((30.0, 14.0)).throttle == 0.0
    assert at_the_stop_sign((149.0, 10.0)).throttle > 0.0
    assert at_the_stop_sign((-30.0, 14.0)).throttle > 0.0, "it has passed"
    assert at_the_stop_sign((149.0, 10.0), (30.0, 14.0)).throttle == 0.0
    assert at_the_stop_sign((30.0, 0.2)).throttle > 0.0, "it waits itself"


@given(v=st.floats(0.0, V_THROUGH), way=st.floats(0.1, 100.0), a=st.floats(0.1, 3.0))
def test_the_time_through_is_that_of_small_steps(v, way, a):
    t, gone, speed, dt = 0.0, 0.0, v, 1e-2
    while gone < way:
        faster = min(speed + a * dt, V_THROUGH)
        gone += 0.5 * (speed + faster) * dt
        speed = faster
        t += dt
    assert t == pytest.approx(travel_time(v, way, a), abs=0.05)


# --- who crosses, and who cuts in


def one(x: float, y: float, vx: float, vy: float, kind: int = 0, size=(4.0, 1.8)) -> SeenActors:
    """One road user at (x, y), for an ego at (100, -5.25) that drives along x."""
    x, y, z, yaw, vx, vy, length, width = (
        np.array([float(c)]) for c in (x, y, 0.0, np.arctan2(vy, vx), vx, vy, *size)
    )
    lamps = np.zeros(1, np.bool_)
    return SeenActors(np.ones(1, np.int64), np.full(1, kind, np.uint8), x, y, z, yaw, vx, vy, length,
                      width, lamps)  # fmt: skip


def answer(actors: SeenActors, v: float = 15.0) -> VehicleCommand:
    """The command at 15 m/s on the straight road."""
    map = load_map("straight")
    return seat().driver.act(view_at(map.place(map.ego_start).pose, v, actors=actors))


PERSON = {"kind": 6, "size": (0.5, 0.5)}


def test_it_brakes_for_who_will_cross_when_it_arrives_and_not_for_others():
    free = answer(nobody())
    assert answer(one(140.0, -9.0, 0.0, 1.4, **PERSON)).brake > 0.1
    assert answer(one(140.0, -9.0, 0.0, -1.4, **PERSON)) == free, "walks away"
    assert answer(one(140.0, -9.0, 0.0, 0.0, **PERSON)) == free, "stands at the kerb"
    assert answer(one(140.0, -5.25, 0.0, 0.0, **PERSON)).brake > 0.1, "stands in the lane"
    assert answer(one(140.0, -2.9, 0.0, 1.4, **PERSON)) == free, "has crossed"
    assert answer(one(190.0, -9.0, 0.0, 5.0, **PERSON)) == free, "is across long before"
    assert answer(one(140.0, -25.0, 0.0, 8.0)).brake > 0.1, "a car from the side"


def test_a_cut_in_is_answered_as_it_begins():
    beside = one(112.0, -8.75, 11.0, 0.0)
    assert answer(beside).brake == 0.0
    assert answer(one(112.0, -8.75, 11.0, 1.5)).brake > 0.1, "comes over within a second"


def test_who_drives_on_another_level_is_not_in_the_way():
    below = one(130.0, -5.25, 0.0, 0.0)
    assert answer(below).brake > 0.1
    assert answer(below._replace(z=np.array([6.0]))).brake == 0.0
