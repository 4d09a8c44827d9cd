"""Objects and signals beside generated roads. Sizes in m; s, t as in OpenDRIVE."""

from __future__ import annotations

from scenariogeneration import xodr

from mapmaker.network import RoadSpec

RAIL_HEIGHT = 0.75
ALONG = {True: xodr.Orientation.positive, False: xodr.Orientation.negative}


class Numbers:
    """Ids of objects, counted up."""

    def __init__(self, first: int) -> None:
        self.next = first

    def take(self) -> str:
        """The next free id."""
        self.next += 1
        return str(self.next - 1)


def guardrail(road: RoadSpec, ids: Numbers, t: float, s_from: float, s_to: float) -> None:
    """A rail parallel to the axis."""
    barrier(road, ids, (t, t), s_from, s_to - s_from)


def barrier(
    road: RoadSpec,
    ids: Numbers,
    t: tuple[float, float],
    s: float,
    length: float,
    *,
    subtype: str = "guardRail",
    height: float = RAIL_HEIGHT,
) -> None:
    """A rail or wall from s on; t: at its two ends."""
    rail = xodr.Object(
        s,
        t[0],
        Type=xodr.ObjectType.barrier,
        subtype=subtype,
        id=ids.take(),
        name=subtype,
        height=height,
    )
    rail.repeat(length, 0.0, s, *t, height, height, 0.0, 0.0)
    road.objects.append(rail)


def box(
    road: RoadSpec,
    ids: Numbers,
    type_: xodr.ObjectType,
    s: float,
    t: float,
    size: tuple[float, float, float],
    *,
    name: str | None = None,
    up: float = 0.0,
    turn: float = 0.0,
) -> None:
    """An upright box; size is length along the road, width, height."""
    length, width, height = size
    road.objects.append(
        xodr.Object(
            s,
            t,
            Type=type_,
            id=ids.take(),
            name=name or type_.name,
            length=length,
            width=width,
            height=height,
            zOffset=up,
            hdg=turn,
        )
    )


def gantry(road: RoadSpec, ids: Numbers, s: float, t_left: float, t_right: float) -> None:
    """Two legs and a beam across the road."""
    for t in (t_left, t_right):
        box(road, ids, xodr.ObjectType.pole, s, t, (0.4, 0.4, 6.8), name="gantryLeg")
    width = t_left - t_right
    middle = 0.5 * (t_left + t_right)
    box(road, ids, xodr.ObjectType.gantry, s, middle, (0.5, width, 0.6), name="gantry", up=6.2)


def sign(
    road: RoadSpec,
    ids: Numbers,
    s: float,
    t: float,
    *,
    type_: str,
    lanes: tuple[int, int],
    value: float | None = None,
    up: float = 2.2,
) -> None:
    """A sign on a post, valid on a range of lanes."""
    along = lanes[0] < 0
    signal = xodr.Signal(
        s,
        t,
        "DE",
        type_,
        id=ids.take(),
        name={"274": "limit", "205": "yield", "206": "stop"}.get(type_, "sign"),
        value=value,
        unit=None if value is None else "km/h",
        zOffset=up,
        orientation=ALONG[along],
        height=0.7,
        width=0.7,
    )
    signal.add_validity(*lanes)
    road.signals.append(signal)
    box(road, ids, xodr.ObjectType.pole, s, t, (0.08, 0.08, up), name="signPost")
    box(road, ids, xodr.ObjectType.obstacle, s, t, (0.04, 0.7, 0.7), name="sign", up=up)


def stop_line(road: RoadSpec, ids: Numbers, s: float, lanes: tuple[int, int]) -> None:
    """A line that belongs to the light or stop sign next to it."""
    line = xodr.Signal(
        s, 0.0, "DE", "294", id=ids.take(), name="stopLine", zOffset=0.0,
        orientation=ALONG[lanes[0] < 0],
    )  # fmt: skip
    line.add_validity(*lanes)
    road.signals.append(line)


def light(
    road: RoadSpec,
    id: int,
    s: float,
    t: float,
    lanes: tuple[int, int],
    up: float,
) -> None:
    """A traffic light's head, 1 m high."""
    signal = xodr.Signal(
        s, t, "OpenDRIVE", "1000001", id=str(id), name="light", dynamic=xodr.Dynamic.yes,
        zOffset=up, orientation=ALONG[lanes[0] < 0], height=1.0, width=0.35,
    )  # fmt: skip
    signal.add_validity(*lanes)
    road.signals.append(signal)


def _outlined(
    road: RoadSpec,
    ids: Numbers,
    type_: xodr.ObjectType,
    s: float,
    t: float,
    size: tuple[float, float],
) -> None:
    """A flat rectangle; size is along and across the road."""
    length, width = size
    thing = xodr.Object(
        s, t, Type=type_, id=ids.take(), name=type_.name, length=length, width=width, height=0.0
    )
    outline = xodr.Outline(id=0, closed=True)
    for number, (u, v) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        corner = xodr.CornerLocal(u * length / 2, v * width / 2, 0.0, 0.0, id=number)
        outline.add_corner(corner)
    thing.add_outline(outline)
    road.objects.append(thing)


def crosswalk(
    road: RoadSpec, ids: Numbers, s: float, t: float, length: float, width: float
) -> None:
    """A zebra across the road, `length` m along it."""
    _outlined(road, ids, xodr.ObjectType.crosswalk, s, t, (length, width))


def parking_space(
    road: RoadSpec, ids: Numbers, s: float, t: float, length: float, width: float
) -> None:
    """A place for one parked car, parallel to the road."""
    _outlined(road, ids, xodr.ObjectType.parkingSpace, s, t, (length, width))
