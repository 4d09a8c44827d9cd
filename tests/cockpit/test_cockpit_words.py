"""What a page may say: words that cannot be are refused in the page, and the drive goes on."""

import random
from multiprocessing import Pipe

import msgspec
import numpy as np
import pytest

from skidpad.cockpit.hud import stopping_distance
from skidpad.cockpit.words import Link, Word, encode
from skidpad.core.inputs import Sky
from skidpad.core.run import Function
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.physics.grip import grip_params, mu_at
from skidpad.physics.presets import all_presets, preset
from support.cockpit.producers import bridge

FIELDS = (
    "precipitation",
    "fog_density",
    "wetness",
    "ice_thickness",
    "snow_depth_mm",
    "sun_altitude_deg",
)


@pytest.mark.req("A-217")
def test_a_combination_that_cannot_be_is_refused_in_words_and_nothing_is_set():
    made = bridge(weather="clear-noon", sky=preset("clear-noon").values(), crowd=None)
    assert made.say("a", "weather", "snow") is None
    wrong = made.say("a", "grip", "statistical")
    assert "snow" in wrong
    assert "physical" in wrong
    assert made.say("a", "range", "none") is None
    (first, second) = [word.input for word in made.producer.words]
    assert (first.grip, second.grip) == (GripModel.PHYSICAL, GripModel.PHYSICAL)
    assert second.weather.name == "snow"
    # what was just set counts, also before a picture shows it
    assert made.say("a", "weather", "rain-noon") is None
    assert made.say("a", "grip", "statistical") is None
    assert "ice" in made.say("a", "sky", {"ice_thickness": 30})
    assert "snow" in made.say("a", "weather", "snow")
    assert made.producer.words[-1].input.weather.name == "rain-noon"
    assert made.say("a", "hour") is None
    assert made.producer.words[-1].input.grip is GripModel.STATISTICAL
    assert "only on roads" in made.say("a", "crowd", 3)


def test_a_weather_is_said_in_a_line_of_what_lies_on_the_road_and_the_grip_that_is_left():
    pytest.importorskip("nicegui", reason="nicegui is not installed (extra cockpit)")
    from skidpad.cockpit.page import MEANINGS, describe_weather

    for weather in all_presets().values():
        said = describe_weather(weather, GripModel.PHYSICAL)
        grip = float(said.split("grip ")[1].split(" ")[0])
        road = grip_params(weather, GripModel.PHYSICAL)
        assert grip == pytest.approx(float(mu_at(road, 80.0 / 3.6)), abs=0.005)
        assert ("of ice" in said) is (weather.ice_thickness > 0.0), weather.name
    assert describe_weather(preset("clear-noon"), GripModel.NONE).startswith("dry road; ")
    assert set(MEANINGS["grip"]) == {model.value for model in GripModel}
    assert set(MEANINGS["range"]) == {model.value for model in RangeModel}


def test_the_page_may_ask_for_a_run_to_be_driven_again():
    made, (ours, theirs) = bridge(), Pipe()
    assert made.say("a", "again", "ice") is None
    (word,) = made.producer.words
    link = Link(theirs)
    ours.send_bytes(encode(word))
    assert link.drain(1.0)
    assert link.again == "ice"


def test_no_word_of_a_page_ends_a_drive():
    """20 000 random words, right and wrong: every input that goes out can be driven."""
    rng = random.Random(7)
    made = bridge(weather="clear-noon", sky=preset("clear-noon").values(), crowd=4)
    values = {
        "weather": [None, *all_presets(), "hail"],
        "sky": [{f: v} for f in FIELDS for v in (0, 3, 50, 100, -90, 1e9, float("nan"), "x")],
        "grip": ["none", "statistical", "physical", "ice", None],
        "range": ["none", "physical", 3],
        "toggle": [*(f.value for f in Function), "wings"],
        "lamps": [None, "auto", "high", "bright"],
        "crowd": [0, 4, 80, 81, -1, "x", None],
        "hour": [None], "take": [None], "step": [None, 3, "x"], "rate": [0, 1, 4, -1, None],
        "pedals": [{"throttle": 1.0}, {"steer": 2.0}, {"brake": float("nan")}, {}, None],
        "main": [None, "top", "moon"], "hide": ["depth", "driver", "moon"], "extra": [None, "clouds", "x"],
    }  # fmt: skip
    refused = 0
    for _ in range(20_000):
        word = rng.choice(list(values))
        refused += made.say("a", word, rng.choice(values[word])) is not None
        if rng.random() < 0.3:  # a picture shows what is set
            now = made._sky()
            seat = {"weather": now.weather.name, "grip": now.grip.value, "range": now.range.value}
            made.told["seat"] |= seat | {"sky": now.weather.values()}
    assert 2_000 < refused < 15_000
    skies = [w.input for w in made.producer.words if isinstance(getattr(w, "input", None), Sky)]
    assert len(skies) > 2_000
    for sky in skies:
        assert 0.0 < mu_at(grip_params(sky.weather, sky.grip), 20.0) < 2.0
    for word in made.producer.words:  # what is sent can be read at the other end
        msgspec.json.decode(encode(word), type=Word)


@pytest.mark.parametrize(
    ("mu", "way"),
    [([0.1] * 4, 318.6), ([0.9, 0.9, 0.3, 0.3], 53.1), ([np.nan] * 4, None), ([0.0] * 4, None)],
)
def test_the_way_of_a_full_braking_follows_from_speed_and_present_grip(mu, way):
    found = stopping_distance(25.0, np.array(mu, np.float32))
    assert found == (None if way is None else pytest.approx(way, abs=0.1))
