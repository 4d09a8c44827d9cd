"""The one rule of friction: every two words together give what the rule says of them, at a wheel."""

from dataclasses import replace
from itertools import combinations, combinations_with_replacement
from pathlib import Path

import numpy as np
import pytest

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.environment.tyres import find_tyres
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorSetup, LanePosition, Setup
from skidpad.core.weather import Weather
from skidpad.physics.grip import RoadSurface, physical_params, ratio_at, road_surface
from skidpad.roads.bundled import FOLDER
from skidpad.roads.opendrive.materials import read_materials
from skidpad.simulation.world.interventions import set_tyres
from skidpad.simulation.world.patches import FrictionZone
from skidpad.simulation.world.stage import build_world
from support.friction_rule import FRICTION_RULE

V, MU, MATERIAL, SCALE, SHARE, THIN, OTHER = 20.0, 0.7, 0.6, 0.8, 0.5, 0.3, 0.45
TYRES, WET, DEEP = "summer_4mm", Weather(wetness=100.0), 1.5
CONTROL, TRIGGER = 3.0, 2.0
WORDS = tuple(word.said_by for word in FRICTION_RULE)
(M, KIND, LANE, FACTOR, SKY, DEPTH, PATCH, TWO, WHEEL, ZONE) = WORDS
DOCS = Path(__file__).parents[3] / "docs" / "friction.md"


@pytest.fixture(scope="module")
def road(tmp_path_factory):
    """The straight road, whose lanes say a friction from 100 m on."""
    text = (FOLDER / "straight.xodr").read_text()
    file = tmp_path_factory.mktemp("map") / "grippy.xodr"
    said = f'<material sOffset="100" surface="asphalt" friction="{MATERIAL}" roughness="0"/></lane>'
    file.write_text(text.replace("</lane>", said))
    return file


def patch(**what):
    return SurfacePatch(road=1, **what)


def felt(road, words):
    """Friction at the ego's wheels, as the world has it."""
    patches = {DEPTH: [{"water_mm": DEEP}], PATCH: [{"friction": SHARE}],
               TWO: [{"friction": OTHER}, {"friction": THIN}]}  # fmt: skip
    mu_ref = MU if M in words else 0.9
    setup = Setup(
        map=road, weather=WET if SKY in words else Weather(), specs=(),
        ego=ActorSetup(name="ego", type="hatchback", place=LanePosition(1, -2, 300.0), speed=V),
        mu_ref=mu_ref * (SCALE if FACTOR in words else 1.0),
        tyres=TYRES if KIND in words else "winter",
        material_base=mu_ref if LANE in words else None,
        patches=tuple(patch(**p) for word in words for p in patches.get(word, [])),
    )  # fmt: skip
    world = build_world(setup, 1)
    if WHEEL in words:
        set_tyres(world, 0, [CONTROL] * 4)
    if ZONE in words:
        world.wheel_grip.zones = [FrictionZone(Pose(300.0, 0.0), (500.0, 50.0, 5.0), TRIGGER)]
    world.feel_grip()
    return world.fleet.mu[0]


def by_rule(words):
    """The same from the rule alone: a product of four factors."""
    tyres = find_tyres(TYRES if KIND in words else "winter")

    def left(surface: RoadSurface) -> float:
        return ratio_at(physical_params(surface, 0.9, tyres), V)

    base = MATERIAL if LANE in words else MU if M in words else 0.9
    base *= SCALE if FACTOR in words else 1.0
    base *= physical_params(RoadSurface(0, 0, 0, 0, 15.0), 1.0, tyres).mu_ref
    outside = road_surface(WET if SKY in words else Weather())
    weather = left(outside)
    lying = [weather * SHARE] if PATCH in words else []
    lying += [weather * THIN] if TWO in words else []
    if DEPTH in words:
        lying.append(left(replace(outside, film_mm=max(outside.film_mm, DEEP))))
    tire = TRIGGER if ZONE in words else CONTROL if WHEEL in words else 3.5
    return base * min(lying, default=weather) * tire / 3.5


@pytest.mark.parametrize("words", [(), *combinations_with_replacement(WORDS, 2)], ids=" + ".join)
def test_every_two_words_combine_as_the_rule_says(road, words):
    chosen = tuple(dict.fromkeys(words))
    assert felt(road, chosen) == pytest.approx(np.full(4, by_rule(chosen)), rel=1e-9)


def test_what_is_recorded_before_the_first_step_has_the_tyres_own_friction(road):
    setup = Setup(
        map=road, weather=Weather(), specs=(),
        ego=ActorSetup(name="ego", type="hatchback", place=LanePosition(1, -2, 300.0), speed=V),
    )  # fmt: skip
    world = build_world(setup, 1)
    before = world.mu[0].copy()
    set_tyres(world, 0, [CONTROL] * 4)
    world.feel_grip()
    assert world.mu[0] == pytest.approx(before * CONTROL / 3.5, rel=1e-9)
    assert world.mu[0] == pytest.approx(world.fleet.mu[0], rel=1e-9)


def test_words_that_the_rule_says_replace_do_not_multiply():
    """The rule above is checked against its own table: what replaces a factor hides the former word."""
    kinds = {word.said_by: word for word in FRICTION_RULE}
    for one, two in combinations((M, LANE, WHEEL, ZONE), 2):
        if kinds[one].what == kinds[two].what:
            assert by_rule((one, two)) == by_rule((two,)), (one, two)
    assert by_rule((FACTOR, LANE)) == pytest.approx(SCALE * by_rule((LANE,)))
    assert by_rule((KIND, LANE)) > by_rule((LANE,))


def test_materials_are_read_by_section_and_offset(road, tmp_path):
    found = read_materials(road)
    assert {m.lane for m in found} >= {-1, -2, -3, 1, 2, 3}
    assert {(m.s_from, m.friction) for m in found} == {(100.0, MATERIAL)}
    wrong = tmp_path / "wrong.xodr"
    wrong.write_text(road.read_text().replace('friction="0.6"', 'friction="0"'))
    with pytest.raises(FileError, match=r"wrong.xodr, line \d+: <material> needs friction above 0"):
        read_materials(wrong)


def test_a_map_without_materials_says_so():
    setup = Setup(
        map="straight", weather=Weather(), specs=(), material_base=0.9,
        ego=ActorSetup(name="ego", type="hatchback", place=LanePosition(1, -2, 300.0)),
    )  # fmt: skip
    with pytest.raises(ConfigError, match="map straight says no <material friction>"):
        build_world(setup, 1)


def test_the_page_shows_the_rule():
    text = DOCS.read_text()
    for word in FRICTION_RULE:
        assert f"| {word.said_by} | {word.acts} | {word.what} | {word.how} |" in text
