"""Small pictures as SVG: a map with hazards, a scene from above, a trend with its interval."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from math import cos, isfinite, sin

from skidpad.core.channels import ChannelFrame
from skidpad.fleet.alerting.keeping import Body
from skidpad.fleet.insight.trends import Trend
from skidpad.recording.hazards import HazardRecord

Line = Sequence[tuple[float, float]]  # m
COLOURS = ("#ff8552", "#4d9dff", "#4fce7f", "#d98cff")  # of channels
KINDS = {
    "ego_tailgating": "#ff8552", "ego_tailgated": "#ffd166", "inconsistent_localisation": "#4d9dff",
    "crossing_object": "#d98cff", "conflicting_paths": "#4fce7f", "stuck_vehicle": "#ff5b52",
    "unseen_by_a_channel": "#8fe3ff",
}  # fmt: skip
REACH = 60.0  # m around the ego
AROUND = REACH + 300.0  # m: ten seconds at 30 m/s and what is seen from there
LINES_MAX = 4000  # of a map


@dataclass(frozen=True, slots=True)
class Dot:
    """A mark on a map."""

    x: float
    y: float
    kind: str
    size: float  # m
    title: str


def _svg(box: tuple[float, float, float, float], body: str, name: str) -> str:
    """y is up in the world and down on a screen, so everything is drawn at -y."""
    x, y, w, h = box
    return (
        f'<svg role="img" aria-label="{escape(name)}" viewBox="{x:.1f} {-y - h:.1f} {w:.1f} {h:.1f}" '
        f'style="width:100%;max-height:70vh;background:#0d1014">{body}</svg>'
    )


def map_svg(lines: Sequence[Line], dots: Sequence[Dot], name: str) -> str:
    """Roads and hazards from above."""
    points = [p for line in lines for p in line] or [(d.x, d.y) for d in dots] or [(0.0, 0.0)]
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    box = min(xs) - 30, min(ys) - 30, max(xs) - min(xs) + 60, max(ys) - min(ys) + 60
    roads = _roads(lines)
    least = max(box[2], box[3]) / 120.0
    marks = "".join(
        f'<circle cx="{d.x:.1f}" cy="{-d.y:.1f}" r="{max(d.size, least):.1f}" fill-opacity=".75" '
        f'fill="{KINDS.get(d.kind, "#fff")}"><title>{escape(d.title)}</title></circle>'
        for d in dots
    )
    return _svg(box, roads + marks, name)


def _roads(lines: Sequence[Line]) -> str:
    return "".join(
        f'<polyline points="{_points(line)}" fill="none" stroke="#39434f" stroke-width="3"/>'
        for line in lines[:LINES_MAX]
    )


def _points(line: Line) -> str:
    return " ".join(f"{x:.1f},{-y:.1f}" for x, y in line)


def scene_svg(ego: Body, objects: Iterable[Body], name: str) -> str:
    """What a vehicle showed at the moment of its alert."""
    body = "".join(_body(o, "#9aa5b1") for o in objects) + _body(ego, COLOURS[0])
    return _svg((ego.x - REACH, ego.y - REACH, 2 * REACH, 2 * REACH), body, name)


def _body(o: Body, colour: str) -> str:
    c, s = cos(o.heading), sin(o.heading)
    corners = [
        (o.x + i * o.length / 2 * c - j * o.width / 2 * s, o.y + i * o.length / 2 * s + j * o.width / 2 * c)
        for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]  # fmt: skip
    return f'<polygon points="{_points(corners)}" fill="{colour}"/>'


def near(lines: Iterable[Line], x: float, y: float) -> list[Line]:
    """Those lines that come within sight of a place for as long as a record lasts."""
    return [
        line
        for line in lines
        if min(px for px, _ in line) < x + AROUND
        and max(px for px, _ in line) > x - AROUND
        and min(py for _, py in line) < y + AROUND
        and max(py for _, py in line) > y - AROUND
    ]


def replay_svg(record: HazardRecord, k: int, roads: Sequence[Line] = ()) -> str:
    """Cycle k of a hazard's record, every channel's world over the others and over the roads."""
    cycle = record.worlds[k]
    known = [f for f in cycle.frames if f is not None]
    if not known:
        return _svg((0.0, 0.0, 1.0, 1.0), "", "nothing reported")
    x, y = known[0].ego[:2].tolist()
    body = _roads(roads) + "".join(
        _frame(frame, COLOURS[c % len(COLOURS)])
        for c, frame in enumerate(cycle.frames)
        if frame is not None
    )
    name = f"hazard {record.type.value} at {cycle.t:.1f} s"
    return _svg((x - REACH, y - REACH, 2 * REACH, 2 * REACH), body, name)


def _frame(frame: ChannelFrame, colour: str) -> str:
    plan = [(float(p[0]), float(p[1])) for p in frame.plan if isfinite(p[0]) and isfinite(p[1])]
    path = (
        f'<polyline points="{_points(plan)}" fill="none" stroke="{colour}" stroke-dasharray="2 2"/>'
    )
    shapes = []
    for state, corners, n in zip(frame.objects, frame.polygons, frame.polygon_size, strict=True):
        shapes.append(_shape(state[:3].tolist(), corners[: int(n)].tolist(), colour, ".35"))
    shapes.append(_shape(frame.ego[:3].tolist(), frame.ego_polygon.tolist(), colour, ".9"))
    return path + "".join(shapes)


def _shape(pose: list[float], corners: list[list[float]], colour: str, opacity: str) -> str:
    x, y, h = pose
    c, s = cos(h), sin(h)
    world = [(x + px * c - py * s, y + px * s + py * c) for px, py in corners]
    if not all(isfinite(v) for point in world for v in point):
        return ""
    return f'<polygon points="{_points(world)}" fill="{colour}" fill-opacity="{opacity}"/>'


def trend_svg(trends: Sequence[Trend], name: str) -> str:
    """Share of cycles in violation over time, with its interval as a band."""
    top = max([0.01, *(t.interval.high for t in trends)])
    n = max(len(trends) - 1, 1)
    at = [(100.0 * i / n, t) for i, t in enumerate(trends)]
    if len(at) == 1:
        at = [(0.0, trends[0]), (100.0, trends[0])]
    band = [(x, 30 * t.interval.high / top) for x, t in at]
    band += [(x, 30 * t.interval.low / top) for x, t in reversed(at)]
    line = [(x, 30 * t.share / top) for x, t in at]
    body = (
        f'<polygon points="{_points(band)}" fill="#4d9dff" fill-opacity=".3"/>'
        f'<polyline points="{_points(line)}" fill="none" stroke="#4d9dff"/>'
    )
    return _svg((-2.0, -2.0, 104.0, 34.0), body, name)
