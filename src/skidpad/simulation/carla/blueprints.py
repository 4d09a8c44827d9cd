"""Which CARLA blueprint stands for what we call a mini, a pedestrian or a cone."""

from __future__ import annotations

from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import ActorKind

# The first that the server offers is taken; the ego's first is A-003's.
STANDS_FOR: dict[str, tuple[str, ...]] = {
    "mini_cooper_s": ("vehicle.mini.cooper_s_2021", "vehicle.mini.cooper_s"),
    "hatchback": ("vehicle.seat.leon", "vehicle.audi.a2"),
    "city_car": ("vehicle.nissan.micra", "vehicle.citroen.c3"),
    "saloon": ("vehicle.mercedes.coupe", "vehicle.lincoln.mkz_2017"),
    "electric_saloon": ("vehicle.tesla.model3",),
    "estate": ("vehicle.audi.etron", "vehicle.toyota.prius"),
    "suv": ("vehicle.nissan.patrol", "vehicle.jeep.wrangler_rubicon"),
    "pickup": ("vehicle.nissan.patrol_2021", "vehicle.tesla.cybertruck"),
    "sports_car": ("vehicle.audi.tt", "vehicle.ford.mustang"),
    "van": ("vehicle.mercedes.sprinter", "vehicle.ford.ambulance"),
    "truck": ("vehicle.carlamotors.european_hgv", "vehicle.carlamotors.firetruck"),
    "bus": ("vehicle.mitsubishi.fusorosa",),
    "pedestrian": ("walker.pedestrian.0001",),
    "bicycle": ("vehicle.gazelle.omafiets", "vehicle.bh.crossbike"),
    "box": ("static.prop.box01",),
    "cone": ("static.prop.trafficcone01", "static.prop.constructioncone"),
    "barrier": ("static.prop.streetbarrier",),
}
EXCLUDED = ("microlino", "carlacola", "cybertruck", "t2", "sprinter")
FOUR_WHEELS = 4
KINDS = {
    "car": ActorKind.CAR,
    "van": ActorKind.VAN,
    "truck": ActorKind.TRUCK,
    "bus": ActorKind.BUS,
    "motorcycle": ActorKind.MOTORCYCLE,
    "bicycle": ActorKind.BICYCLE,
}


def find(library: Any, type: str) -> Any:
    """Returns the blueprint for one of our types, or for CARLA's own id; ConfigError when there is none."""
    wanted = (type,) if "." in type else STANDS_FOR.get(type, ())
    for id in wanted:
        found = [b for b in library.filter(id) if b.id == id]
        if found:
            return found[0]
    raise ConfigError(
        f"actor type {type!r}: the CARLA server offers none of: {', '.join(wanted) or 'nothing'}"
    )


def traffic_blueprints(library: Any) -> list[Any]:
    """Returns the blueprints of four wheels, without the EXCLUDED ids, sorted by id (A-206)."""
    chosen = [
        b
        for b in library.filter("vehicle.*")
        if int(b.get_attribute("number_of_wheels")) == FOUR_WHEELS and not b.id.endswith(EXCLUDED)
    ]
    return sorted(chosen, key=lambda b: str(b.id))


def paint(blueprint: Any, index: int) -> None:
    """Sets the recommended colour whose turn it is (A-205); does nothing where there are none."""
    if blueprint.has_attribute("color"):
        colours = blueprint.get_attribute("color").recommended_values
        if colours:
            blueprint.set_attribute("color", colours[index % len(colours)])


def kind_of(actor: Any) -> ActorKind:
    """Returns what a spawned actor is, from its attributes; PROP for what is neither walker nor vehicle."""
    if actor.type_id.startswith("walker."):
        return ActorKind.PEDESTRIAN
    if actor.type_id.startswith("vehicle."):
        base = actor.attributes.get("base_type", "").lower()
        two = actor.attributes.get("number_of_wheels") == "2"
        return KINDS.get(base, ActorKind.MOTORCYCLE if two else ActorKind.CAR)
    return ActorKind.PROP
