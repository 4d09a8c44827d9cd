"""Trailers follow the hitch, beside the two cases that esmini has computed (test_oracle)."""

from __future__ import annotations

from math import asin, cos, hypot, pi, sin

import pytest

from skidpad.core.geometry import Pose
from skidpad.scenarios.reading.entities import Body, Box, Coupling, Entity
from skidpad.scenarios.trailers import towed_pose
from support.scenarios.files import (
    VEHICLE,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    told,
    vehicle,
)

HITCH, COUPLER = -1.1, 3.2


def with_parts(name: str, parts: str) -> str:
    return vehicle(name).replace("<Properties/></Vehicle>", f"{parts}<Properties/></Vehicle>")


@pytest.mark.osc("TrailerAction")
def test_on_a_circle_a_trailer_turns_in_by_the_angle_of_its_length():
    """A hitch on a circle of 20 m draws an axle on one of sqrt(20^2 - 3.2^2); sin(angle) = 3.2 / 20."""
    trailer = Entity("t", Body.VEHICLE, "car", True, Box(), coupling=Coupling(None, COUPLER))
    pose, radius, step = Pose(20.0, -COUPLER, yaw=pi / 2.0), 20.0, 0.005
    for k in range(1, 2001):
        at = (radius * cos(k * step), radius * sin(k * step))
        pose = towed_pose(pose, 0.0, at, trailer)
    assert hypot(pose.x, pose.y) == pytest.approx((radius**2 - COUPLER**2) ** 0.5, abs=0.02)
    course = 2000 * step + pi / 2.0
    assert sin(course - pose.yaw) == pytest.approx(sin(asin(COUPLER / radius)), abs=0.005)


@pytest.mark.osc("ConnectTrailerAction", "DisconnectTrailerAction")
def test_a_trailer_in_the_description_stands_behind_and_comes_along(tmp_path):
    """It is called as its tractor with a plus, as by esmini; Init says nothing of it."""
    body = VEHICLE.format(x=0.0).replace(
        "<Properties/>", f'<TrailerCoupler dx="{COUPLER}"/><Properties/>'
    )
    inner = f'<TrailerHitch dx="{HITCH}"/><Trailer><Trailer name="t">{body}</Trailer></Trailer>'
    result = told(
        tmp_path,
        minor=3,
        entities=with_parts("ego", inner) + vehicle("other"),
        init=init("ego", teleport(on_lane(-3, 100)), speed(to(10))),
        end=3.0,
    )
    pairs = zip(result.of("ego"), result.of("ego+"), strict=True)
    assert [ego.x - towed.x for ego, towed in pairs] == pytest.approx([COUPLER - HITCH] * 61)
    assert result.of("ego+")[-1].speed == pytest.approx(10.0)
    assert result.player.scene.contacts == set()


def test_without_a_hitch_nothing_is_drawn_and_the_log_says_so(tmp_path):
    join = private("""<TrailerAction><ConnectTrailerAction trailerRef="ego"/></TrailerAction>""")
    result = told(tmp_path, stories=story(event("e", join, time(2.0))), minor=3)
    assert any("other does not tow ego: no hitch" in n for n in result.player.scene.notices)


@pytest.mark.parametrize("names", [("", "other"), ("ego", "other")])
def test_a_ring_of_trailers_and_an_entity_without_a_name_end_no_file(tmp_path, names):
    """A name may be empty in files of others; both tow each other, so that none is first."""
    first, second = names
    both = f'<TrailerHitch dx="{HITCH}"/><TrailerCoupler dx="{COUPLER}"/>'
    reference = '<Trailer><TrailerRef entityRef="{}"/></Trailer>'
    result = told(
        tmp_path,
        minor=3,
        entities=with_parts(first, both + reference.format(second))
        + with_parts(second, both + reference.format(first)),
        init=init(first, teleport(on_lane(-3, 100)), speed(to(10)))
        + init(second, teleport(on_lane(-1, 100)), speed(to(10))),
        end=1.0,
    )
    assert result.of("other")[-1].x == pytest.approx(result.of("other")[0].x + 10.0, abs=0.51)
