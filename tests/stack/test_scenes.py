"""Whole scenes: mirrored, renumbered, stale, and the same at both sensor levels."""

from __future__ import annotations

import ast
from dataclasses import replace
from math import atan2, pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import skidpad.stack
from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import Supervision, Tier
from skidpad.stack.adas import AdasStack
from support.examples import examples
from support.stackfakes import LANE_WIDTH, RED, SPECS, ArcMap, Car, draw, ego_at, frame

approx = pytest.approx
EMERGENCIES = {Tier.HARD_STOP, Tier.STOPPED_TOO_CLOSE, Tier.EMERGENCY}


def stack_on(map=None, configuration=4, specs=SPECS, **options):
    return AdasStack(specs, map or ArcMap(), {"configuration": configuration, **options})


def approach(stack, level, v=22.0, v_lead=14.0, gap=70.0, ticks=175, left=0.0, permute=False):
    """Commands and reports of a drive up to a slower car, with a second one in the next lane."""
    log = []
    for k in range(ticks):
        x = v * 0.05 * k
        lead = max(gap + v_lead * 0.05 * k - x, 2.5)
        cars = [Car(lead, left), Car(lead + 12.0, LANE_WIDTH)]
        points = [(lead - 2.0, left / lead, 0.0, v_lead - v), (40.0, 0.09, 0.0, -v)]
        seen = frame(k, cars, ego_at(x, 0.0, 0.0, v), radar=points, level=level)
        if permute:
            seen = replace(seen, images=renumbered(seen.images, cars, k))
        log.append((stack.tick(seen), stack.report))
    return log


def renumbered(images, cars, k):
    """Depth images that also carry instances, whose ids are drawn anew each tick."""
    ids = np.random.default_rng(k).permutation(len(cars)) + 2
    named = [replace(car, instance=int(i)) for car, i in zip(cars, ids, strict=True)]
    cameras = {spec.id: spec for spec in SPECS[:4]}
    return {
        name: replace(image, instances=draw(named, cameras[name]).instances)
        for name, image in images.items()
    }


@pytest.mark.req("A-014")
def test_instance_ids_change_nothing():
    plain = approach(stack_on(), "pixels", ticks=40)
    assert approach(stack_on(), "pixels", ticks=40, permute=True) == plain


@pytest.mark.req("A-014", "A-015")
def test_the_stack_can_import_nothing_that_knows_the_truth():
    root = Path(skidpad.stack.__file__).parent
    allowed = ("core", "roads", "stack")
    found = set()
    for path in root.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("skidpad"):
                found.add(node.module)
            elif isinstance(node, ast.Import):
                found |= {a.name for a in node.names if a.name.startswith("skidpad")}
    assert len(found) > 10
    assert {name for name in found if name.split(".")[1] not in allowed} == set()
    controllers = {
        node.module
        for path in (root / "control").glob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
    }
    assert not any("perception" in name for name in controllers), "control decides on values alone"


@pytest.mark.req("M-3")
def test_both_levels_drive_alike():
    """Decision M-3: readings within 0.3 m, 97 % of detections agree, tiers within three ticks."""
    pixels, objects = approach(stack_on(), "pixels"), approach(stack_on(), "objects")
    pairs = [(a[1], b[1]) for a, b in zip(pixels, objects, strict=True)]
    assert np.mean([a.detected == b.detected for a, b in pairs]) >= 0.97
    for name in ("bumper", "roof", "fused"):
        both = [(getattr(a, name), getattr(b, name)) for a, b in pairs]
        errors = [abs(a - b) for a, b in both if a is not None and b is not None]
        assert np.median(errors) <= 0.3
        assert len(errors) > 20
    for tier in (Tier.ACC_CLOSE, Tier.EMERGENCY, Tier.HARD_STOP):
        first = [[r.tier for _, r in log].index(tier) for log in (pixels, objects)]
        assert abs(first[0] - first[1]) <= 3, tier


def mirrored_views(curvature, y, yaw, left):
    """What the stack does in a scene and in its mirror image."""
    rows = []
    for sign in (1.0, -1.0):
        map = centred(sign * curvature)
        stack = AdasStack(SPECS, map, {"configuration": 2})
        cars = [Car(30.0, sign * left)]
        points = [(28.0, sign * left / 30.0, 0.0, -3.0)]
        ego = ego_at(0.0, sign * y, sign * yaw, 20.0)
        for k in range(6):
            command = stack.tick(frame(k, cars, ego, radar=points))
        rows.append((command, stack.report))
    return rows


def centred(curvature):
    """A road whose middle lane passes the origin, so that a mirrored map is a map of this kind."""
    return ArcMap(curvature, rightmost=-LANE_WIDTH)


@pytest.mark.req("A-016", "A-042", "A-068", "A-142", "X-4")
@settings(max_examples=examples(60))
@given(
    st.sampled_from([-0.004, -0.001, 0.0, 0.002, 0.003]),
    st.floats(-1.5, 1.5),
    st.floats(-0.2, 0.2),
    st.floats(-3.0, 3.0),
)
def test_a_mirrored_scene_gives_mirrored_steer_and_equal_pedals(curvature, y, yaw, left):
    (here, report), (there, mirror) = mirrored_views(curvature, y, yaw, left)
    assert there.steer == approx(-here.steer, abs=1e-9)
    assert (there.throttle, there.brake) == approx((here.throttle, here.brake))
    assert mirror.yaw_error == approx(-report.yaw_error, abs=1e-9)
    assert mirror.curvature == approx(-report.curvature, abs=1e-9)
    assert mirror.lane_offset == approx(-report.lane_offset, abs=1e-9)
    assert (mirror.status, mirror.detected, mirror.tier) == (
        report.status, report.detected, report.tier,
    )  # fmt: skip
    assert mirror.radar_points == report.radar_points


@pytest.mark.req("A-154")
def test_the_lateral_offset_is_reported_and_steers_nothing():
    stack = stack_on(ArcMap(), configuration=2)
    angle = -atan2(0.4, 21.6) - 0.02  # to the point that lies 0.4 m per km/h on
    for k in range(5):
        command = stack.tick(frame(k, (), ego_at(0.0, 0.4, 0.02, 15.0)))
        assert stack.report.lane_offset == approx(0.4)
        assert command.steer == approx(angle * 1.088 * (1.0 - 0.3 * abs(angle) / pi))


@pytest.mark.req("A-195", "A-109")
@pytest.mark.parametrize("stale", [1, 2, 3])
@pytest.mark.parametrize("level", ["pixels", "objects"])
def test_stale_frames_after_a_relocation_brake_nobody(stale, level):
    """The ego hit a car, was put elsewhere, and its cameras still show the old scene."""
    stack, tick = stack_on(configuration=2), 0
    wreck, old, new = [Car(2.0)], Pose(0.0, 0.0), Pose(300.0, 0.0)
    phases = [Supervision.NONE] * 8 + [Supervision.BRAKE] * 10 + [Supervision.REALIGN]
    for phase in phases:
        ego = ego_at(old.x, v=0.0)
        stack.tick(frame(tick, wreck, ego, supervision=phase, level=level))
        tick += 1
    assert stack.report.detected
    for k in range(10):
        shown = wreck if k < stale else []
        ego = ego_at(new.x, v=0.0)
        command = stack.tick(frame(tick, shown, ego, supervision=Supervision.WARM_UP, level=level))
        assert command.brake == 1.0
        tick += 1
    for k in range(20):
        command = stack.tick(frame(tick, [], ego_at(new.x + 0.275 * k, v=5.5), level=level))
        assert stack.report.tier not in EMERGENCIES
        assert not stack.report.detected
        assert command.brake == 0.0
        tick += 1


# what a stack that was put elsewhere still knows, and what every tick writes anew
KEPT = {
    "lane", "s", "bend", "reference", "reference_s", "yaw_error", "kappa", "resume_ticks",
    "in_curve", "past_curve",
}  # fmt: skip
RENEWED = {
    "status", "distance", "bumper", "roof", "fused", "radar_pre", "radar_lane", "radar_velocity",
    "radar_points",
}  # fmt: skip


def test_a_stack_that_was_put_elsewhere_remembers_no_more_than_a_new_one():
    new, stack = stack_on(), stack_on()
    names = set(stack.memory.dtype.names) - KEPT - RENEWED
    for name in names:
        stack.memory[name] = 3
    stack._samples.fill(3.0)
    stack._history.fill(3.0)
    stack.relocated()
    for name in names:
        is_number = stack.memory.dtype[name].kind == "f"
        assert np.array_equal(stack.memory[name], new.memory[name], equal_nan=is_number), name
    assert np.array_equal(stack._samples, new._samples)
    assert np.array_equal(stack._history, new._history)


@pytest.mark.req("A-109", "A-195")
def test_a_relocation_clears_everything_that_was_seen_and_summed():
    stack = stack_on(ArcMap(lights=((7, 0, 60.0),)))
    for k in range(8):
        stack.tick(frame(k, [Car(30.0)], ego_at(20.0, v=15.0), lights={7: RED}))
    m, sums = stack.memory[0], ["speed_previous", "speed_integral", "distance_previous",
                                "distance_integral", "steady_integral"]  # fmt: skip
    for name in sums:
        m[name] = 5.0
    assert m["seen_ticks"] >= 2
    assert stack.lock.signal == 7
    stack.tick(frame(9, [], ego_at(400.0), supervision=Supervision.WARM_UP))
    assert [m[name] for name in sums] == [0.0] * 5
    assert m["seen_ticks"] == 0
    assert stack.lock.signal is None
    assert stack.report.tier is Tier.NONE, "the supervisor drives"
