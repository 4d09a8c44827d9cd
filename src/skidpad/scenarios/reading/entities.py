"""Entities: vehicles, pedestrians and objects of a scenario, as types that every backend knows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, field, replace
from enum import Enum
from math import inf

from skidpad.core.environment.tyres import REFERENCE, known_tyres
from skidpad.core.text.told import describe_value
from skidpad.core.vocabulary import ActorKind
from skidpad.scenarios.reading.catalogs import Catalogs
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Fault, Finding, Kind
from skidpad.simulation.scripted import nearest_type, steering_geometry

EGO_NAMES = ("ego", "hero", "ego_vehicle")
WHEELED = {
    "car": ActorKind.CAR,
    "van": ActorKind.VAN,
    "truck": ActorKind.TRUCK,
    "semitrailer": ActorKind.TRUCK,
    "trailer": ActorKind.TRUCK,
    "bus": ActorKind.BUS,
    "train": ActorKind.BUS,
    "tram": ActorKind.BUS,
}
TYRES = "tyres"  # property of a vehicle: the name of its tyres
GHOST = "ghost"  # property of what is seen and touches nothing
TWO_WHEELED = ("bicycle", "motorbike", "standup_scooter", "wheelchair")
PROPS = (("cone", 0.6), ("box", 1.5), ("barrier", inf))  # backend's props by largest size, m


class Body(Enum):
    """What kind of thing an entity is, as conditions by type name it."""

    VEHICLE = "vehicle"
    PEDESTRIAN = "pedestrian"
    PROP = "miscellaneous"


@dataclass(frozen=True, slots=True)
class Box:
    """Size in m, and where its centre lies seen from the entity's reference point."""

    length: float = 4.5
    width: float = 1.8
    height: float = 1.5
    forward: float = 0.0
    left: float = 0.0


@dataclass(frozen=True, slots=True)
class Axles:
    """Distance of a vehicle's axles, m, and the largest angle of its front wheels, rad."""

    wheelbase: float
    steering_max: float


TRAILERS_MOST = 8  # one behind the other, inside one description; assumption
SIZES = ("length", "width", "height")
BICYCLE = Box(1.8, 0.6, 1.7)
TWO_WHEELS = Axles(1.1, 0.7)  # of a bicycle whose file names none; assumption
WHEELBASE_MIN, LOCK_MAX = 0.2, 1.5  # m, rad; beyond them a file's axles are as usual
USUAL = {  # sizes where only the category is known; assumption
    ActorKind.CAR: Box(),
    ActorKind.VAN: Box(5.3, 2.0, 2.2),
    ActorKind.TRUCK: Box(8.0, 2.5, 3.2),
    ActorKind.BUS: Box(12.0, 2.55, 3.2),
}


@dataclass(frozen=True, slots=True)
class Performance:
    """What an entity can do at most, SI."""

    v_max: float = inf
    a_max: float = inf
    b_max: float = inf
    a_rate: float = inf  # m/s^3, upwards, and downwards
    b_rate: float = inf

    @property
    def is_boundless(self) -> bool:
        """Returns whether neither acceleration nor deceleration is limited."""
        return self.a_max == self.b_max == inf

    def within(self, other: Performance) -> Performance:
        """Returns the stricter of these limits and another's, one by one."""
        return Performance(*map(min, astuple(self), astuple(other)))


@dataclass(frozen=True, slots=True)
class Coupling:
    """Where a vehicle tows and is towed, m forward of its reference point; None: not at all.

    trailer: the entity that it tows from the begin, "" for none.
    """

    hitch: float | None = None
    coupler: float | None = None
    trailer: str = ""


@dataclass(frozen=True, slots=True)
class Entity:
    """One entity. type: of the backend; wheels: it can be driven through the tyres."""

    name: str
    body: Body
    type: str
    wheels: bool
    box: Box
    performance: Performance = Performance()
    properties: Mapping[str, str] = field(default_factory=dict)
    coupling: Coupling = Coupling()
    axles: Axles | None = None  # None: it cannot steer

    @property
    def is_marked_ego(self) -> bool:
        """Returns whether the file says that this is the ego, as ScenarioRunner wants it said."""
        return self.properties.get("type") == "ego_vehicle"

    @property
    def is_ghost(self) -> bool:
        """Returns whether the entity is seen but touches nothing."""
        return self.properties.get(GHOST, "").lower() in ("true", "1")


@dataclass(frozen=True, slots=True)
class Entities:
    """All entities of a file, its selections of them, and what was wrong with the others."""

    by_name: Mapping[str, Entity]
    groups: Mapping[str, tuple[str, ...]]
    findings: tuple[Finding, ...]


def compile_entities(root: Node, catalogs: Catalogs) -> Entities:
    """Compiles the <Entities> of a file; faulty ones become findings."""
    found: dict[str, Entity] = {}
    findings: list[Finding] = []
    node = root.child("Entities")
    for one in node.children("ScenarioObject"):
        try:
            findings += _controllers(one, catalogs)
            entity = compile_entity_object(one, one.text("name"), catalogs)
            if entity.name in found:
                raise one.error(f"there are two entities {entity.name!r}")
            found[entity.name] = entity
            for trailer in _inner_trailers(one, entity, catalogs):
                found.setdefault(trailer.name, trailer)
            findings += _sizes(one, catalogs)
        except Fault as fault:
            findings.append(fault.finding)
            found.setdefault(one.element.get("name", ""), UNKNOWN)  # one fault hides no other
    groups = {}
    for one in node.children("EntitySelection"):
        try:
            groups[one.text("name")] = tuple(_members(one, found))
        except Fault as fault:
            findings.append(fault.finding)
    return Entities(found, groups, tuple(findings))


def _inner_trailers(node: Node, tractor: Entity, catalogs: Catalogs) -> Iterator[Entity]:
    """Yields the trailers that a vehicle's description holds, one behind the other."""
    for _ in range(TRAILERS_MOST):
        body = next((n for n in node.children() if n.tag != "ObjectController"), None)
        inner = None if body is None else catalogs.resolve(body).find("Trailer", "Trailer")
        if inner is None:
            return
        tractor = compile_entity_object(inner, tractor.coupling.trailer, catalogs)
        yield tractor
        node = inner


def _coupling(name: str, node: Node) -> Coupling:
    """Returns the hitch, coupler and trailer of a vehicle; a trailer inside it is called NAME+."""
    places = (node.find("TrailerHitch"), node.find("TrailerCoupler"))
    hitch, coupler = (None if place is None else place.number("dx") for place in places)
    found = node.find("Trailer")
    if found is None:
        return Coupling(hitch, coupler)
    reference = found.find("TrailerRef")
    trailer = f"{name}+" if reference is None else reference.text("entityRef", "")
    return Coupling(hitch, coupler, trailer)


UNKNOWN = Entity("", Body.PROP, "box", False, Box())


def _members(node: Node, known: Mapping[str, Entity]) -> Iterator[str]:
    """Yields the names of a selection's entities: those referenced, then those of the listed kinds."""
    members = node.child("Members")
    for one in members.children("EntityRef"):
        if one.text("entityRef") not in known:
            raise one.error(f"there is no entity {one.text('entityRef')!r}")
        yield one.text("entityRef")
    kinds = [one.choice("objectType", Body) for one in members.children("ByType", "ByObjectType")]
    yield from (name for name, entity in known.items() if entity.body in kinds)


def compile_entity_object(node: Node, name: str, catalogs: Catalogs) -> Entity:
    """Returns the vehicle, pedestrian or object inside an element, or that it refers to.

    A Fault where there is none, or one of an unknown kind.
    """
    found = next((n for n in node.children() if n.tag != "ObjectController"), None)
    if found is None:
        raise node.error("needs a <Vehicle>, <Pedestrian>, <MiscObject> or a reference to one")
    body = catalogs.resolve(found)
    properties = read_properties(body)
    if body.tag == "Vehicle":
        return _vehicle(name, body, properties)
    if body.tag == "Pedestrian":
        box = _box(body, Box(0.5, 0.6, 1.8))
        return Entity(name, Body.PEDESTRIAN, "pedestrian", False, box, properties=properties)
    if body.tag == "MiscObject":
        box = _box(body, Box(1.0, 1.0, 1.0))
        size = max(box.length, box.width)
        type = next(kind for kind, largest in PROPS if size <= largest)
        return Entity(name, Body.PROP, type, False, box, properties=properties)
    raise body.unsupported_fault()


def _controllers(node: Node, catalogs: Catalogs) -> Iterator[Finding]:
    """Yields a note on each controller that is nowhere.

    No more than a note, as an option says which stack drives.
    """
    for controller in node.children("ObjectController"):
        for reference in controller.children("CatalogReference"):
            try:
                catalogs.entry(reference)
            except Fault as fault:
                yield replace(fault.finding, kind=Kind.NOTE)


def _sizes(node: Node, catalogs: Catalogs) -> Iterator[Finding]:
    """Yields a note on a box without volume."""
    body = next((n for n in node.children() if n.tag != "ObjectController"), None)
    size = None if body is None else catalogs.resolve(body).find("BoundingBox", "Dimensions")
    flat = [n for n in SIZES if size is not None and size.number(n) <= 0.0]
    if size is not None and flat:
        told = ", ".join(f"{name} {size.number(name):g}" for name in flat)
        yield size.finding(f"{told}: a box needs a volume; the usual size is taken", Kind.NOTE)


def _vehicle(name: str, node: Node, properties: Mapping[str, str]) -> Entity:
    """Compiles a vehicle: its type is the nearest known one by category and size in m."""
    category = node.text("vehicleCategory")
    box, limits = _box(node, Box()), _performance(node)
    if category in TWO_WHEELED:
        axles = _axles(node, TWO_WHEELS)
        return Entity(name, Body.VEHICLE, "bicycle", False, box, limits, properties, axles=axles)
    coupling = _coupling(name, node)
    if category not in WHEELED:
        raise node.unsupported_fault(f"vehicleCategory={category!r} is not supported")
    if properties.get(TYRES, REFERENCE) not in known_tyres():
        raise node.error(
            f"property {TYRES} must be one of {', '.join(known_tyres())}, "
            f"got {describe_value(properties[TYRES], 100)}"
        )
    type = nearest_type(WHEELED[category], box.length, box.width, box.height)
    axles = _axles(node, Axles(*steering_geometry(type)))
    return Entity(name, Body.VEHICLE, type, True, box, limits, properties, coupling, axles)


def _axles(node: Node, usual: Axles) -> Axles:
    """Returns the axles of a vehicle; what is missing or impossible is as usual for its kind."""
    front, rear = node.find("Axles", "FrontAxle"), node.find("Axles", "RearAxle")
    if front is None or rear is None:
        return usual
    wheelbase = front.number("positionX", 0.0) - rear.number("positionX", 0.0)
    steering_max = front.number("maxSteering", 0.0)
    return Axles(
        wheelbase if wheelbase > WHEELBASE_MIN else usual.wheelbase,
        steering_max if 0.0 < steering_max < LOCK_MAX else usual.steering_max,
    )


def of_category(node: Node, name: str, category: str) -> Entity:
    """Returns a vehicle of which only the category is known, with the usual size."""
    if category in TWO_WHEELED:
        return Entity(name, Body.VEHICLE, "bicycle", False, BICYCLE)
    if category not in WHEELED:
        raise node.unsupported_fault(f"category={category!r} is not supported")
    kind = WHEELED[category]
    box = USUAL[kind]
    type = nearest_type(kind, box.length, box.width, box.height)
    return Entity(name, Body.VEHICLE, type, True, box)


def _box(node: Node, default: Box) -> Box:
    """Returns the bounding box in m; a size that is missing or not positive is the default's."""
    box = node.find("BoundingBox")
    if box is None:
        return default
    size, centre = box.child("Dimensions"), box.child("Center")
    length, width, height = (
        v if (v := size.number(name)) > 0.0 else getattr(default, name) for name in SIZES
    )
    return Box(
        length,
        width,
        height,
        centre.number("x"),
        centre.number("y"),
    )


def _performance(node: Node) -> Performance:
    """Returns the limits of speed and acceleration; inf where one is missing or not positive."""
    most = astuple(read_limits(node.find("Performance")))
    return Performance(*(m if m > 0.0 else inf for m in most))


LIMITS = (
    "maxSpeed", "maxAcceleration", "maxDeceleration", "maxAccelerationRate", "maxDecelerationRate",
)  # fmt: skip


def read_limits(found: Node | None, rates: bool = True) -> Performance:
    """Returns the limits that an element names; inf where one is missing, and without an element.

    rates: the limits of jerk are read, too.
    """
    names = LIMITS if rates else LIMITS[:3]
    return Performance(*(found.limit(name, inf) for name in names)) if found else Performance()


def read_properties(node: Node) -> dict[str, str]:
    """Returns the properties as {name: value}; empty where the node has none."""
    found = node.find("Properties")
    if found is None:
        return {}
    return {p.text("name"): p.text("value") for p in found.children("Property")}


def spectator(entities: Mapping[str, Entity]) -> Entity | None:
    """Returns a parked car that nothing touches, to be the ego; None where a vehicle can be the ego."""
    if any(e.wheels for e in entities.values()):
        return None
    name = "spectator"
    while name in entities:
        name += "_"
    type = nearest_type(ActorKind.CAR, Box().length, Box().width, Box().height)
    return Entity(name, Body.PROP, type, True, Box(), properties={GHOST: "true"})


def choose_ego(root: Node, entities: Mapping[str, Entity], wanted: str | None) -> str:
    """Returns the name of the ego: as asked for, as marked, by name, else the first vehicle.

    A Fault where the one asked for, or any vehicle, is not there.
    """
    node = root.child("Entities")
    if wanted is not None:
        if wanted not in entities:
            raise node.error(f"there is no entity {wanted!r}")
        return wanted
    vehicles = [e for e in entities.values() if e.wheels]
    if not vehicles:
        raise node.error("needs a vehicle that is the ego")
    marked = [e.name for e in vehicles if e.is_marked_ego]
    named = [e.name for e in vehicles if e.name.lower() in EGO_NAMES]
    return (marked + named + [e.name for e in vehicles])[0]
