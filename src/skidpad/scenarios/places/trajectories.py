"""Trajectories of a file: shapes compiled to lines, at once or when an action begins."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from lxml import etree

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.lines import Line, Vertex, clothoid, even_knots, nurbs
from skidpad.scenarios.movement.network import Place
from skidpad.scenarios.places.positions import Fixed, Orientation, Position, orientation, position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import Scene

CLOTHOIDS = ("Clothoid", "ClothoidSpline")  # the place of one says how the line begins
Shape = Callable[[Sequence[Pose]], list[Vertex]]
ORIGIN = Pose(0.0, 0.0)
KNOT_MAX, WEIGHT_MAX = 1e9, 1e9  # of splines, so that their sums are numbers


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A line, or places that depend on what moves and how they make one when it is begun."""

    name: str
    closed: bool
    line: Line | None
    places: tuple[Position, ...] = ()
    shape: Shape | None = None
    from_here: bool = False  # it begins where the entity is that follows it
    tangential: bool = False  # its headings are those of the line

    def trace(self, scene: Scene, here: Pose = ORIGIN) -> Line:
        """Returns the line as things are now, for an entity that is here."""
        if self.line is not None or self.shape is None:
            return self.line or Line([Vertex(0.0, 0.0, 0.0)])
        poses = [p.place(scene).pose for p in self.places]
        vertices = self.shape([here, *poses] if self.from_here else poses)
        return Line(vertices, closed=self.closed, tangential=self.tangential)


def compile_trajectory(node: Node, ctx: Context) -> Trajectory:
    """Compiles a <Trajectory>, or a reference to one; its line at once where nothing in it moves."""
    node = ctx.catalogs.resolve(node, "Trajectory")
    closed = node.flag("closed", default=False)
    shape = node.child("Shape").only()
    name = node.label()
    if shape.tag == "Polyline":
        quick = [_plain_vertex(v) for v in shape.element.iterchildren("Vertex")]
        known = [v for v in quick if v is not None]
        heights = len(shape.element.findall("Vertex/Position/WorldPosition[@z]"))
        if known and len(known) == len(quick) and heights in (0, len(known)):
            _check_times(shape, [v.time for v in known])
            return Trajectory(name, closed, Line(known, closed=closed))
    nodes, make = shape.choose(SHAPES)(shape)
    places = tuple(_place(n, ctx) for n in nodes)
    fixed = [p.fixed.pose for p in places if isinstance(p, Fixed)]
    from_here = shape.tag == "ClothoidSpline" and not _begins(next(shape.children()))
    trajectory = Trajectory(
        name, closed, None, places, make, from_here, tangential=shape.tag in CLOTHOIDS
    )
    if len(fixed) < len(places) or from_here:
        return trajectory
    line = Line(make(fixed), closed=closed, tangential=trajectory.tangential)
    return replace(trajectory, line=line)


@dataclass(frozen=True, slots=True)
class Raised:
    """A place at a height of its own: z in m, above an entity's where there is one."""

    ground: Position
    z: float
    other: str | None

    def place(self, scene: Scene) -> Place:
        """Returns the place where it is now, at its height."""
        place = self.ground.place(scene)
        below = 0.0 if self.other is None else scene.actors[self.other].pose.z
        return replace(place, pose=replace(place.pose, z=below + self.z))


def _place(node: Node, ctx: Context) -> Position:
    """Compiles the <Position> of a point of a line, at the height that it says."""
    ground, said = position(node, ctx), node.only()
    if not _has_height(said):
        return ground
    if said.tag != "WorldPosition":
        return Raised(ground, said.number("dz"), ctx.entity(said))
    assert isinstance(ground, Fixed)
    pose = replace(ground.fixed.pose, z=said.number("z"))
    return Fixed(replace(ground.fixed, pose=pose))


def _has_height(place: Node) -> bool:
    """Returns whether a position says its height itself; else it is that of the road."""
    return place.has("z" if place.tag == "WorldPosition" else "dz")


def _check_times(shape: Node, times: Sequence[float | None]) -> None:
    """Raises a Fault unless vertices or control points stand in the order of their times."""
    if any(a is not None and b is not None and b < a for a, b in pairwise(times)):
        what = "control points" if shape.tag == "Nurbs" else "vertices"
        raise shape.error(f"the times of its {what} must not fall")


def _polyline(shape: Node) -> tuple[list[Node], Shape]:
    """Returns the position nodes of a polyline and the function that makes its vertices from their poses."""
    nodes = list(shape.children("Vertex"))
    if not nodes:
        raise shape.error("needs at least one <Vertex>")
    times = [n.number("time") if n.has("time") else None for n in nodes]
    places = [n.child("Position") for n in nodes]
    named = [_has_heading(p.only()) for p in places]
    rises = [_has_height(p.only()) for p in places]
    climbs = [a or b for a, b in zip(rises, [*rises[1:], False], strict=True)]
    tilts = [_tilt(p.only(), climb) for p, climb in zip(places, climbs, strict=True)]
    _check_times(shape, times)

    def make(poses: Sequence[Pose]) -> list[Vertex]:
        rows = zip(poses, named, times, tilts, strict=True)
        return [Vertex(p.x, p.y, p.z, p.yaw if n else None, t, *tilt) for p, n, t, tilt in rows]

    return places, make


def _tilt(place: Node, climbs: bool) -> tuple[float | None, float]:
    """Returns pitch and roll in the world that a vertex asks for, rad; 0 where it says nothing.

    climbs: its height or the next one's is said, so that a pitch that is not said is the line's, None.
    """
    said = place if place.tag == "WorldPosition" else place.find("Orientation")
    if climbs and (said is None or not said.has("p")):
        return None, 0.0 if said is None else wrap_angle(said.number("r", 0.0))
    if said is None:
        return 0.0, 0.0
    return wrap_angle(said.number("p", 0.0)), wrap_angle(said.number("r", 0.0))


def _has_heading(place: Node) -> bool:
    """Returns whether a vertex says how an entity looks there; else it looks along the line."""
    return place.has("h") if place.tag == "WorldPosition" else place.find("Orientation") is not None


def _plain_vertex(element: etree._Element) -> Vertex | None:
    """Returns a vertex in coordinates of the world without parameters; None for any other.

    A quick reader, as files have ten thousands of them.
    """
    if len(element) != 1 or len(element[0]) != 1 or element[0][0].tag != "WorldPosition":
        return None
    place = element[0][0].attrib
    try:
        h, t, z = place.get("h"), element.get("time"), place.get("z")
        pitch, roll = float(place.get("p", 0.0)), float(place.get("r", 0.0))
        values = Vertex(
            float(place["x"]),
            float(place["y"]),
            float(z or 0.0),
            None if h is None else float(h),
            None if t is None else float(t),
            wrap_angle(pitch) if z is None or "p" in place else None,
            wrap_angle(roll),
        )
    except (KeyError, ValueError):
        return None  # read again with care, which names what is wrong
    total = (
        values.x
        + values.y
        + values.z
        + (values.heading or 0.0)
        + (values.time or 0.0)
        + pitch
        + roll
    )
    return values if abs(total) < float("inf") else None


def _clothoid(shape: Node) -> tuple[list[Node], Shape]:
    """Returns the position node of a clothoid and the function that makes its vertices from that pose."""
    rate = shape.number("curvatureDot", 0.0)  # the name before 1.1
    times = None
    if shape.has("startTime") and shape.has("stopTime"):
        times = shape.number("startTime"), shape.number("stopTime")
    curvature, length = shape.number("curvature"), shape.number("length")
    prime = shape.number("curvaturePrime", rate)
    return [shape.child("Position")], lambda p: clothoid(p[0], curvature, prime, length, times)


@dataclass(frozen=True, slots=True)
class Segment:
    """One piece of a spline of clothoids; begins: a place of its own, else the end before it."""

    begins: bool
    turn: float
    curvatures: tuple[float, float]
    length: float
    times: tuple[float, float] | None


def _spline(shape: Node) -> tuple[list[Node], Shape]:
    """Returns a clothoid spline's position nodes and the function that makes vertices of their poses."""
    nodes = list(shape.children("ClothoidSplineSegment", "Segment"))
    if not nodes:
        raise shape.error("needs a <ClothoidSplineSegment>")
    starts = [n.number("timeStart") if n.has("timeStart") else None for n in nodes]
    end = shape.number("timeEnd") if shape.has("timeEnd") else None
    segments: list[Segment] = []
    for node, t0, t1 in zip(nodes, starts, [*starts[1:], end], strict=True):
        curvatures = node.number("curvatureStart"), node.number("curvatureEnd")
        times = None if t0 is None or t1 is None else (t0, t1)
        begins = not segments or _begins(node)
        turn, length = node.number("hOffset", 0.0), node.number("length")
        segments.append(Segment(begins, turn, curvatures, length, times))
    places = [p for n in nodes if (p := n.find("PositionStart")) is not None]
    return places, lambda poses: list(_join_segments(segments, poses))


def _begins(segment: Node) -> bool:
    """Returns whether a piece has a place of its own; the first one else begins where the entity is.

    As in esmini.
    """
    return segment.find("PositionStart") is not None


def _join_segments(segments: Sequence[Segment], poses: Sequence[Pose]) -> Iterator[Vertex]:
    """Yields the vertices of all segments; one without a position of its own begins at the last one's end."""
    own = iter(poses)
    pose = poses[0]
    for segment in segments:
        if segment.begins:
            pose = next(own)
        k0, k1 = segment.curvatures
        rate = (k1 - k0) / max(segment.length, 1e-9)
        turned = replace(pose, yaw=pose.yaw + segment.turn)
        points = clothoid(turned, k0, rate, segment.length, segment.times)
        yield from points
        last = points[-1]
        pose = Pose(last.x, last.y, last.z, yaw=last.heading or 0.0)


def _nurbs(shape: Node) -> tuple[list[Node], Shape]:
    """Returns a NURBS curve's position nodes and the function that makes vertices of their poses."""
    order = shape.whole("order")
    nodes = list(shape.children("ControlPoint"))
    times = [n.number("time") if n.has("time") else None for n in nodes]
    _check_times(shape, times)
    weights = [n.number("weight", 1.0) for n in nodes]
    knots = [k.number("value") for k in shape.children("Knot")]
    if order < 2 or len(nodes) < order:
        raise shape.error(f"order {order} needs at least {max(order, 2)} control points")
    knots = knots or even_knots(order, len(nodes))
    if len(knots) != len(nodes) + order or any(b < a for a, b in pairwise(knots)):
        raise shape.error(f"needs {len(nodes) + order} knots that do not fall, got {len(knots)}")
    if not knots[order - 1] < knots[len(nodes)]:
        raise shape.error("its knots leave no curve")
    if any(a == b for a, b in zip(knots, knots[order:], strict=False)):
        raise shape.error(f"a knot may stand {order} times, as the order says, not more often")
    if max(abs(knots[0]), abs(knots[-1])) > KNOT_MAX:
        raise shape.error(f"knots must be between -{KNOT_MAX:g} and {KNOT_MAX:g}")
    if not all(1.0 / WEIGHT_MAX <= w <= WEIGHT_MAX for w in weights):
        raise shape.error(f"weights must be between {1.0 / WEIGHT_MAX:g} and {WEIGHT_MAX:g}")

    places = [n.child("Position") for n in nodes]
    pitch = None if all(_has_height(p.only()) for p in places) else 0.0

    def make(poses: Sequence[Pose]) -> list[Vertex]:
        rows = zip(poses, times, strict=True)
        points = [Vertex(p.x, p.y, p.z, None, t, pitch) for p, t in rows]
        return nurbs(order, points, weights, knots)

    return places, make


SHAPES: Mapping[str, Callable[[Node], tuple[list[Node], Shape]]] = {
    "Polyline": _polyline,
    "Clothoid": _clothoid,
    "ClothoidSpline": _spline,
    "Nurbs": _nurbs,
}


@dataclass(frozen=True, slots=True)
class OnTrajectory:
    """A place along a trajectory, and to the left of it."""

    trajectory: Trajectory
    s: float
    t: float
    facing: Orientation

    def place(self, scene: Scene) -> Place:
        """Returns the place on the line as it is now; left of the way that the line runs."""
        line = self.trajectory.trace(scene)
        pose = line.at_length(self.s)
        tangent = line.tangent(self.s)
        spot = replace(pose, yaw=tangent).moved(left=self.t)
        facing = self.facing.to_world_heading(tangent)
        return scene.network.place_of(replace(spot, yaw=facing))


def trajectory_position(node: Node, ctx: Context) -> Position:
    """Compiles a <TrajectoryPosition> with s and t in m from its trajectory."""
    trajectory = compile_trajectory(node.child("TrajectoryRef").only(), ctx)
    s, t = node.number("s"), node.number("t", 0.0)
    return OnTrajectory(trajectory, s, t, orientation(node))
