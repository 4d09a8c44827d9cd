"""The fleet's pictures by value: axes and dates, scale, legend, and the hazard marked."""

from __future__ import annotations

import re

import pytest

from skidpad.evidence.statistics import Interval
from skidpad.fleet.alerting.keeping import Body
from skidpad.fleet.insight.trends import Trend
from skidpad.fleet.site.dashboard import trend_svg
from skidpad.fleet.site.drawing import (
    KINDS,
    Dot,
    kinds_legend,
    map_svg,
    moment_text,
    replay_legend,
    replay_svg,
    scale_m,
    scene_legend,
    scene_svg,
    scene_text,
)
from support.fleet_world import record

DAY = 86_400.0


def trend(day: int, share: float) -> Trend:
    return Trend("gap", day * DAY, 0.0, share, Interval(share / 2, share * 2), 3, 100)


def texts(svg: str) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg)


def test_a_trend_has_percent_and_days_on_its_axes_and_points_at_their_time():
    svg = trend_svg([trend(20_000, 0.01), trend(20_001, 0.02), trend(20_010, 0.02)], "gap")
    assert texts(svg) == ["0 %", "2.5 %", "5 %", "2024-10-04", "2024-10-14"]
    line = re.search(r'<polyline points="([^"]*)"', svg).group(1)
    xs, ys = zip(*(map(float, p.split(",")) for p in line.split()), strict=True)
    assert (xs[1] - xs[0]) / (xs[2] - xs[0]) == pytest.approx(0.1, abs=0.001)  # by time, not index
    low, high = (float(v) for v in re.findall(r'<path d="M42 ([\d.]+)H', svg)[::2])
    assert (low - ys[0]) / (low - high) == pytest.approx(0.01 / 0.05, abs=0.002)


def test_one_day_alone_is_a_dot_on_a_bar_and_no_line():
    svg = trend_svg([trend(20_000, 0.3)], "gap")
    assert texts(svg) == ["0 %", "50 %", "100 %", "2024-10-04"]
    assert "polyline" not in svg
    assert svg.count("<circle") == 1


def test_a_map_has_a_scale_and_rings_that_hide_no_disc():
    dots = [Dot(0.0, 0.0, "stuck_vehicle", "one"), Dot(0.0, 0.0, "stuck_vehicle", "nine", 9)]
    svg = map_svg([[(-500.0, 0.0), (500.0, 0.0)]], dots, "town")
    assert texts(svg) == ["200 m"]
    bar = float(re.search(r"h([\d.]+)\"", svg).group(1))
    assert bar == 200.0
    ring, disc = re.findall(r"<circle[^>]*>", svg)
    assert 'fill="none"' in ring
    assert f'fill="{KINDS["stuck_vehicle"]}"' in disc
    radius = [float(re.search(r' r="([\d.]+)"', one).group(1)) for one in (ring, disc)]
    assert radius[0] > 2 * radius[1]
    legend = kinds_legend(dots)
    assert "stuck vehicle" in legend
    assert KINDS["stuck_vehicle"] in legend
    assert "crossing" not in legend


@pytest.mark.parametrize(("width", "bar"), [(120.0, 20.0), (1000.0, 200.0), (4000.0, 1000.0)])
def test_a_scale_is_a_round_length_of_at_most_a_quarter(width, bar):
    assert scale_m(width) == bar


def test_a_replay_marks_what_the_hazard_is_about_where_it_is_now():
    one = record()
    assert moment_text(one, 0).startswith("0.0 s: before the hazard (1.0 to 1.5 s")
    assert moment_text(one, 12).startswith("1.2 s: during")
    assert moment_text(one, 19).startswith("1.9 s: after")
    for k in (0, 12):
        svg = replay_svg(one, k)
        (mark,) = re.findall(r'<circle class="hazard"[^>]*>', svg)
        x, y = (float(re.search(rf'{c}="([-\d.]+)"', mark).group(1)) for c in ("cx", "cy"))
        seen = one.worlds[k].frames[0].objects[0]
        assert (x, -y) == pytest.approx((seen[0], seen[1]), abs=0.06)
        assert ("dasharray" in mark) is (k == 0)
        assert texts(svg) == ["20 m"]
    assert "channel a" in replay_legend(one)
    assert "channel b" in replay_legend(one)


def test_the_scene_of_an_alert_has_roads_a_scale_its_heading_and_the_nearest_object_marked():
    ego, far, close = Body(100.0, 50.0, 0.0), Body(130.0, 50.0, 0.0), Body(109.0, 48.0, 0.0)
    svg = scene_svg(ego, [far, close], "scene", [[(40.0, 50.0), (160.0, 50.0)]])
    assert texts(svg) == ["20 m"]
    assert svg.count("<polygon") == 3
    assert 'points="40.0,-50.0 160.0,-50.0"' in svg  # the road
    assert 'points="102.2,-50.0 111.2,-50.0"' in svg  # ahead of its nose
    assert re.findall(r'class="hazard" cx="([^"]*)" cy="([^"]*)"', svg) == [("109.0", "-48.0")]
    assert scene_text(ego, [far, close]) == "nearest object: 9.0 m ahead, 2.0 m to the right"
    turned = Body(100.0, 50.0, 3.141592653589793)
    assert scene_text(turned, [close]) == "nearest object: 9.0 m behind, 2.0 m to the left"
    alone = scene_svg(ego, [], "scene")
    assert "hazard" not in alone
    assert scene_text(ego, []) == "no other object was shown"
    assert "circle: the nearest" in scene_legend()
