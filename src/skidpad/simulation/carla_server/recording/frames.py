"""What the recorder writes of a tick, in the order in which CARLA does (public source: CarlaRecorder.cpp)."""

from __future__ import annotations

from math import degrees

from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import turn_from_carla
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor, ActorTable
from skidpad.simulation.carla_server.actors.touches import touches
from skidpad.simulation.carla_server.episode import Episode
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.recording.packets import (
    NO_ACTOR,
    Added,
    Kind,
    Packet,
    Vector,
    pack_added,
    pack_end,
    pack_platform_time,
    pack_records,
    pack_start,
)

CM = 100.0  # per metre
HERO = "hero"  # the role of the vehicle under test
KINDS = {
    Family.VEHICLE: Kind.VEHICLE,
    Family.WALKER: Kind.WALKER,
    Family.TRAFFIC_LIGHT: Kind.TRAFFIC_LIGHT,
    Family.TRAFFIC_SIGN: Kind.TRAFFIC_SIGN,
    Family.SENSOR: Kind.SENSOR,
}  # all others are Kind.OTHER
PLACED = (Kind.OTHER, Kind.VEHICLE, Kind.WALKER)  # kinds whose places are written in every frame
Box = tuple[int, Vector, Vector]  # actor, origin and extent in cm


class FrameWriter:
    """Makes the frames of one recording, each with what has changed since the last."""

    def __init__(self, additional: bool = False) -> None:
        """additional: also velocities, boxes, times of lights and the machine's time."""
        self._additional = additional
        self._number = 0  # of the last frame
        self._contacts = 0  # so far
        self._known: set[int] = set()  # actors that the recording describes
        self._weather: list[float] = []  # as last written

    def pack_frame(self, episode: Episode, elapsed: float, platform_time: float) -> bytes:
        """Returns the frame of a tick; elapsed: s since the first frame, the other of the machine's clock."""
        self._number += 1
        actors = episode.actors
        new = [actor for actor in actors if actor.id not in self._known]
        gone = sorted(self._known - actors.alive.keys())
        self._known = set(actors.alive)
        parts = [
            pack_start(self._number, elapsed),
            pack_added([_describe(actor, actors.pose(actor)) for actor in new]),
            pack_records(Packet.EVENT_DEL, [(id,) for id in gone]),
            pack_records(Packet.EVENT_PARENT, [(a.id, a.parent) for a in new if a.parent]),
            pack_records(Packet.COLLISION, self._contact_rows(episode)),
            *_pack_state(episode),
        ]
        if self._additional:
            parts += _pack_additions(episode, new)
            parts.append(pack_platform_time(platform_time))
        weather = episode.sky.pack()
        if weather != self._weather:
            parts.append(pack_records(Packet.WEATHER, [(weather,)]))
            self._weather = weather
        return b"".join([*parts, pack_end()])

    def _contact_rows(self, episode: Episode) -> list[tuple[int, int, int, bool, bool]]:
        """Returns each contact of the tick once, seen from the hero, else from a vehicle."""
        found: dict[frozenset[int], tuple[Actor, Actor | None]] = {}
        for touch in touches(episode.moving, episode.actors):
            pair = frozenset((touch.actor.id, NO_ACTOR if touch.other is None else touch.other.id))
            if pair not in found or _rank(touch.actor) > _rank(found[pair][0]):
                found[pair] = touch.actor, touch.other
        rows = []
        for number, (one, two) in enumerate(found.values(), start=self._contacts):
            other = NO_ACTOR if two is None else two.id
            rows.append((number, one.id, other, _is_hero(one), two is not None and _is_hero(two)))
        self._contacts += len(rows)
        return rows


def _rank(actor: Actor) -> tuple[bool, bool]:
    """Returns what orders the two sides of a contact: heroes before vehicles before others."""
    return _is_hero(actor), actor.family is Family.VEHICLE


def _is_hero(actor: Actor) -> bool:
    """Returns whether an actor has the hero's role name."""
    return actor.attributes.get("role_name") == HERO


def kind_of(actor: Actor) -> Kind:
    """Returns an actor's kind in recordings."""
    return KINDS.get(actor.family, Kind.OTHER)


def _describe(actor: Actor, pose: Pose) -> Added:
    """Returns what a recording says of an actor that enters at the pose."""
    _, blueprint, attributes = actor.description()
    given = tuple((type, name, value) for name, type, value in attributes)
    place, turn = _place(pose)
    number = actor.blueprint.number
    return Added(actor.id, kind_of(actor), place, turn, blueprint, given, number)


def _place(pose: Pose) -> tuple[Vector, Vector]:
    """Returns place in cm and turn in deg (roll, pitch, yaw) in CARLA's axes."""
    (x, y, z), (pitch, yaw, roll) = wire.transform(pose)
    return (CM * x, CM * y, CM * z), (roll, pitch, yaw)


def _pack_state(episode: Episode) -> list[bytes]:
    """Returns the packets of places, lights, controls and lamps."""
    actors, vehicles, lights = episode.actors, episode.vehicles, episode.posts.lights
    placed = [(a.id, *_place(actors.pose(a))) for a in actors if kind_of(a) in PLACED]
    shown = [
        (id, lights.is_frozen(post.light), post.light.elapsed, int(post.light.state))
        for id, post in episode.posts
    ]
    driven = []
    for v in vehicles:
        c, speed = v.control, vehicles.moving.fleet.speed(vehicles.row(v.actor))
        steer = wire.iso_steer(c.steer)
        driven.append((v.actor, steer, c.throttle, c.brake, c.hand_brake, v.gear(speed)))
    return [
        pack_records(Packet.POSITION, placed),
        pack_records(Packet.TRAFFIC_LIGHT, shown),
        pack_records(Packet.VEHICLE, driven),
        pack_records(Packet.WALKER, [(id, CM * w.speed) for id, w in episode.walkers.items()]),
        pack_records(Packet.VEHICLE_LIGHT, [(v.actor, v.lights) for v in vehicles]),
    ]


def _pack_additions(episode: Episode, new: list[Actor]) -> list[bytes]:
    """Returns the packets of velocities and of the new actors' boxes, trigger volumes and times of lights."""
    triggered = [a for a in new if kind_of(a) in (Kind.TRAFFIC_LIGHT, Kind.TRAFFIC_SIGN)]
    lights = [a.id for a in triggered if kind_of(a) is Kind.TRAFFIC_LIGHT]
    times = [(id, (t.green, t.yellow, t.red)) for id in lights for t in [episode.posts.light(id)]]
    parts = [
        pack_records(Packet.KINEMATICS, _velocity_rows(episode)),
        pack_records(Packet.BOUNDING_BOX, [_box(a) for a in new if a not in triggered]),
    ]
    if triggered:
        around = [_box(a, _place(a.pose)[0]) for a in triggered]
        parts.append(pack_records(Packet.TRIGGER_VOLUME, around))
    if times:
        parts.append(pack_records(Packet.TRAFFIC_LIGHT_TIME, times))
    return parts


def _velocity_rows(episode: Episode) -> list[tuple[int, Vector, Vector]]:
    """Returns velocities in m/s and turning rates in deg/s of vehicles and walkers."""
    actors: ActorTable = episode.actors
    rates, rows = episode.moving.states.yaw_rate, []
    for actor in actors:
        if actor.body is not None and kind_of(actor) in (Kind.VEHICLE, Kind.WALKER):
            rate = degrees(float(rates[episode.moving.row(actor.body)]))
            turn = turn_from_carla(0.0, 0.0, rate)
            rows.append((actor.id, wire.iso_to_wire(actors.velocity(actor)), turn))
    return rows


def _box(actor: Actor, origin: Vector | None = None) -> Box:
    """Returns an actor's box in cm, seen from the actor unless an origin in the world is given."""
    centre, half, _ = actor.box()
    x, y, z = (CM * v for v in centre)
    a, b, c = (CM * v for v in half)
    return actor.id, (x, y, z) if origin is None else origin, (a, b, c)
