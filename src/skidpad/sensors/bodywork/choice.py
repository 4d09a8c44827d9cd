"""Which body an actor has: by its type where that is known, else by its kind and its size."""

from __future__ import annotations

from functools import cache
from zlib import crc32

from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind
from skidpad.physics.types import vehicle_types
from skidpad.sensors.bodywork.body import Body
from skidpad.sensors.bodywork.buses import CITY_BUS, COACH, BusStyle, make_bus
from skidpad.sensors.bodywork.car_shape import CarStyle
from skidpad.sensors.bodywork.car_styles import CARS
from skidpad.sensors.bodywork.cars import make_car
from skidpad.sensors.bodywork.lorries import (
    BOX_LORRY,
    DRINKS_LORRY,
    FIRE_ENGINE,
    HEAVY_LORRY,
    LorryStyle,
    make_lorry,
)
from skidpad.sensors.bodywork.two_wheelers import TWO_WHEELERS, TwoWheelerStyle, make_two_wheeler
from skidpad.sensors.bodywork.walkers import WALKERS, WalkerStyle, make_walker
from skidpad.sensors.scene.bodies import body_mesh

Style = CarStyle | LorryStyle | BusStyle | TwoWheelerStyle | WalkerStyle

STYLES: dict[str, Style] = {
    **CARS,
    "lorry": BOX_LORRY,
    "heavy lorry": HEAVY_LORRY,
    "fire engine": FIRE_ENGINE,
    "drinks lorry": DRINKS_LORRY,
    "bus": CITY_BUS,
    "coach": COACH,
    **TWO_WHEELERS,
    **WALKERS,
}
STYLE_OF_TYPE = {
    # types of `physics/vehicles.yaml`
    "mini_cooper_s": "mini",
    "hatchback": "hatchback",
    "city_car": "supermini",
    "saloon": "saloon",
    "electric_saloon": "fastback",
    "estate": "estate",
    "suv": "suv",
    "pickup": "pick-up",
    "sports_car": "rear-engine",
    "van": "panel van",
    "truck": "lorry",
    "bus": "bus",
    # blueprints of the server
    "vehicle.audi.a2": "supermini",
    "vehicle.audi.etron": "suv",
    "vehicle.audi.tt": "coupe",
    "vehicle.bh.crossbike": "trekking bicycle",
    "vehicle.bmw.grandtourer": "estate",
    "vehicle.carlamotors.carlacola": "drinks lorry",
    "vehicle.carlamotors.european_hgv": "heavy lorry",
    "vehicle.carlamotors.firetruck": "fire engine",
    "vehicle.chevrolet.impala": "saloon",
    "vehicle.citroen.c3": "hatchback",
    "vehicle.diamondback.century": "racing bicycle",
    "vehicle.dodge.charger_2020": "saloon",
    "vehicle.dodge.charger_police": "saloon with a light bar",
    "vehicle.dodge.charger_police_2020": "saloon with a light bar",
    "vehicle.ford.ambulance": "ambulance",
    "vehicle.ford.crown": "saloon with a light bar",
    "vehicle.ford.mustang": "long-nose",
    "vehicle.gazelle.omafiets": "city bicycle",
    "vehicle.harley-davidson.low_rider": "cruiser",
    "vehicle.jeep.wrangler_rubicon": "off-roader",
    "vehicle.kawasaki.ninja": "sports motorcycle",
    "vehicle.lincoln.mkz_2017": "saloon",
    "vehicle.lincoln.mkz_2020": "saloon",
    "vehicle.mercedes.coupe": "long-nose",
    "vehicle.mercedes.coupe_2020": "coupe",
    "vehicle.mercedes.sprinter": "panel van",
    "vehicle.micro.microlino": "microcar",
    "vehicle.mini.cooper_s": "mini",
    "vehicle.mini.cooper_s_2021": "mini",
    "vehicle.mitsubishi.fusorosa": "coach",
    "vehicle.nissan.micra": "supermini",
    "vehicle.nissan.patrol": "off-roader",
    "vehicle.nissan.patrol_2021": "suv",
    "vehicle.seat.leon": "hatchback",
    "vehicle.tesla.cybertruck": "wedge",
    "vehicle.tesla.model3": "fastback",
    "vehicle.toyota.prius": "fastback",
    "vehicle.vespa.zx125": "scooter",
    "vehicle.volkswagen.t2": "minibus",
    "vehicle.volkswagen.t2_2021": "minibus",
    "vehicle.yamaha.yzf": "sports motorcycle",
}


def style_of(type: str, kind: ActorKind, length: float, height: float) -> str:
    """Returns the name of the style of an actor; empty for things that are no vehicle and no person."""
    if type in STYLE_OF_TYPE:
        return STYLE_OF_TYPE[type]
    if kind is ActorKind.CAR:
        return _car_of(length, height)
    if kind is ActorKind.PEDESTRIAN:
        grown = [name for name in WALKERS if name != "child"]
        return "child" if height < 1.4 else grown[(crc32(type.encode()) >> 5) % len(grown)]
    names = {
        ActorKind.VAN: "panel van" if height > 2.2 else "minibus",
        ActorKind.TRUCK: "lorry",
        ActorKind.BUS: "bus",
        ActorKind.MOTORCYCLE: "sports motorcycle",
        ActorKind.BICYCLE: "trekking bicycle",
    }
    return names.get(kind, "")


def _car_of(length: float, height: float) -> str:
    """Returns the style of a car of which only the size in m is known."""
    if height > 1.58:
        return "suv"
    if height < 1.36:
        return "rear-engine"
    if length < 3.9:
        return "supermini"
    return "hatchback" if length < 4.5 else "saloon"


@cache
def make_body(type: str, kind: ActorKind, length: float, width: float, height: float) -> Body:
    """Returns the body of an actor of this type, kind and size in m."""
    label, size = int(LABEL_OF_KIND[kind]), (length, width, height)
    name = style_of(type, kind, length, height)
    known = vehicle_types().get(type)
    axles = None if known is None else (known.x_front_axle, known.x_rear_axle)
    wheel = None if known is None else known.wheel_radius
    match STYLES.get(name):
        case CarStyle() as style:
            return make_car(label, style, *size, axles, wheel)
        case LorryStyle() as style:
            return make_lorry(label, style, *size, axles, wheel)
        case BusStyle() as style:
            return make_bus(label, style, *size, axles, wheel)
        case TwoWheelerStyle() as style:
            return make_two_wheeler(label, style, *size)
        case WalkerStyle() as style:
            return make_walker(label, style, *size)
    return Body(body_mesh(kind, *size))
