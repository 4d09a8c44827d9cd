"""OpenDRIVE text to plain records. Every problem is a FileError that names file and element."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from skidpad.roads.opendrive.reader import Node, Reader, Shift, parse_root
from skidpad.roads.opendrive.reference_line import (
    Clothoid,
    Cubics,
    Element,
    Parametric,
    ReferenceLine,
    poly3_shape,
)

LONGEST = 1e6  # m; a longer road or piece of one is a mistake or an attack


@dataclass(frozen=True, slots=True)
class LaneRecord:
    """One lane of one section."""

    id: int
    type: str
    width: Cubics | None  # by s from the section's start
    border: Cubics | None  # instead of widths
    predecessor: int | None
    successor: int | None
    marks: tuple[tuple[float, str], ...]  # (s from the section's start, road mark type)
    speeds: tuple[tuple[float, float], ...]  # (s from the section's start, m/s)


@dataclass(frozen=True, slots=True)
class SectionRecord:
    """A lane section from s_start to s_end."""

    s_start: float
    s_end: float
    lanes: tuple[LaneRecord, ...]  # left to right, the centre lane with id 0 included


@dataclass(frozen=True, slots=True)
class Link:
    """Where a road goes on."""

    target: int
    junction: bool
    at_start: bool  # contact point on the target road


@dataclass(frozen=True, slots=True)
class RoadRecord:
    """One `<road>` of an OpenDRIVE file."""

    id: int
    label: str  # the id as the file writes it
    junction: int  # -1: none
    length: float
    left_hand: bool  # left-hand traffic
    line: ReferenceLine
    elevation: Cubics
    superelevation: Cubics
    lane_offset: Cubics
    sections: tuple[SectionRecord, ...]
    predecessor: Link | None
    successor: Link | None
    speeds: tuple[tuple[float, float], ...]  # (s, m/s) of the road's type records
    signals: tuple[Node, ...]  # <signal>
    references: tuple[Node, ...]  # <signalReference>
    objects: tuple[Node, ...]  # <object>
    bridges: tuple[Node, ...]  # <bridge>


@dataclass(frozen=True, slots=True)
class ConnectionRecord:
    """A way through a junction."""

    incoming: int
    connecting: int
    at_start: bool
    lanes: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Document:
    """The records of a whole OpenDRIVE file."""

    file: str
    roads: dict[int, RoadRecord]
    junctions: dict[int, tuple[ConnectionRecord, ...]]
    controllers: dict[int, int]  # controller by signal
    geo_reference: str = ""
    user_data: dict[str, str] = field(default_factory=dict)  # of the header


def parse(text: bytes, file: str) -> Document:
    """Returns the records of an OpenDRIVE file; FileError, naming `file`, for a faulty one."""
    root = parse_root(text, file)
    read = Reader(file, _shift(Reader(file), root.find("header/offset")))
    roads: dict[int, RoadRecord] = {}
    for node in root.findall("road"):
        road = _road(read, node)
        if road.id in roads:
            raise read.fail(node, "occurs twice")
        roads[road.id] = road
    return Document(
        file=file,
        roads=roads,
        junctions={read.id(n): _connections(read, n) for n in root.findall("junction")},
        controllers={
            read.id(c, "signalId"): read.id(n)
            for n in root.findall("controller")
            for c in n.findall("control")
        },
        geo_reference=(root.findtext("header/geoReference") or "").strip(),
        user_data={n.get("code", ""): n.get("value", "") for n in root.findall("header/userData")},
    )


def _shift(read: Reader, node: Node | None) -> Shift:
    """Returns the offset (m) and turn (rad) of the map; zeros where the node is None."""
    if node is None:
        return Shift()
    x, y, z, heading = (read.number(node, name, 0.0) for name in ("x", "y", "z", "hdg"))
    return Shift(x, y, z, heading)


def _road(read: Reader, node: Node) -> RoadRecord:
    """Returns the record of a road; raises an error without length, geometry or lane section."""
    length = _length(read, node)
    if length <= 0.0:
        raise read.fail(node, f"needs a positive length, got {length}")
    elements = [_element(read, n) for n in node.findall("planView/geometry")]
    elements = [e for e in elements if e.length > 0.0]
    if not elements:
        raise read.fail(node, "has no geometry")
    speeds = [
        (read.number(t, "s"), v)
        for t in node.findall("type")
        for n in t.findall("speed")
        if (v := read.speed(n)) is not None
    ]
    return RoadRecord(
        id=read.id(node),
        label=str(node.get("id")),
        junction=read.id(node, "junction", "-1"),
        length=length,
        left_hand=node.get("rule", "RHT") == "LHT",
        line=ReferenceLine(sorted(elements, key=lambda e: e.s)),
        elevation=_raise_elevation(read, read.cubics(node.findall("elevationProfile/elevation"))),
        superelevation=read.cubics(node.findall("lateralProfile/superelevation")),
        lane_offset=read.cubics(node.findall("lanes/laneOffset")),
        sections=_sections(read, node, length),
        predecessor=_link(read, node.find("link/predecessor")),
        successor=_link(read, node.find("link/successor")),
        speeds=tuple(sorted(speeds)),
        signals=tuple(node.findall("signals/signal")),
        references=tuple(node.findall("signals/signalReference")),
        objects=tuple(node.findall("objects/object")),
        bridges=tuple(node.findall("objects/bridge")),
    )


def _raise_elevation(read: Reader, elevation: Cubics) -> Cubics:
    """Returns the elevation lifted by the z in m of the map's offset."""
    lift = np.array([read.shift.z, 0.0, 0.0, 0.0])
    return Cubics(elevation.start, elevation.coefficients + lift)


def _length(read: Reader, node: Node) -> float:
    """Returns a length in m; raises an error for one above LONGEST."""
    length = read.number(node, "length")
    if length > LONGEST:
        raise read.fail(node, f"is {length:g} m long; at most {LONGEST:g} m")
    return length


def _element(read: Reader, node: Node) -> Element:
    """Returns a piece of the reference line in the shifted frame; raises an error for an unknown shape."""
    length = _length(read, node)
    shape: Clothoid | Parametric
    child = next((c for c in node if isinstance(c.tag, str) and c.tag != "userData"), None)
    match None if child is None else child.tag:
        case "line":
            shape = Clothoid(0.0, 0.0)
        case "arc":
            curvature = read.number(child, "curvature")
            shape = Clothoid(curvature, curvature)
        case "spiral":
            shape = Clothoid(read.number(child, "curvStart"), read.number(child, "curvEnd"))
        case "poly3":
            a, b, c, d = (read.number(child, k) for k in "abcd")
            shape = poly3_shape((a, b, c, d), length)
        case "paramPoly3":
            u = tuple(read.number(child, f"{k}U") for k in "abcd")
            v = tuple(read.number(child, f"{k}V") for k in "abcd")
            p_end = length if node.xpath("string(paramPoly3/@pRange)") == "arcLength" else 1.0
            shape = Parametric(u, v, p_end)  # type: ignore[arg-type]
        case tag:
            raise read.fail(
                node, f"needs line, arc, spiral, poly3 or paramPoly3, got {tag or 'nothing'}"
            )
    s, x, y, heading = (read.number(node, k) for k in ("s", "x", "y", "hdg"))
    return Element(s, *read.shift.apply(x, y), heading + read.shift.heading, length, shape)


def _sections(read: Reader, road: Node, length: float) -> tuple[SectionRecord, ...]:
    """Returns the lane sections of a road by s, each up to the next one's begin or the road's end."""
    nodes = sorted(road.findall("lanes/laneSection"), key=lambda n: read.number(n, "s"))
    if not nodes:
        raise read.fail(road, "has no lane section")
    starts = [*(read.number(n, "s") for n in nodes), length]
    return tuple(
        SectionRecord(s0, s1, _lanes(read, node))
        for node, s0, s1 in zip(nodes, starts[:-1], starts[1:], strict=True)
    )


def _lanes(read: Reader, section: Node) -> tuple[LaneRecord, ...]:
    """Returns all lanes of a section from left to right, the centre lane included."""
    lanes = [
        _lane(read, node)
        for side in ("left", "center", "right")
        for node in section.findall(f"{side}/lane")
    ]
    return tuple(sorted(lanes, key=lambda lane: -lane.id))


def _lane(read: Reader, node: Node) -> LaneRecord:
    """Returns the record of a lane; width, border and links are None where the file lacks them."""
    widths, borders = node.findall("width"), node.findall("border")
    ends = [node.find(f"link/{end}") for end in ("predecessor", "successor")]
    speeds = [
        (read.number(n, "sOffset"), v)
        for n in node.findall("speed")
        if (v := read.speed(n)) is not None
    ]
    return LaneRecord(
        id=read.integer(node, "id"),
        type=node.get("type", "none"),
        width=read.cubics(widths, "sOffset") if widths else None,
        border=read.cubics(borders, "sOffset") if borders else None,
        predecessor=None if ends[0] is None else read.integer(ends[0], "id"),
        successor=None if ends[1] is None else read.integer(ends[1], "id"),
        marks=tuple(
            sorted(
                (read.number(n, "sOffset", 0.0), n.get("type", "none"))
                for n in node.findall("roadMark")
            )
        ),
        speeds=tuple(sorted(speeds)),
    )


def _link(read: Reader, node: Node | None) -> Link | None:
    """Returns a road's link to a road or a junction; None where the node is None."""
    if node is None:
        return None
    return Link(
        target=read.id(node, "elementId"),
        junction=node.get("elementType") == "junction",
        at_start=node.get("contactPoint", "start") == "start",
    )


def _connections(read: Reader, junction: Node) -> tuple[ConnectionRecord, ...]:
    """Returns the connections of a junction that name both an incoming and a connecting road."""
    return tuple(
        ConnectionRecord(
            incoming=read.id(node, "incomingRoad"),
            connecting=read.id(node, _leads_to(node)),
            at_start=node.get("contactPoint", "start") == "start",
            lanes=tuple(
                (read.integer(n, "from"), read.integer(n, "to")) for n in node.findall("laneLink")
            ),
        )
        for node in junction.findall("connection")
        if node.get("incomingRoad") is not None and node.get(_leads_to(node)) is not None
    )


def _leads_to(connection: Node) -> str:
    """Returns the name of the attribute of a connection that names the road it leads to.

    "linkedRoad" at direct junctions, which have no roads of their own, else "connectingRoad".
    """
    return "linkedRoad" if connection.get("linkedRoad") is not None else "connectingRoad"
