"""What a driver that sees is taught: the lane and the lead, against places laid out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.campaign.dataset import label_of
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.roads.bundled import load_map
from skidpad.stack.camera.codes import AHEAD, decode_output, encode_label

LENGTH, WIDTH = 4.0, 1.8


def world(*others, offset=0.0, turn=0.0):
    """The ego in the middle lane of `straight`; others as (ahead, left of its lane, yaw)."""
    map = load_map("straight")
    place = map.on_lane(1, -2, 300.0)
    n = 1 + len(others)
    table = ActorTable(
        tuple(f"v{i}" for i in range(n)), ("car",) * n, np.full(n, ActorKind.CAR, dtype=np.uint8),
        np.full(n, LENGTH), np.full(n, WIDTH), np.full(n, 1.5), np.zeros((n, 3), dtype=np.uint8),
    )  # fmt: skip
    states = ActorStates.empty(n)
    left = np.array([-np.sin(place.heading), np.cos(place.heading)])
    along = np.array([np.cos(place.heading), np.sin(place.heading)])
    for i, (ahead, aside, yaw) in enumerate(((0.0, offset, turn), *others)):
        x, y = np.array([place.x, place.y]) + ahead * along + aside * left
        states.x[i], states.y[i], states.z[i] = x, y, place.z
        states.yaw[i], states.present[i] = place.heading + yaw, True
    return map, table, states


def test_a_lane_lies_to_the_other_side_of_an_ego_beside_its_middle():
    label = label_of(*world(offset=0.5))
    assert label.offsets == pytest.approx([-0.5] * len(AHEAD), abs=0.01)


def test_a_turned_ego_sees_its_lane_turn_the_other_way():
    label = label_of(*world(turn=0.1))
    assert label.offsets == pytest.approx([-d * np.sin(0.1) for d in AHEAD], abs=0.01)


@pytest.mark.parametrize(
    ("other", "gap"),
    [
        ((20.0, 0.0, 0.0), 16.0),  # half of each length between centres and bumpers
        ((20.0, 3.5, 0.0), None),  # next lane
        ((20.0, 2.0, 0.0), None),  # beside the way, 5 cm free
        ((20.0, 1.7, 0.0), 16.0),  # its flank reaches into it
        ((-20.0, 0.0, 0.0), None),  # behind
        ((20.0, 0.0, np.pi / 2.0), 17.1),  # across: half its width
        ((90.0, 0.0, 0.0), None),  # beyond what is looked at
    ],
)
def test_the_lead_is_whoever_reaches_into_the_way(other, gap):
    found = label_of(*world(other)).gap
    assert found == (None if gap is None else pytest.approx(gap, abs=0.05))


def test_of_two_the_nearer_counts():
    assert label_of(*world((40.0, 0.0, 0.0), (15.0, 0.0, 0.0))).gap == pytest.approx(11.0, abs=0.05)


def test_codes_come_back_as_they_were():
    label = label_of(*world((20.0, 0.0, 0.0), offset=0.3))
    numbers = encode_label(label)
    numbers[-2] = 4.0  # a logit for present
    back = decode_output(numbers)
    assert back.offsets == pytest.approx(label.offsets, abs=1e-4)
    assert back.gap == pytest.approx(label.gap, abs=1e-3)
    numbers[-2] = -4.0
    assert decode_output(numbers).gap is None
