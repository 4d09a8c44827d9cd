"""Shaped bodies in the scene: wheels turn and steer with the motion, lamps light, far ones are coarse."""

import numpy as np
import pytest
from msgspec import structs

from skidpad.core.courses import Roads
from skidpad.core.geometry import Pose
from skidpad.core.run import AdasDriver, RunSpec, run_from_plain
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.states import ActorTable
from skidpad.core.vocabulary import ActorKind, Bodywork, SemanticClass
from skidpad.core.weather import Weather
from skidpad.physics.types import vehicle_type
from skidpad.sensors.raster.shaped_actors import FAR, ShapedActors
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight

CAMERA = CameraSpec("rgb", Modality.RGB, 400, 300, 60.0, Pose(0.5, 0.0, 1.4))


def make_table(*types):
    """Returns a table of vehicles of these types."""
    bodies = [vehicle_type(t) for t in types]
    return ActorTable(
        names=tuple(f"a{i}" for i in range(len(types))), types=types,
        kind=np.array([b.actor_kind for b in bodies], np.uint8),
        length=np.array([b.length for b in bodies]), width=np.array([b.width for b in bodies]),
        height=np.array([b.height for b in bodies]),
        rgb=np.full((len(types), 3), 120, np.uint8),
    )  # fmt: skip


def test_wheels_roll_by_the_way_that_is_driven():
    actors = ShapedActors(make_table("saloon"))
    states = states_at([(0.0, 0.0, 0.0, 0.0)])
    states.vx[0] = 10.0
    before = actors.near.vertices.copy()
    wheel = vehicle_type("saloon").wheel_radius
    for _ in range(4):
        assert np.allclose(actors.near.vertices, before, atol=1e-9) == (actors.rolled[0] == 0.0)
        actors.turn_wheels(states, 0.25 * 2.0 * np.pi * wheel / 10.0)  # one turn in four steps
    assert np.allclose(actors.near.vertices, before, atol=1e-9)


def test_the_top_of_a_wheel_moves_ahead():
    actors = ShapedActors(make_table("saloon"))
    states = states_at([(0.0, 0.0, 0.0, 0.0)])
    states.vx[0] = 1.0
    wheel = actors._wheels
    rim = slice(wheel.spins[0], wheel.end[0])
    before = actors.near.vertices[rim].copy()
    actors.turn_wheels(states, 0.01)
    moved = actors.near.vertices[rim] - before
    top = before[:, 2] > wheel.hub[0, 2] + 0.5 * wheel.radius[0] * 0.7
    assert top.any()
    assert (moved[top, 0] > 0.0).all()


def test_front_wheels_point_where_they_go_and_stay_when_the_vehicle_stops():
    actors = ShapedActors(make_table("saloon"))
    states = states_at([(0.0, 0.0, 0.0, 0.0)])
    type = vehicle_type("saloon")
    states.vx[0], states.yaw_rate[0] = 5.0, 0.5
    states.vy[0] = -type.x_rear_axle * 0.5  # the rear axle does not slide
    actors.turn_wheels(states, 0.05)
    assert actors.steer[0] == pytest.approx(np.arctan(type.wheelbase * 0.5 / 5.0), rel=1e-6)
    states.vx[0] = states.vy[0] = states.yaw_rate[0] = 0.0
    actors.turn_wheels(states, 0.05)
    assert actors.steer[0] > 0.2
    states.vx[0] = -5.0  # backwards and straight
    actors.turn_wheels(states, 0.05)
    assert actors.steer[0] == 0.0


def make_walkers():
    """Returns a walker of each style, with the vertices of its limbs."""
    n = 3
    table = ActorTable(
        names=tuple("abc"), types=("walker.1", "walker.2", "child"), rgb=np.full((n, 3), 120, np.uint8),
        kind=np.full(n, ActorKind.PEDESTRIAN, np.uint8), length=np.full(n, 0.6),
        width=np.full(n, 0.5), height=np.array([1.8, 1.7, 1.2]),
    )  # fmt: skip
    actors = ShapedActors(table)
    limbs = actors._limbs
    return actors, [slice(a, b) for a, b in zip(limbs.first, limbs.end, strict=True)]


def walk(actors, speed, elapsed):
    """Lets all walkers go ahead for a time in s; returns their vertices."""
    states = states_at([(0.0, 0.0, 0.0, 0.0)] * len(actors.rolled))
    states.vx[:] = speed
    actors.turn_wheels(states, elapsed)
    return actors.near.vertices


def test_legs_change_places_after_one_step_and_stand_still_without_speed():
    actors, limbs = make_walkers()
    assert len(limbs) == 12
    drawn = actors.near.vertices.copy()
    others = np.ones(len(drawn), dtype=bool)
    for limb in limbs:
        others[limb] = False
    step = actors._step[0]
    assert 0.2 < step < 0.6
    after = walk(actors, 1.4, step / 1.4)
    assert np.array_equal(after[others], drawn[others])
    for q, limb in enumerate(limbs[:4]):  # of the first walker
        low = drawn[limb, 2] < drawn[limb, 2].min() + 0.02
        assert after[limb][low, 0].mean() == pytest.approx(
            drawn[limb][low, 0].mean() - 2.0 * actors._limbs.reach[q], abs=0.03
        )
    standing = walk(actors, 0.0, 0.05).copy()
    feet = [standing[limb, 0].mean() for limb in (limbs[0], limbs[2])]
    assert abs(feet[0] - feet[1]) < 0.06
    assert np.array_equal(walk(actors, 0.0, 0.05), standing)


def test_a_foot_that_stands_stays_where_it_is_and_the_other_rises():
    actors, limbs = make_walkers()
    left, right = limbs[0], limbs[2]
    middle = walk(actors, 1.4, 0.5 * actors._step[0] / 1.4)
    assert middle[left, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert middle[right, 2].min() > 0.03
    assert middle[:, 2].min() > -1e-6


def look(distance, braking=False, indicating=(False, False), bodywork=Bodywork.SHAPED, back=True):
    """Returns the picture and the materials of a car that drives ahead."""
    table = make_table("saloon", "hatchback")
    suite = PixelSuite(
        straight(300),
        table,
        [CAMERA],
        Weather(),
        PixelSettings(bodywork=bodywork, camera_effect=False),
    )
    yaw = 0.0 if back else np.pi
    states = states_at([(50.0, -8.75, 0.0, 0.0), (50.0 + distance, -8.75, 0.0, yaw)])
    turns = np.array([(False, False), indicating])
    images = suite.observe(0, states, {}, np.array([False, braking]), turns).images
    rgb = images["rgb"].rgb.astype(int)
    key = suite._pass_of["rgb"].key
    return rgb, np.where(key >> 16 == 2, key & 255, -1), key


@pytest.mark.parametrize(
    "lamp", [Material.BRAKE_LAMP, Material.INDICATOR_LEFT, Material.INDICATOR_RIGHT]
)
def test_a_lamp_lights_when_the_vehicle_says_so_and_no_other_does(lamp):
    dark, material, _ = look(7.0)
    turns = (lamp == Material.INDICATOR_LEFT, lamp == Material.INDICATOR_RIGHT)
    lit, _, _ = look(7.0, lamp == Material.BRAKE_LAMP, turns)
    changed = (dark != lit).any(axis=2)
    shown = material == lamp
    assert shown.sum() > 4
    assert changed[shown].all()
    others = [Material.TAIL_LAMP] if lamp == Material.BRAKE_LAMP else []
    assert not changed[~np.isin(material, [lamp, *others])].any()
    assert (lit[shown].sum(axis=1) > dark[shown].sum(axis=1)).all()


def test_the_left_indicator_is_on_the_left_from_behind_and_on_the_right_from_ahead():
    for back in (True, False):
        _, material, _ = look(7.0, back=back)
        left = np.argwhere(material == Material.INDICATOR_LEFT)[:, 1].mean()
        right = np.argwhere(material == Material.INDICATOR_RIGHT)[:, 1].mean()
        assert (left < right) == back


def test_far_vehicles_are_drawn_coarsely_with_the_same_class_and_instance():
    actors = ShapedActors(make_table("saloon", "hatchback"))
    actors.near.position[1] = (FAR + 1.0, 0.0, 0.0)
    chosen = actors.select_for(camera_view(CAMERA, Pose(0.0, 0.0)))
    assert chosen.triangle_count[0] == actors.near.triangle_count[0]
    assert chosen.triangle_count[1] < 500 < actors.near.triangle_count[1]
    _, _, key = look(FAR + 15.0)
    seen = key >> 16 == 2
    assert seen.sum() > 10
    assert (key[seen] >> 8 & 255 == SemanticClass.CAR).all()


def test_plain_bodies_are_as_before():
    """The switch is off unless asked for, and then no lamp of shaped bodies is seen."""
    assert PixelSettings().bodywork is Bodywork.PLAIN
    _, material, _ = look(7.0, bodywork=Bodywork.PLAIN)
    assert material.max() < Material.FIRST_FREE


def test_runs_have_plain_bodies_unless_asked_and_then_say_so():
    plain = RunSpec(driver=AdasDriver(), course=Roads())
    assert "bodywork" not in plain.to_plain()
    shaped = structs.replace(plain, bodywork=Bodywork.SHAPED)
    assert shaped.to_plain()["bodywork"] == "shaped"
    assert run_from_plain(shaped.to_plain(), "it") == shaped
