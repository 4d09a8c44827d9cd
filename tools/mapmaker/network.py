"""Writing roads with scenariogeneration: lanes, links, junctions, objects, with ids of our choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import tostring

from lxml import etree
from scenariogeneration import xodr

from mapmaker.paths import Banks, Heights, cut
from skidpad.roads.opendrive.reference_line import Clothoid, Element

GEO_REFERENCE = (
    "+proj=tmerc +lat_0=48.1 +lon_0=11.5 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"
)
DATE = "2026-01-01T00:00:00"  # fixed: the same code writes the same bytes

Mark = xodr.RoadMarkType


@dataclass(frozen=True, slots=True)
class LaneSpec:
    """A lane of constant width and the marking at its outer border."""

    width: float
    type: xodr.LaneType = xodr.LaneType.driving
    mark: xodr.RoadMarkType = Mark.none
    linked: tuple[int | None, int | None] = (0, 0)  # lane before and after; 0: same id, None: none


@dataclass(slots=True)
class RoadSpec:
    """A road: its axis, heights and lanes from the centre outwards."""

    id: int
    axis: tuple[Element, ...]
    left: Sequence[LaneSpec] = ()
    right: Sequence[LaneSpec] = ()
    heights: Sequence[tuple[float, ...]] = ()
    rolls: Sequence[tuple[float, ...]] = ()  # superelevation records
    centre_mark: xodr.RoadMarkType = Mark.solid
    lane_offset: float = 0.0  # m, shifts all lanes; half a lane's width puts the axis in its centre
    limits_kmh: Sequence[tuple[float, float]] = ()  # (s, limit) as road type records
    junction: int = -1
    predecessor: tuple[int, str] | None = None  # (road, "start" or "end"), or (junction, "")
    successor: tuple[int, str] | None = None
    kind: xodr.RoadType = xodr.RoadType.motorway
    objects: list[xodr.Object] = field(default_factory=list)
    signals: list[xodr.Signal] = field(default_factory=list)

    @property
    def length(self) -> float:
        """Length of the axis in m."""
        return self.axis[-1].s + self.axis[-1].length


@dataclass(frozen=True, slots=True)
class Connection:
    """A way through a junction: from the end of a road over a connecting road."""

    incoming: int
    connecting: int
    lanes: tuple[tuple[int, int], ...]
    at_end: bool = False  # the way runs against the connecting road's axis


@dataclass(slots=True)
class Network:
    """A whole map."""

    name: str
    roads: list[RoadSpec] = field(default_factory=list)
    junctions: dict[int, list[Connection]] = field(default_factory=dict)
    controllers: dict[int, list[int]] = field(default_factory=dict)  # signals by controller
    ego_start: tuple[int, int, float] | None = None

    def text(self) -> bytes:
        """The OpenDRIVE file."""
        xodr.Object._usedIDs.clear()
        xodr.Signal._usedIDs.clear()
        document = xodr.OpenDrive(self.name, revMinor="7", geo_reference=GEO_REFERENCE)
        for road in self.roads:
            document.add_road(_road(road, self.junctions))
        for id, connections in self.junctions.items():
            document.add_junction(_junction(id, connections))
        # The writer uses the standard library's elements; lxml keeps the order of attributes too.
        root = etree.fromstring(tostring(document.get_element()))
        header = root.find("header")
        assert header is not None
        header.set("date", DATE)
        if self.ego_start is not None:
            value = " ".join(str(v) for v in self.ego_start)
            etree.SubElement(header, "userData", code="skidpad.ego_start", value=value)
        for position, (id, signals) in enumerate(self.controllers.items()):
            node = etree.Element("controller", id=str(id), name=f"controller{id}", sequence="0")
            for signal in signals:
                etree.SubElement(node, "control", signalId=str(signal), type="0")
            root.insert(1 + len(self.roads) + position, node)
        for sign in root.iterfind(".//signal[@country='OPENDRIVE']"):
            sign.set("country", "OpenDRIVE")  # the writer raises the case, the schema does not
        etree.indent(root)
        return etree.tostring(root, xml_declaration=True, encoding="UTF-8") + b"\n"


def _road(spec: RoadSpec, junctions: dict[int, list[Connection]]) -> xodr.Road:
    plan = xodr.PlanView()
    for e in spec.axis:
        assert isinstance(e.shape, Clothoid)
        k0, k1 = e.shape.curvature_start, e.shape.curvature_end
        if k0 == k1 == 0.0:
            shape = xodr.Line(e.length)
        elif k0 == k1:
            shape = xodr.Arc(k0, length=e.length)
        else:
            shape = xodr.Spiral(k0, k1, e.length)
        plan.add_fixed_geometry(shape, e.x, e.y, e.heading, e.s)
    road = xodr.Road(spec.id, plan, _lanes(spec), road_type=spec.junction, name=f"road {spec.id}")
    for s, limit in spec.limits_kmh:
        road.add_type(spec.kind, s, speed=limit, speed_unit="km/h")
    for record in spec.heights:
        road.add_elevation(*record)
    for record in spec.rolls:
        road.add_superelevation(*record)
    for link, add in (
        (spec.predecessor, road.add_predecessor),
        (spec.successor, road.add_successor),
    ):
        if link is not None and link[0] in junctions:
            add(xodr.ElementType.junction, link[0])
        elif link is not None:
            add(xodr.ElementType.road, link[0], getattr(xodr.ContactPoint, link[1]))
    for thing in spec.objects:
        road.add_object(thing)
    for signal in spec.signals:
        road.add_signal(signal)
    return road


def _lanes(spec: RoadSpec) -> xodr.Lanes:
    centre = xodr.Lane(xodr.LaneType.none)
    centre.add_roadmark(xodr.RoadMark(spec.centre_mark, 0.15))
    section = xodr.LaneSection(0.0, centre)
    ends = (spec.predecessor, spec.successor)
    for side, lanes, add in (
        (1, spec.left, section.add_left_lane),
        (-1, spec.right, section.add_right_lane),
    ):
        for i, lane in enumerate(lanes, start=1):
            written = xodr.Lane(lane.type, a=lane.width)
            written.add_roadmark(xodr.RoadMark(lane.mark, 0.15))
            for kind, end, linked in zip(
                ("predecessor", "successor"), ends, lane.linked, strict=True
            ):
                if end is not None and end[1] and linked is not None:
                    written.add_link(kind, linked or side * i)
            add(written)
    lanes_ = xodr.Lanes()
    if spec.lane_offset:
        lanes_.add_laneoffset(xodr.LaneOffset(0.0, spec.lane_offset, 0.0, 0.0, 0.0))
    lanes_.add_lanesection(section)
    return lanes_


def _junction(id: int, connections: list[Connection]) -> xodr.Junction:
    junction = xodr.Junction(f"junction {id}", id)
    for number, connection in enumerate(connections):
        contact = xodr.ContactPoint.end if connection.at_end else xodr.ContactPoint.start
        written = xodr.Connection(connection.incoming, connection.connecting, contact, number)
        for from_, to in connection.lanes:
            written.add_lanelink(from_, to)
        junction.add_connection(written)
    return junction


def stretch(
    id: int,
    axis: tuple[Element, ...],
    heights: Heights,
    s_from: float,
    s_to: float,
    *,
    banks: Banks | None = None,
    **rest: Any,
) -> RoadSpec:
    """The road between two places of a long axis."""
    rolls = [] if banks is None else banks.records(s_from, s_to)
    rise = heights.records(s_from, s_to)
    return RoadSpec(id, cut(axis, s_from, s_to), heights=rise, rolls=rolls, **rest)
