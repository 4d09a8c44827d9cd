"""Small pictures as SVG: a map with hazards, a scene from above, a replay; and their legends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from html import escape
from math import cos, floor, hypot, isfinite, log10, sin

from skidpad.core.channels import ChannelFrame
from skidpad.fleet.alerting.keeping import Body
from skidpad.recording.hazards.records import HazardRecord

Line = Sequence[tuple[float, float]]  # m
MapLines = Callable[[str], Sequence[Line]]  # roads of a map by its name
COLOURS = ("#ff8552", "#4d9dff", "#4fce7f", "#d98cff")  # of channels
KINDS = {
    "ego_tailgating": "#ff8552", "ego_tailgated": "#ffd166", "inconsistent_localisation": "#4d9dff",
    "crossing_object": "#d98cff", "conflicting_paths": "#4fce7f", "stuck_vehicle": "#ff5b52",
    "unseen_by_a_channel": "#8fe3ff",
}  # fmt: skip
HAZARD = "#ff5b52"
REACH = 60.0  # m around the ego
AROUND = REACH + 300.0  # m: ten seconds at 30 m/s and what is seen from there
LINES_MAX = 4000  # of a map


@dataclass(frozen=True, slots=True)
class Dot:
    """A mark on a map."""

    x: float
    y: float
    kind: str
    title: str
    count: int = 1  # hazards that it stands for; more than one are drawn as a ring


def _svg(box: tuple[float, float, float, float], body: str, name: str) -> str:
    """Returns an SVG element of a box (x, y, width, height) in m; what is in it is drawn at -y."""
    x, y, w, h = box
    return (
        f'<svg role="img" aria-label="{escape(name)}" viewBox="{x:.1f} {-y - h:.1f} {w:.1f} {h:.1f}" '
        f'style="width:100%;max-height:70vh;background:#0d1014">{body}</svg>'
    )


def map_svg(lines: Sequence[Line], dots: Sequence[Dot], name: str) -> str:
    """Returns an SVG of roads and marks from above, with a scale."""
    points = [p for line in lines for p in line] or [(d.x, d.y) for d in dots] or [(0.0, 0.0)]
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    box = min(xs) - 30, min(ys) - 30, max(xs) - min(xs) + 60, max(ys) - min(ys) + 60
    roads = _roads(lines)
    least = max(box[2], box[3]) / 200.0
    marks = "".join(_mark(d, least) for d in sorted(dots, key=lambda d: -d.count))
    return _svg(box, roads + marks + _scale(box), name)


def _mark(dot: Dot, least: float) -> str:
    """Returns the SVG of a mark: a disc for one hazard, a ring for those that recur.

    least: radius of the disc in m.
    """
    colour, ring = KINDS.get(dot.kind, "#fff"), dot.count > 1
    radius = least * (min(2.0 + 0.5 * dot.count**0.5, 6.0) if ring else 1.0)
    paint = (
        f'fill="none" stroke="{colour}" stroke-width="{0.6 * least:.2f}"'
        if ring
        else f'fill="{colour}"'
    )
    return (
        f'<circle cx="{dot.x:.1f}" cy="{-dot.y:.1f}" r="{radius:.2f}" {paint}>'
        f"<title>{escape(dot.title)}</title></circle>"
    )


def scale_m(width: float) -> float:
    """Returns the length in m of the scale's bar, 1, 2 or 5 times a power of ten, at most a quarter.

    width: of the picture, m.
    """
    decade = 10.0 ** floor(log10(width / 4.0))
    return max(k * decade for k in (1.0, 2.0, 5.0) if k * decade <= width / 4.0)


def _scale(box: tuple[float, float, float, float]) -> str:
    """Returns the SVG of the scale's bar at the lower left of a box, with its length."""
    x, y, w, h = box
    bar, size = scale_m(w), max(w, h) / 40.0
    left, low = x + size, -y - size
    return (
        f'<path d="M{left:.1f} {low:.1f}h{bar:g}" stroke="#e8eaed" stroke-width="{size / 5:.2f}"/>'
        f'<text x="{left:.1f}" y="{low - size / 2:.1f}" font-size="{size:.1f}" fill="#e8eaed">'
        f"{bar:g} m</text>"
    )


def legend_html(entries: Iterable[tuple[str, str]]) -> str:
    """Returns the HTML of names with their colours, in a line that wraps; entries: (name, colour)."""
    return "".join(
        f'<span style="display:inline-block;margin-right:14px"><span style="color:{colour}">'
        f"&#9632;</span> {escape(name)}</span>"
        for name, colour in entries
    )


def kinds_legend(dots: Sequence[Dot]) -> str:
    """Returns the legend of a map: the kinds that are on it, and what a ring is."""
    kinds = sorted({d.kind for d in dots})
    named = legend_html((kind.replace("_", " "), KINDS.get(kind, "#fff")) for kind in kinds)
    return named + legend_html([("disc: one hazard; ring: a hazard that recurs", "#9aa5b1")])


def replay_legend(record: HazardRecord) -> str:
    """Returns the legend of a replay: a colour for each channel, and what marks the hazard."""
    named = [(f"channel {c}", COLOURS[i % len(COLOURS)]) for i, c in enumerate(record.channels)]
    return legend_html(
        [*named, ("solid: the vehicle itself; pale: what it reported; dashes: plan", "#9aa5b1"),
         ("circle: what the hazard is about", HAZARD)]
    )  # fmt: skip


def _roads(lines: Sequence[Line]) -> str:
    """Returns SVG polylines of at most LINES_MAX lines of roads."""
    return "".join(
        f'<polyline points="{_points(line)}" fill="none" stroke="#39434f" stroke-width="3"/>'
        for line in lines[:LINES_MAX]
    )


def _points(line: Line) -> str:
    """Returns points in m as the text of an SVG attribute, y pointing down."""
    return " ".join(f"{x:.1f},{-y:.1f}" for x, y in line)


def scene_svg(ego: Body, objects: Sequence[Body], name: str, roads: Sequence[Line] = ()) -> str:
    """Returns an SVG of what a vehicle showed with its alert: roads, itself, others, the nearest marked."""
    box = ego.x - REACH, ego.y - REACH, 2 * REACH, 2 * REACH
    body = _roads(roads) + "".join(_body(o, "#9aa5b1") for o in objects) + _body(ego, COLOURS[0])
    nose = ego.length / 2 * cos(ego.heading), ego.length / 2 * sin(ego.heading)
    way = (ego.x + nose[0], ego.y + nose[1]), (ego.x + 5 * nose[0], ego.y + 5 * nose[1])
    body += f'<polyline points="{_points(way)}" stroke="{COLOURS[0]}" stroke-width="0.8"/>'
    if (nearest := nearest_of(ego, objects)) is not None:
        body += (
            f'<circle class="hazard" cx="{nearest.x:.1f}" cy="{-nearest.y:.1f}" r="5" fill="none" '
            f'stroke="{HAZARD}" stroke-width=".7"/>'
        )
    return _svg(box, body + _scale(box), name)


def nearest_of(ego: Body, objects: Iterable[Body]) -> Body | None:
    """Returns the object whose centre is nearest to the ego's; None when it showed none."""
    return min(objects, key=lambda o: hypot(o.x - ego.x, o.y - ego.y), default=None)


def scene_text(ego: Body, objects: Iterable[Body]) -> str:
    """Returns in words where the nearest object is, by centres and the ego's heading."""
    nearest = nearest_of(ego, objects)
    if nearest is None:
        return "no other object was shown"
    x, y = nearest.x - ego.x, nearest.y - ego.y
    ahead = x * cos(ego.heading) + y * sin(ego.heading)
    left = y * cos(ego.heading) - x * sin(ego.heading)
    along = f"{abs(ahead):.1f} m {'ahead' if ahead >= 0.0 else 'behind'}"
    return f"nearest object: {along}, {abs(left):.1f} m to the {'left' if left >= 0.0 else 'right'}"


def scene_legend() -> str:
    """Returns the legend of an alert's scene."""
    return legend_html(
        [("the vehicle; the line is its heading", COLOURS[0]), ("what it showed", "#9aa5b1"),
         ("circle: the nearest", HAZARD)]
    )  # fmt: skip


def _body(o: Body, colour: str) -> str:
    """Returns the SVG polygon of a body's box, in m with y down."""
    c, s = cos(o.heading), sin(o.heading)
    corners = [
        (o.x + i * o.length / 2 * c - j * o.width / 2 * s, o.y + i * o.length / 2 * s + j * o.width / 2 * c)
        for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]  # fmt: skip
    return f'<polygon points="{_points(corners)}" fill="{colour}"/>'


def near(lines: Iterable[Line], x: float, y: float) -> list[Line]:
    """Returns the lines whose box comes within AROUND m of a place, what a record can show of it."""
    return [
        line
        for line in lines
        if min(px for px, _ in line) < x + AROUND
        and max(px for px, _ in line) > x - AROUND
        and min(py for _, py in line) < y + AROUND
        and max(py for _, py in line) > y - AROUND
    ]


def replay_svg(record: HazardRecord, k: int, roads: Sequence[Line] = ()) -> str:
    """Returns an SVG of cycle k of a record: every channel's world over the others and over the roads."""
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
    box = x - REACH, y - REACH, 2 * REACH, 2 * REACH
    return _svg(box, body + _involved_objects(record, k) + _scale(box), name)


def _involved_objects(record: HazardRecord, k: int) -> str:
    """Returns SVG circles around the objects that the hazard is about, where cycle k has them.

    Dashed while the hazard is not there.
    """
    cycle, places = record.worlds[k], []
    for one in record.objects:
        at = record.channels.index(one.channel) if one.channel in record.channels else None
        frame = None if at is None else cycle.frames[at]
        if frame is None or one.id is None or one.id < 0:
            continue
        places += frame.objects[frame.ids == one.id, :2].tolist()
    is_now = record.t_start <= cycle.t <= record.t_end
    dashes = "" if is_now else ' stroke-dasharray="1.5 1.5"'
    return "".join(
        f'<circle class="hazard" cx="{x:.1f}" cy="{-y:.1f}" r="5" fill="none" stroke="{HAZARD}" '
        f'stroke-width=".7"{dashes}/>'
        for x, y in dict.fromkeys((x, y) for x, y in places if isfinite(x) and isfinite(y))
    )


def moment_text(record: HazardRecord, k: int) -> str:
    """Returns where cycle k lies in time, and whether the hazard is there then."""
    t = record.worlds[k].t
    when = "before" if t < record.t_start else "after" if t > record.t_end else "during"
    lasts = f"{record.t_start:.1f} to {record.t_end:.1f} s"
    return f"{t:.1f} s: {when} the hazard ({lasts}, worst at {record.t_worst:.1f} s)"


def _frame(frame: ChannelFrame, colour: str) -> str:
    """Returns the SVG of a frame: plan, objects and ego in one colour."""
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
    """Returns the SVG polygon of corners around a pose (x, y, heading); "" where not finite."""
    x, y, h = pose
    c, s = cos(h), sin(h)
    world = [(x + px * c - py * s, y + px * s + py * c) for px, py in corners]
    if not all(isfinite(v) for point in world for v in point):
        return ""
    return f'<polygon points="{_points(world)}" fill="{colour}" fill-opacity="{opacity}"/>'
