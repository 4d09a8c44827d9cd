"""Traffic actions: sources, sinks, swarms and areas of vehicles that the file does not name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import groupby
from math import ceil, inf

from skidpad.roads.opendrive.reader import id_number
from skidpad.scenarios.actions.base import GlobalAction
from skidpad.scenarios.context import Context
from skidpad.scenarios.places.positions import position
from skidpad.scenarios.places.spots import Disc, Outline, Oval, Region, Stretch, Stretches
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Entity, compile_entity_object, of_category
from skidpad.scenarios.reading.findings import Kind
from skidpad.scenarios.scene import DONE, Flow, Running, Scene
from skidpad.scenarios.traffic import Directions, Filling, Pool, Sinking, Sourcing, Speeds

MOST = 100  # vehicles of one action at a time; the standard allows fewer than asked for
OF_A_SOURCE = 60.0  # s of its rate that a source's vehicles suffice for; assumption
RIM = 0.7  # of the ellipse, beyond which a swarm's later vehicles appear; assumption


@dataclass(frozen=True, slots=True)
class StartTraffic:
    """Lets a traffic action begin under its name."""

    name: str
    flow: Callable[[str, Scene], Sourcing | Sinking | Filling]

    def happen(self, scene: Scene) -> Running:
        """Starts the flow of traffic and returns it running."""
        flow = self.flow(self.name, scene)
        scene.flows.append(flow)
        return flow


@dataclass(frozen=True, slots=True)
class StopTraffic:
    """Traffic of a name, or all without one, neither comes nor goes any more."""

    name: str

    def happen(self, scene: Scene) -> Running:
        """Ends the traffic at once and returns an action that is done; vehicles that are there drive on."""
        flows: list[Flow] = scene.flows
        for flow in flows:
            if self.name in ("", flow.name):
                flow.stopped = True
        return DONE


def _size(node: Node, name: str, default: float | None = None) -> float:
    """Returns a number attribute that may be infinite; raises an error where it is below 0."""
    value = node.limit(name, default)
    if value < 0.0:
        raise node.error(f"{name} must be >= 0, got {value:g}")
    return value


def _count(node: Node, name: str, ctx: Context) -> int:
    """Returns a number of vehicles, cut to `MOST`; a cut is noted in the findings."""
    value = _size(node, name)
    if value > MOST:
        what = f"{name} = {value:g}: at most {MOST} are taken"
        ctx.findings.append(node.finding(what, Kind.NOTE))
    return int(min(value, MOST))


def _draw_vehicles(node: Node, count: int, ctx: Context) -> tuple[str, ...]:
    """Adds `count` vehicles that may come to ctx.hired and returns their names; cars without a distribution.

    They are shared out by the weights of the distribution, always in the same way.
    """
    kinds = list(_kinds(node, ctx))
    total = sum(weight for weight, _ in kinds)
    if total <= 0.0:
        raise node.error("the weights of its traffic must have a positive sum")
    given, names = [0.0] * len(kinds), []
    for k in range(1, count + 1):
        lack = [k * weight / total - n for (weight, _), n in zip(kinds, given, strict=True)]
        chosen = lack.index(max(lack))
        given[chosen] += 1.0
        number = len(ctx.hired) + 1
        while (name := f"traffic_{number}") in ctx.entities:
            number += 1
        ctx.hired[name] = replace(kinds[chosen][1], name=name)
        names.append(name)
    return tuple(names)


def _kinds(node: Node, ctx: Context) -> Iterator[tuple[float, Entity]]:
    """Yields (weight, entity template) for each kind of vehicle; an ordinary car where none is given."""
    shares = node.find("TrafficDefinition", "VehicleCategoryDistribution")
    entries = node.find("TrafficDistribution")
    if entries is not None:
        for entry in entries.children("TrafficDistributionEntry"):
            for one in entry.child("EntityDistribution").children("EntityDistributionEntry"):
                template = one.child("ScenarioObjectTemplate")
                weight = _size(entry, "weight") * _size(one, "weight")
                yield weight, compile_entity_object(template, "", ctx.catalogs)
    elif shares is not None:
        for one in shares.children("VehicleCategoryDistributionEntry"):
            yield _size(one, "weight"), of_category(one, "", one.text("category"))
    else:
        yield 1.0, of_category(node, "", "car")


def _speeds(node: Node) -> Speeds:
    """Returns the range of initial speeds in m/s; both limits are None where the file gives none."""
    for name in ("speed", "velocity"):
        if node.has(name):
            v = _size(node, name)
            return Speeds(v, v)
    found = node.find("InitialSpeedRange")
    if found is None:
        return Speeds()
    low, high = _size(found, "lowerLimit"), _size(found, "upperLimit")
    if not low <= high < inf:
        raise found.error(f"upperLimit must be >= lowerLimit = {low:g}, got {high:g}")
    return Speeds(low, high)


def _disc(node: Node, ctx: Context) -> Disc:
    """Returns the disc given by the position and the radius in m of the node."""
    return Disc(position(node.child("Position"), ctx), _size(node, "radius"))


def _source(node: Node, ctx: Context) -> Callable[[str, Scene], Sourcing]:
    """Returns a function of (action name, scene) that starts a traffic source at `rate` vehicles per s."""
    region, rate, speeds = _disc(node, ctx), _size(node, "rate"), _speeds(node)
    cars = _draw_vehicles(node, min(ceil(min(rate * OF_A_SOURCE, MOST)) + 1, MOST), ctx)
    return lambda name, scene: Sourcing(name, Pool(name, cars, speeds, scene), region, rate)


def _sink(node: Node, ctx: Context) -> Callable[[str, Scene], Sinking]:
    """Returns a function of (action name, scene) that starts a traffic sink; an absent rate is infinite."""
    region, rate = _disc(node, ctx), _size(node, "rate", inf)
    return lambda name, _: Sinking(name, region, rate)


def _swarm(node: Node, ctx: Context) -> Callable[[str, Scene], Filling]:
    """Returns a function of (action name, scene) that starts a swarm in an oval around its central entity."""
    centre = node.find("CentralObject") or node.child("CentralSwarmObject")
    entity = ctx.entity(centre)
    axes = [_size(node, name) for name in ("semiMajorAxis", "semiMinorAxis", "innerRadius")]
    if min(axes[:2]) <= 0.0:
        raise node.error(f"semiMajorAxis and semiMinorAxis must be > 0, got {min(axes[:2]):g}")
    whole = Oval(entity, node.number("offset", 0.0), *axes)
    speeds, ways = _speeds(node), node.find("DirectionOfTravelDistribution")
    directions = None
    if ways is not None:
        directions = Directions(entity, _size(ways, "same"), _size(ways, "opposite"))
    cars = _draw_vehicles(node, _count(node, "numberOfVehicles", ctx), ctx)
    return lambda name, scene: Filling(
        name, Pool(name, cars, speeds, scene), whole, replace(whole, rim=RIM), directions
    )


def _area(node: Node, ctx: Context) -> Callable[[str, Scene], Filling]:
    """Returns a function of (action name, scene) that fills a traffic area, once or continuously."""
    region = _region(node.child("TrafficArea"), ctx)
    cars = _draw_vehicles(node, _count(node, "numberOfEntities", ctx), ctx)
    later = region if node.flag("continuous", default=False) else None
    return lambda name, scene: Filling(name, Pool(name, cars, Speeds(), scene), region, later)


def _region(node: Node, ctx: Context) -> Region:
    """Returns the region of a traffic area: its polygon of three or more corners, or else its road ranges."""
    polygon = node.find("Polygon")
    if polygon is None:
        ranges = node.children("RoadRange")
        return Stretches(tuple(part for one in ranges for part in _stretches(one, ctx)))
    corners = tuple(position(one, ctx) for one in polygon.children("Position"))
    if len(corners) < 3:
        raise polygon.error(f"needs at least three <Position>s, has {len(corners)}")
    return Outline(corners)


def _stretches(node: Node, ctx: Context) -> Iterator[Stretch]:
    """Yields what lies between the cursors of each road; a road with one cursor counts as a whole."""
    cursors = list(node.children("RoadCursor"))
    if len(cursors) < 2:
        raise node.error(f"needs at least two <RoadCursor>s, has {len(cursors)}")
    left = _size(node, "length", inf)
    for road, some in groupby(cursors, key=lambda c: id_number(c.text("roadId"))):
        of_road = list(some)
        if road not in ctx.network.roads:
            raise of_road[0].error(f"there is no road {of_road[0].text('roadId')!r}")
        whole = ctx.network.roads[road].length
        marks = [_size(c, "s", 0.0) for c in of_road]
        parts = [(0.0, whole, of_road[0])]
        if len(of_road) > 1:
            parts = list(zip(marks, marks[1:], of_road, strict=False))
        for a, b, cursor in parts:
            size = min(abs(b - a), left)
            left -= size
            low = a if b >= a else a - size
            lanes = frozenset(c.whole("id") for c in cursor.children("Lane"))
            yield Stretch(road, low, low + size, lanes)


Start = Callable[[str, Scene], Sourcing | Sinking | Filling]
TRAFFIC: Mapping[str, Callable[[Node, Context], Start]] = {
    "TrafficSourceAction": _source,
    "TrafficSinkAction": _sink,
    "TrafficSwarmAction": _swarm,
    "TrafficAreaAction": _area,
}


def compile_traffic(node: Node, ctx: Context) -> GlobalAction:
    """Compiles a <TrafficAction> that starts or stops traffic of that name."""
    name, what = node.text("trafficName", ""), node.only()
    if what.tag == "TrafficStopAction":
        return StopTraffic(name)
    return StartTraffic(name, what.choose(TRAFFIC)(what, ctx))
