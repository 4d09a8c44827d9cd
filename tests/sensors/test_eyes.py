"""A human driver sees what is in line of sight and range, late, and closing only when it looms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.specs import EyesSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.traffic.sight import RoadLook
from skidpad.core.vocabulary import ActorKind, LightState
from skidpad.core.weather import Weather
from skidpad.physics.presets import preset
from skidpad.roads.roadside import Box, Roadside, SignalHead
from skidpad.sensors.object_level.eyes import LOOMING, Eyes, perceived_velocity, road_look

NOON = preset("clear-noon")
SIZES = {
    ActorKind.CAR: (4.5, 1.8, 1.5),
    ActorKind.TRUCK: (8.0, 2.5, 3.5),
    ActorKind.PEDESTRIAN: (0.4, 0.5, 1.75),
}
CAR, TRUCK, PEDESTRIAN = SIZES


def table(kinds):
    size = np.array([SIZES[k] for k in kinds])
    n = len(kinds)
    return ActorTable(
        names=tuple(map(str, range(n))),
        types=("x",) * n,
        kind=np.array(kinds, dtype=np.uint8),
        length=size[:, 0],
        width=size[:, 1],
        height=size[:, 2],
        rgb=np.zeros((n, 3), dtype=np.uint8),
    )


def states(places):
    """Actors at (x, y, speed along x)."""
    s = ActorStates.empty(len(places))
    for i, (x, y, v) in enumerate(places):
        s.x[i], s.y[i], s.vx[i], s.present[i] = x, y, v, True
    return s


def eyes(kinds, weather=NOON, roadside=None, reaction=0.0):
    setup = Setup(
        map="straight",
        weather=weather,
        specs=(),
        ego=ActorSetup(name="e", type="x", place=Pose(0, 0, 0)),
    )
    return Eyes(EyesSpec("eyes", reaction), roadside or Roadside(), table(kinds), setup)


def seen(kinds, places, **options):
    found = eyes(kinds, **options)
    found.look(0, states(places), {}, np.zeros(len(kinds), dtype=np.bool_))
    return found.view().actors.actor.tolist()


def test_nobody_is_seen_through_a_lorry():
    places = [(0, 0, 0), (20, 0, 0), (40, 0, 0)]
    assert seen([CAR, TRUCK, CAR], places) == [1]
    assert seen([CAR, CAR, TRUCK], places) == [1, 2], "a lorry is seen over a car"
    places[2] = (40, 9, 0)
    assert seen([CAR, TRUCK, CAR], places) == [1, 2]


def test_a_house_hides_and_what_is_behind_is_not_looked_at():
    house = Box(3, 15.0, 0.0, 0.0, 0.0, 6.0, 6.0, 8.0)
    assert seen([CAR, CAR], [(0, 0, 0), (30, 0, 0)], roadside=Roadside(boxes=(house,))) == []
    assert seen([CAR, CAR], [(0, 0, 0), (-30, 0, 0)]) == []


@pytest.mark.parametrize(
    ("weather", "kind", "near", "far"),
    [
        (NOON, CAR, 290.0, 310.0),
        (Weather(fog_density=80.0), CAR, 50.0, 150.0),
        (preset("clear-night"), CAR, 290.0, 310.0),  # by its lamps
        (preset("clear-night"), PEDESTRIAN, 60.0, 120.0),  # in the low beam
    ],
)
def test_nobody_is_seen_beyond_visibility(weather, kind, near, far):
    assert seen([CAR, kind], [(0, 0, 0), (near, 0, 0)], weather=weather) == [1]
    assert seen([CAR, kind], [(0, 0, 0), (far, 0, 0)], weather=weather) == []


def test_everything_but_the_own_motion_is_seen_late():
    look = eyes([CAR, CAR], reaction=0.5)
    for k in range(30):
        look.look(k, states([(0.5 * k, 0, 10), (50 + k, 0, 20)]), {}, np.array([False, k == 15]))
        view = look.view()
        late = max(k - 10, 0)
        assert (view.tick, view.pose.x) == (k, 0.5 * k)
        assert view.age == pytest.approx(min(k, 10) * 0.05)
        assert view.actors.x[0] == 50 + late
        assert view.actors.braking[0] == (late == 15)


def test_lights_are_seen_late_and_not_behind_a_lorry():
    head = SignalHead(7, 60.0, 0.0, 2.5, 0.0)
    look = eyes([CAR, TRUCK], roadside=Roadside(heads=(head,)), reaction=0.1)
    off = np.zeros(2, dtype=np.bool_)
    for k, state in enumerate((LightState.RED, LightState.RED, LightState.GREEN, LightState.GREEN)):
        look.look(k, states([(0, 0, 0), (30, 20, 0)]), {7: state}, off)
        late = LightState.GREEN if k == 4 else LightState.RED
        assert look.view().lights == {7: late}
    look = eyes([CAR, TRUCK], roadside=Roadside(heads=(head,)))
    look.look(0, states([(0, 0, 0), (30, 0, 0)]), {7: LightState.RED}, off)
    assert look.view().lights == {}


def test_slow_closing_far_away_is_not_noticed():
    distance, closing = 100.0, 5.0
    s = states([(0, 0, 20), (distance, 0, 20 - closing)])
    width = np.array([0.99 * LOOMING * distance**2 / closing])
    vx, _ = perceived_velocity(s, np.array([1]), width)
    assert vx[0] == pytest.approx(20.0)
    vx, _ = perceived_velocity(s, np.array([1]), width * 1.02)
    assert vx[0] == pytest.approx(15.0)


@pytest.mark.parametrize(
    ("weather", "look"),
    [
        (NOON, RoadLook.DRY),
        (preset("rain_20"), RoadLook.WET),
        (preset("rain-noon"), RoadLook.FLOODED),
        (preset("snow"), RoadLook.SNOW),
        (preset("icy_30"), RoadLook.ICE),
    ],
)
def test_the_road_is_seen_as_it_looks(weather, look):
    assert road_look(weather) is look


@pytest.mark.parametrize("seed", range(5))
def test_what_is_out_of_sight_changes_nothing(seed):
    """Scramble every true state that is not in sight."""
    rng = np.random.default_rng(seed)
    n = 30
    kinds = [CAR, *rng.choice(np.array([CAR, TRUCK, PEDESTRIAN]), n - 1).tolist()]
    kinds = [ActorKind(k) for k in kinds]
    a, b = eyes(kinds), eyes(kinds)
    off = np.zeros(n, dtype=np.bool_)
    for k in range(20):
        world = states([(0, 0, 9)] + [(*rng.uniform(-90, 90, 2), 5) for _ in range(n - 1)])
        a.look(k, world, {}, off)
        hidden = np.ones(n, dtype=np.bool_)
        hidden[[0, *a.view().actors.actor]] = False
        assert hidden.any()
        scrambled = world.copy()
        scrambled.present[hidden] = rng.random(int(hidden.sum())) < 0.5
        for field in (scrambled.x, scrambled.y, scrambled.z, scrambled.yaw, scrambled.vx):
            field[hidden] = np.nan
        b.look(k, scrambled, {}, off)
        for mine, its in zip(a.view().actors, b.view().actors, strict=True):
            assert_array_equal(mine, its)


def test_eyes_have_a_reaction_time_that_can_be():
    assert replace(EyesSpec("eyes"), reaction=2.0).reaction == 2.0
    with pytest.raises(ValueError, match="reaction"):
        EyesSpec("eyes", reaction=-0.1)
