"""A walker's skeleton: one tree, mirrored sides, poses that children follow."""

from __future__ import annotations

from math import pi

import pytest

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.actors.bones import (
    NAMES,
    ROOT,
    SKELETON,
    Skeleton,
    parse_bones,
)
from skidpad.simulation.carla_server.protocol.wire import WireError


def test_every_bone_hangs_on_one_before_it():
    seen = {ROOT}
    for name, parent, _ in SKELETON:
        assert parent in seen
        assert name not in seen
        seen.add(name)
    assert seen == NAMES
    assert {"crl_hips__C", "ctrl_shoulder__L", "crl_shoulder__R", "crl_handMiddle_L"} <= seen


def test_it_stands_in_its_box_and_is_as_wide_on_both_sides():
    rows = {r[0]: r for r in Skeleton().list_transforms(Pose(0.0, 0.0, 0.9), 1.8)}
    heights = [r[1][0][2] for r in rows.values()]
    assert min(heights) == pytest.approx(0.0, abs=1e-9)
    assert 1.5 < max(heights) < 1.8
    for name, row in rows.items():
        if name.endswith("__L") and name.replace("__L", "__R") in rows:
            mirrored = rows[name.replace("__L", "__R")]
            (x, y, z), (u, v, w) = row[2][0], mirrored[2][0]
            assert (x, y, z) == pytest.approx((u, -v, w))
            assert y < 0.0  # left is negative in CARLA's axes


def test_children_follow_and_unknown_names_do_nothing():
    skeleton = Skeleton()
    skeleton.set_bones(
        {"crl_arm__R": Pose(0.0, -0.1, 0.0, pitch=-pi / 2.0), "nobody": Pose(1.0, 0.0)}
    )
    hidden = {r[0]: r for r in skeleton.list_transforms(Pose(0.0, 0.0), 1.8)}
    skeleton.blend = 1.0
    shown = {r[0]: r for r in skeleton.list_transforms(Pose(0.0, 0.0), 1.8)}
    assert hidden["crl_hand__R"][2][0][2] < shown["crl_hand__R"][2][0][2] - 0.5  # the arm is raised
    assert hidden["crl_hand__L"] == shown["crl_hand__L"]
    skeleton.take()
    assert {r[0]: r for r in skeleton.list_transforms(Pose(0.0, 0.0), 1.8)} == hidden


@pytest.mark.parametrize("value", [[], [[["a"]]], [[[1, [[0, 0, 0], [0, 0, 0]]]]], [["a"]], 3])
def test_what_is_no_pose_is_refused(value):
    with pytest.raises(WireError):
        parse_bones(value)
