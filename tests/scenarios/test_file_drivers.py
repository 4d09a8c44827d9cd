"""Actors that a file hands to the reference driver's way of following."""

from __future__ import annotations

import pytest

from skidpad.campaign.driving.course_file import load_scenario
from skidpad.campaign.driving.file_drivers import FollowingDriver
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.stack.reference.following import GAP_MIN
from skidpad.stack.reference.person import person_of
from support.scenarios.files import (
    ACTIVATE,
    at,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    vehicle,
    with_controller,
    write,
)

LENGTH = 4.2  # m of both boxes


def end_of(folder, lead=True, **properties):
    """Where `other` is after 60 s behind `third` at 8 m/s, or alone."""
    begins = init("other", teleport(on_lane(-1, 100)), speed(to(10)), ACTIVATE)
    third = at("third", -1, 150, 8) if lead else at("third", -3, 300, 0)
    file = write(
        folder,
        entities=vehicle("ego")
        + with_controller("ReferenceDriver", **properties)
        + vehicle("third"),
        init=at("ego", -3, 100, 0) + begins + third,
        end=60.0,
    )
    found = play_ideal(load_scenario(Scenario(file=str(file))), 60.0)
    return found.of("other")[-1], found.of("third")[-1]


def test_it_settles_at_the_gap_that_its_person_wants(tmp_path):
    """The improved model's gap at steady speed is s0 + v T (Treiber and Kesting 2013, 11.3.7)."""
    other, third = end_of(tmp_path, seed=3, setSpeed=20)
    assert other.speed == pytest.approx(8.0, abs=0.05)
    wanted = GAP_MIN + 8.0 * person_of(3).headway
    assert third.x - other.x - LENGTH == pytest.approx(wanted, abs=0.3)


def test_it_keeps_a_set_speed_and_a_longer_gap_on_snow(tmp_path):
    alone, _ = end_of(tmp_path, lead=False, setSpeed=15)
    assert alone.speed == pytest.approx(15.0, abs=0.2)  # reached asymptotically
    dry, lead = end_of(tmp_path, seed=3, setSpeed=20)
    snow, behind = end_of(tmp_path, seed=3, setSpeed=20, road="snow")
    assert behind.x - snow.x > lead.x - dry.x + 1.0


def test_an_action_of_the_file_goes_before_it(tmp_path):
    slow = event("slow", private(speed(to(4), "linear", 2)), time(1))
    file = write(
        tmp_path,
        entities=vehicle("ego") + with_controller("ReferenceDriver"),
        init=at("ego", -3, 100, 0)
        + init("other", teleport(on_lane(-1, 100)), speed(to(10)), ACTIVATE),
        stories=story(slow),
        end=3.0,
    )
    found = play_ideal(load_scenario(Scenario(file=str(file))), 3.0).of("other")
    assert found[-1].speed == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize("wrong", [{"seed": "me"}, {"setSpeed": "-1"}, {"road": "moon"}])
def test_a_property_that_means_nothing_is_one_sentence(wrong):
    with pytest.raises(ConfigError, match="of a controller must be"):
        FollowingDriver(wrong)
