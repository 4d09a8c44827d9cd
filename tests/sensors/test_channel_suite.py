"""Channels see only what is in sight, with errors of their own (decisions C-1, C-2)."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, LightState
from skidpad.physics.presets import preset
from skidpad.roads.roadside import Box, Roadside, SignalHead
from skidpad.sensors.channels.ghosts import GhostSettings
from skidpad.sensors.channels.localisation import Localisation
from skidpad.sensors.channels.presets import LAV_LIKE, SENSES, TFUSE_LIKE
from skidpad.sensors.channels.suite import ChannelSuite

NOON = preset("clear-noon")
CAR = (4.5, 1.9, 1.5)


def table(kinds: list[ActorKind]) -> ActorTable:
    n = len(kinds)
    size = np.array([CAR if k < ActorKind.BICYCLE else (0.4, 0.6, 1.75) for k in kinds])
    return ActorTable(
        names=tuple(f"a{i}" for i in range(n)),
        types=("x",) * n,
        kind=np.array(kinds, dtype=np.uint8),
        length=size[:, 0],
        width=size[:, 1],
        height=size[:, 2],
        rgb=np.zeros((n, 3), dtype=np.uint8),
    )


def states(places: list[tuple[float, float, float]]) -> ActorStates:
    s = ActorStates.empty(len(places))
    for i, (x, y, yaw) in enumerate(places):
        s.x[i], s.y[i], s.yaw[i], s.present[i] = x, y, yaw, True
    return s


def suite(n: int, name: str = "a", sensing=LAV_LIKE, roadside=None, seed=1, noise=1.0, kinds=None):
    kinds = kinds or [ActorKind.CAR] * n
    return ChannelSuite(
        name, sensing, roadside or Roadside(), table(kinds), NOON, seed, noise=noise
    )


CLEAR = replace(
    LAV_LIKE, miss=0.0, miss_far=0.0, confusion=0.0, ghosts=GhostSettings(rate=0.0, life=1.0)
)


@pytest.mark.req("C-024", "C-026")
def test_a_hidden_car_a_far_car_and_a_car_behind():
    world = states([(0, 0, 0), (15, 0, 0), (25, 0, 0), (200, 30, 0), (-20, 0, 0), (10, 20, 0)])
    all_round = suite(6, sensing=CLEAR)
    view = all_round.observe(0.0, world, {})
    assert_array_equal(all_round.visible, [False, True, False, False, True, True])
    assert len(view.objects) == 3
    forward = suite(6, sensing=replace(CLEAR, half_angle=pi / 2))
    forward.observe(0.0, world, {})
    assert_array_equal(forward.visible, [False, True, False, False, False, True])
    assert TFUSE_LIKE.half_angle <= pi / 2


@pytest.mark.req("C-026")
def test_a_building_hides_and_another_level_does_not():
    world = states([(0, 0, 0), (30, 0, 0)])
    house = Box(3, 15.0, 0.0, 0.0, 0.0, 6.0, 6.0, 8.0)
    hidden = suite(2, sensing=CLEAR, roadside=Roadside(boxes=(house,)))
    assert len(hidden.observe(0.0, world, {}).objects) == 0
    world.z[1] = 8.0
    above = suite(2, sensing=CLEAR)
    assert len(above.observe(0.0, world, {}).objects) == 0


@pytest.mark.req("C-021", "C-026")
@pytest.mark.parametrize("name", sorted(SENSES))
def test_what_is_out_of_sight_changes_nothing(name):
    """Decision C-1: scramble every true state outside the visible set."""
    rng = np.random.default_rng(7)
    n = 30
    a, b = (suite(n, name, SENSES[name], seed=5) for _ in range(2))
    for k in range(60):
        world = states(
            [(0, 0, 0.3)] + [(*rng.uniform(-90, 90, 2), rng.uniform(-3, 3)) for _ in range(n - 1)]
        )
        view = a.observe(0.1 * k, world, {})
        scrambled = world.copy()
        out = ~a.visible
        out[0] = False
        assert out.any()
        for field in (scrambled.x, scrambled.y, scrambled.yaw, scrambled.vx, scrambled.vy):
            field[out] = np.nan
        scrambled.present[out] = rng.random(int(out.sum())) < 0.5
        other = b.observe(0.1 * k, scrambled, {})
        for mine, its in zip(view, other, strict=True):
            if isinstance(mine, dict):
                assert mine == its
            else:
                assert_array_equal(mine, its)


@pytest.mark.req("C-026")
def test_equal_settings_give_uncorrelated_errors():
    """Decision C-1: correlation below 0.05 between two channels with the same settings."""
    n = 41
    angles = np.linspace(-3.0, 3.0, n - 1)
    world = states([(0, 0, 0)] + [(25 * np.cos(a), 25 * np.sin(a), a) for a in angles])
    both = [suite(n, name, replace(CLEAR, bias_time=0.1)) for name in ("left", "right")]
    errors: list[list[np.ndarray]] = [[], []]
    egos: list[list[np.ndarray]] = [[], []]
    for k in range(400):
        for c, eyes in enumerate(both):
            view = eyes.observe(0.1 * k, world, {})
            errors[c].append((view.objects[:, :2]).ravel())
            egos[c].append(view.ego)
    left, right = (np.array(e) - np.mean(e, axis=0) for e in errors)
    assert abs(np.corrcoef(left.ravel(), right.ravel())[0, 1]) < 0.05
    assert left.std() == pytest.approx(right.std(), rel=0.1)


@pytest.mark.req("C-026")
def test_localisation_is_stationary_with_the_stated_strength():
    error = replace(LAV_LIKE.localisation, jump_rate=0.0, drift_sigma=0.0)
    track = Localisation(error, "a", 3, 0.1)
    xy = np.array([track.update()[:2] for _ in range(40_000)])
    assert xy.std() == pytest.approx(error.sigma, rel=0.1)
    jumps = Localisation(replace(error, jump_rate=360.0, sigma=0.0), "a", 3, 0.1)
    steps = np.diff([jumps.update()[:2] for _ in range(36_000)], axis=0)
    large = np.hypot(*steps.T) > 0.5
    assert 200 < large.sum() < 900  # 360 there, and most of them back again
    assert error.scale(1.0, True).sigma == error.sigma
    dark = TFUSE_LIKE.localisation
    assert dark.scale(1.0, True).sigma > dark.scale(1.0, False).sigma


@pytest.mark.req("C-026")
def test_noise_factor_scales_the_errors():
    world = states([(0, 0, 0), (20, 3, 0)])

    def spread(noise: float) -> float:
        eyes = suite(2, sensing=CLEAR, noise=noise)
        return float(
            np.std(
                [eyes.observe(0.1 * k, world, {}).objects[0, :2] for k in range(800)], axis=0
            ).max()
        )

    assert spread(2.0) == pytest.approx(2.0 * spread(1.0), rel=0.15)
    assert spread(0.0) == 0.0


@pytest.mark.req("C-024", "C-026")
def test_lights_need_eyes_for_them_and_a_free_line_of_sight():
    head = SignalHead(7, 40.0, 3.0, 5.0, 0.0)
    world = states([(0, 0, 0), (20, 1.5, 0)])
    lights = {7: LightState.RED, 8: LightState.GREEN}
    free = suite(2, sensing=CLEAR, roadside=Roadside(heads=(head,)))
    assert free.observe(0.0, world, lights).lights == {7: LightState.RED}
    house = Box(3, 12.0, 1.0, 0.0, 0.0, 4.0, 4.0, 9.0)
    behind = suite(2, sensing=CLEAR, roadside=Roadside(heads=(head,), boxes=(house,)))
    assert behind.observe(0.0, world, lights).lights == {}
    blind = suite(2, sensing=replace(CLEAR, lights=False), roadside=Roadside(heads=(head,)))
    assert blind.observe(0.0, world, lights).lights == {}
    away = states([(0, 0, pi), (20, 1.5, 0)])
    assert free.observe(0.1, away, lights).lights == {}


@pytest.mark.req("C-026")
def test_objects_arrive_late():
    eyes = suite(2, sensing=replace(CLEAR, latency_cycles=2))
    seen = [eyes.observe(0.1 * k, states([(0, 0, 0), (20, 0, 0)]), {}).t_seen for k in range(4)]
    assert seen == pytest.approx([0.0, 0.0, 0.0, 0.1])


@pytest.mark.req("C-026")
def test_ghosts_and_misses_come_at_their_rates():
    world = states([(0, 0, 0), (10, 3, 0)])
    eyes = suite(2, sensing=replace(CLEAR, ghosts=GhostSettings(rate=720.0, life=1.0)))
    counts = np.array([len(eyes.observe(0.1 * k, world, {}).objects) - 1 for k in range(20_000)])
    assert counts.mean() == pytest.approx(0.2, rel=0.25)
    misses = suite(2, sensing=replace(CLEAR, miss=0.2, miss_far=0.2))
    seen = np.array([len(misses.observe(0.1 * k, world, {}).objects) for k in range(20_000)])
    assert 1.0 - seen.mean() == pytest.approx(0.2, rel=0.15)
