"""Blueprints: what can be spawned, with attributes, sizes and the physics type that stands for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any
from zlib import crc32

import yaml

from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind, GripModel, SemanticClass
from skidpad.simulation.carla_server.options import MU_REF
from skidpad.simulation.carla_server.protocol import wire

DATA = Path(__file__).with_name("data") / "blueprints.yaml"
GRIP_BLUEPRINT = "skidpad.weather.grip"  # decisions K-2, R-15


class AttributeType(int, Enum):
    """How a client parses an attribute's text."""

    BOOL = 1
    INT = 2
    FLOAT = 3
    STRING = 4
    COLOUR = 5


class Family(str, Enum):
    """What a blueprint makes; the first part of its id for most."""

    VEHICLE = "vehicle"
    WALKER = "walker"
    SENSOR = "sensor"
    PROP = "static.prop"
    TRIGGER = "static.trigger"
    CONTROLLER = "controller"
    GRIP = "skidpad"
    TRAFFIC_LIGHT = "traffic.traffic_light"
    TRAFFIC_SIGN = "traffic"
    SPECTATOR = "spectator"


@dataclass(frozen=True, slots=True)
class Attribute:
    """One attribute of a blueprint; the first recommended value is its default."""

    id: str
    type: AttributeType
    recommended: tuple[str, ...]
    modifiable: bool = True
    restricted: bool = False

    def pack(self) -> list[Any]:
        """Returns the attribute as `ActorAttribute` of an `ActorDefinition`."""
        values = list(self.recommended)
        return [self.id, int(self.type), values[0], values, self.modifiable, self.restricted]


@dataclass(frozen=True, slots=True)
class Blueprint:
    """One thing that clients may spawn."""

    id: str
    family: Family
    attributes: dict[str, Attribute]
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m: length, width, height
    kind: ActorKind = ActorKind.PROP
    label: SemanticClass = SemanticClass.NONE
    number: int = 0  # of its definition, from 1; 0: of the map, clients cannot spawn it

    def pack(self) -> list[Any]:
        """Returns the blueprint as `ActorDefinition`."""
        tags = ",".join(self.id.split("."))
        return [self.number, self.id, tags, [a.pack() for a in self.attributes.values()]]


_TYPES = {
    "bool": AttributeType.BOOL,
    "int": AttributeType.INT,
    "float": AttributeType.FLOAT,
    "string": AttributeType.STRING,
}
_KINDS = {
    "car": ActorKind.CAR,
    "van": ActorKind.VAN,
    "truck": ActorKind.TRUCK,
    "bus": ActorKind.BUS,
    "motorcycle": ActorKind.MOTORCYCLE,
    "bicycle": ActorKind.BICYCLE,
}
CLASS_OF_KIND = LABEL_OF_KIND | {ActorKind.VAN: SemanticClass.TRUCK}  # as CARLA tags vans


def _attributes(entry: dict[str, Any]) -> dict[str, Attribute]:
    """Returns a catalogue entry's attributes by name; a third field restricts one to its listed values."""
    made = {}
    for name, spec in entry.items():
        values = spec[1] if isinstance(spec[1], list) else [spec[1]]
        made[name] = Attribute(
            name, _TYPES[spec[0]], tuple(str(v) for v in values), restricted=len(spec) > 2
        )
    return made


def _fixed_attribute(name: str, kind: AttributeType, value: object) -> Attribute:
    """Returns an attribute that clients cannot modify, with its value as CARLA writes it."""
    written = str(value).lower() if isinstance(value, bool) else str(value)
    return Attribute(name, kind, (written,), modifiable=False)


def _roles(actor: dict[str, Attribute], *names: str) -> dict[str, Attribute]:
    """Returns the actor's attributes together with `role_name` and its recommended values."""
    role = Attribute("role_name", AttributeType.STRING, names)
    return {**actor, "role_name": role}


def _vehicle(id: str, row: list[Any], actor: dict[str, Attribute], colours: list[str]) -> Blueprint:
    """Returns the blueprint of a vehicle from its catalogue row (size in m, base type, lights, doors)."""
    length, width, height, base, special, generation, lights, doors = row
    wheels = 2 if base in ("motorcycle", "bicycle") else 4
    attributes = _roles(actor, "autopilot", "scenario", "ego_vehicle", "hero")
    for attribute in (
        Attribute("color", AttributeType.COLOUR, _order_colours(id, colours)),
        Attribute("driver_id", AttributeType.INT, ("0", "1"), restricted=True),
        Attribute("sticky_control", AttributeType.BOOL, ("true",)),
        Attribute("terramechanics", AttributeType.BOOL, ("false",)),
        _fixed_attribute("object_type", AttributeType.STRING, ""),
        _fixed_attribute("base_type", AttributeType.STRING, base),
        _fixed_attribute("special_type", AttributeType.STRING, special),
        _fixed_attribute("number_of_wheels", AttributeType.INT, wheels),
        _fixed_attribute("generation", AttributeType.INT, generation),
        _fixed_attribute("has_dynamic_doors", AttributeType.BOOL, doors),
        _fixed_attribute("has_lights", AttributeType.BOOL, lights),
    ):
        attributes[attribute.id] = attribute
    kind = _KINDS[base]
    return Blueprint(
        id, Family.VEHICLE, attributes, (length, width, height), kind, label=CLASS_OF_KIND[kind]
    )


def _order_colours(id: str, colours: list[str]) -> tuple[str, ...]:
    """Returns the recommended colours with another one first by blueprint, as that is the default."""
    usual = load_data()["usual_colours"].get(id)
    first = colours.index(usual) if usual else (crc32(id.encode()) >> 8) % len(colours)
    return (*colours[first:], *colours[:first])


def _walker(id: str, row: list[Any], actor: dict[str, Attribute]) -> Blueprint:
    """Returns the blueprint of a pedestrian from its catalogue row (size in m, age, gender, generation)."""
    length, width, height, age, gender, generation = row
    attributes = _roles(actor, "pedestrian")
    for attribute in (
        _fixed_attribute("gender", AttributeType.STRING, gender),
        _fixed_attribute("generation", AttributeType.INT, generation),
        _fixed_attribute("age", AttributeType.STRING, age),
        _fixed_attribute("can_use_wheelchair", AttributeType.BOOL, False),
        Attribute("speed", AttributeType.FLOAT, ("0.0", "1.4", "2.4")),
        Attribute("is_invincible", AttributeType.BOOL, ("true",)),
        Attribute("use_wheelchair", AttributeType.BOOL, ("false",), restricted=True),
    ):
        attributes[attribute.id] = attribute
    size = (length, width, height)
    label = SemanticClass.PEDESTRIAN
    return Blueprint(id, Family.WALKER, attributes, size, ActorKind.PEDESTRIAN, label)


def _size_word(length: float, width: float, height: float) -> str:
    """Returns CARLA's word for the longest edge in m: tiny below 0.3, small, medium, big, huge from 5.0."""
    longest = max(length, width, height)
    words = ((0.3, "tiny"), (1.0, "small"), (2.5, "medium"), (5.0, "big"))
    return next((word for limit, word in words if longest < limit), "huge")


def _prop(id: str, size: list[float], actor: dict[str, Attribute]) -> Blueprint:
    """Returns the blueprint of a static prop whose length, width and height are given in m."""
    attributes = _roles(actor, "prop")
    attributes["size"] = _fixed_attribute("size", AttributeType.STRING, _size_word(*size))
    if id == "static.prop.mesh":
        for name, kind, value in (
            ("mesh_path", AttributeType.STRING, ""),
            ("scale", AttributeType.FLOAT, "1.0"),
            ("mass", AttributeType.FLOAT, "0.0"),
        ):
            attributes[name] = Attribute(name, kind, (value,))
    length, width, height = (float(v) for v in size)
    return Blueprint(
        id, Family.PROP, attributes, (length, width, height), label=SemanticClass.DYNAMIC
    )


def _grip(actor: dict[str, Attribute]) -> Blueprint:
    """Returns the blueprint of the actor that reports grip and sets the ice thickness."""
    ice = Attribute("ice_thickness", AttributeType.FLOAT, ("0.0",))
    blueprint = Blueprint(GRIP_BLUEPRINT, Family.GRIP, {**actor, ice.id: ice})
    return grip_in_force(blueprint, GripModel.PHYSICAL, MU_REF)


def grip_in_force(blueprint: Blueprint, model: GripModel, mu_ref: float) -> Blueprint:
    """Returns the grip blueprint with attributes that tell clients how weather acts on grip here (K-2).

    Attributes: `ice_thickness` sets ice in percent of 20 mm; `weather_grip` and `mu_ref` are those
    of the server's command line, for clients to read.
    """
    told = (
        _fixed_attribute("weather_grip", AttributeType.STRING, model.value),
        _fixed_attribute("mu_ref", AttributeType.FLOAT, mu_ref),
    )
    return replace(blueprint, attributes={**blueprint.attributes, **{a.id: a for a in told}})


@cache
def load_data() -> dict[str, Any]:
    """Reads the data file of blueprints and attributes."""
    data: dict[str, Any] = yaml.load(DATA.read_text(encoding="utf-8"), Loader=yaml.CSafeLoader)
    return data


@cache
def load_catalogue() -> dict[str, Blueprint]:
    """Returns the blueprints of all actors by id."""
    data = load_data()
    actor = _attributes(data["attributes"]["actor"])
    made: list[Blueprint] = []
    for group, family in (
        ("sensors", Family.SENSOR),
        ("triggers", Family.TRIGGER),
        ("controllers", Family.CONTROLLER),
    ):
        made += [
            Blueprint(id, family, _attributes({**entry, **data["additions"].get(id, {})}))
            for id, entry in data[group].items()
        ]
    made += [_vehicle(id, row, actor, data["colours"]) for id, row in data["vehicles"].items()]
    made += [_walker(id, row, actor) for id, row in data["walkers"].items()]
    for group in ("props", "estimated"):
        made += [_prop(id, size, actor) for id, size in data[group].items()]
    made.append(_grip(actor))
    ordered = sorted(made, key=lambda b: b.id)
    return {b.id: replace(b, number=k) for k, b in enumerate(ordered, start=1)}


def make_catalogue(grip: GripModel, mu_ref: float) -> dict[str, Blueprint]:
    """Returns the blueprints by id that a server offers.

    `skidpad.weather.grip` tells how weather acts on grip (K-2); it is missing under GripModel.NONE.
    """
    everything = load_catalogue()
    if grip is GripModel.NONE:
        return {id: b for id, b in everything.items() if b.family is not Family.GRIP}
    told = grip_in_force(everything[GRIP_BLUEPRINT], grip, mu_ref)
    return {**everything, GRIP_BLUEPRINT: told}


def choose_attributes(blueprint: Blueprint, given: Mapping[str, str]) -> dict[str, str]:
    """Returns the attributes of a new actor as texts: the client's where it gave some, else the defaults.

    Those that are unknown or not to be modified are ignored; WireError for a value of a wrong type or
    outside a restricted list.
    """
    values = {a.id: a.recommended[0] for a in blueprint.attributes.values()}
    for name, value in given.items():
        attribute = blueprint.attributes.get(name)
        if attribute is None or not attribute.modifiable:
            continue
        if attribute.restricted and value not in attribute.recommended:
            raise wire.WireError(
                f"{blueprint.id}: {name} must be one of {', '.join(attribute.recommended)}, "
                f"got {value[:40]!r}"
            )
        values[name] = _check_value(blueprint.id, attribute, value)
    return values


def _check_value(id: str, attribute: Attribute, value: str) -> str:
    """Returns a value's text as its type is read: `64.0` as an int is `64`, `5.9f` as a float `5.9`.

    WireError where it cannot be read so, or is out of range.
    """
    try:
        if attribute.type is AttributeType.FLOAT:
            text = value.strip().removesuffix("f")
            wire.number(float(text), f"{id}: {attribute.id}")
            return text
        if attribute.type is AttributeType.INT:
            number = int(float(value))
            return str(wire.integer(number, f"{id}: {attribute.id}", -(2**31), 2**31 - 1))
        if attribute.type is AttributeType.COLOUR:
            parts = [int(v) for v in value.split(",")]
            if len(parts) != 3 or not all(0 <= v <= 255 for v in parts):
                raise ValueError
    except (ValueError, OverflowError) as error:
        raise wire.WireError(
            f"{id}: {attribute.id} must be a {attribute.type.name.lower()}, got {value[:40]!r}"
        ) from error
    return value
