"""V2X sensors: stations that send awareness messages, or clients' own ones, and hear each other."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from math import cos, degrees, sin

from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import turn_from_carla, vector_from_carla
from skidpad.sensors import inertial
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.sensing import cam
from skidpad.simulation.carla_server.sensing.radio import (
    Call,
    Radio,
    Way,
    find_crossed_boxes,
    loss,
    make_radio,
)
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

MOST_QUEUED = 64  # custom messages of one sensor in one tick


@dataclass(slots=True, eq=False)
class Station:
    """A sensor's radio, and what it is about to send."""

    radio: Radio
    rhythm: cam.Rhythm | None = None  # None: only clients' own messages
    queue: deque[bytes] = field(default_factory=lambda: deque(maxlen=MOST_QUEUED))


def make_station(actor: Actor, _: int) -> Station:
    """Returns the station of a sensor of awareness messages, from its attributes; WireError if unusable."""
    a = actor.attributes
    shortest, longest = float(a["gen_cam_min"]), float(a["gen_cam_max"])
    if not 0.0 <= shortest <= longest:
        raise wire.WireError(
            f"v2x: need 0 <= gen_cam_min <= gen_cam_max, got {shortest:g} and {longest:g}"
        )
    fixed = a["fixed_rate"].lower() == "true"
    return Station(make_radio(actor), cam.Rhythm(shortest, longest, fixed, period=longest))


def make_messenger(actor: Actor, _: int) -> Station:
    """Returns the station of a sensor that sends clients' own messages."""
    return Station(make_radio(actor))


def _call(around: Surroundings, sensor: Sensor) -> Call:
    """Returns a call with where this sensor's antenna is, and no message yet."""
    actor, carrier = sensor.actor, around.actors.carrier(sensor.actor)
    pose = around.actors.pose(actor)
    below = pose.z if carrier is None else around.actors.pose(carrier).z - carrier.lift
    radio = sensor.equipment.radio
    place = (pose.x, pose.y, pose.z)
    return Call(
        actor.id, actor.blueprint.id, radio.channel, radio.power, place, below, actor.parent, []
    )


def announce(around: Surroundings, clock: Clock, sensor: Sensor) -> None:
    """Radios an awareness message when one is due."""
    rhythm, carrier = sensor.equipment.rhythm, around.actors.carrier(sensor.actor)
    car = carrier if carrier is not None and carrier.family is Family.VEHICLE else None
    pose = around.actors.pose(sensor.actor if car is None else car)
    speed = None if car is None else _forward(around, car)
    if not rhythm.due(clock.elapsed, pose, speed):
        return
    station = sensor.actor.id if carrier is None else carrier.id
    type, motion = cam.ROAD_SIDE_UNIT, _place(around, sensor, pose)
    if car is not None and speed is not None:
        type, motion = _type(car), _motion(around, sensor, car, motion, speed)
    lamps = car is not None and rhythm.tells_lamps(clock.elapsed)
    message = cam.awareness(station, type, clock.elapsed, motion, lamps)
    around.air.send(clock.frame, replace(_call(around, sensor), messages=[message]))


def pass_on(around: Surroundings, clock: Clock, sensor: Sensor) -> None:
    """Radios what clients have said since the last tick, if anything."""
    queue = sensor.equipment.queue
    if queue:
        station = sensor.actor.parent or sensor.actor.id
        messages = [cam.custom(station, text) for text in queue]
        queue.clear()
        around.air.send(clock.frame, replace(_call(around, sensor), messages=messages))


def receive(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns all that arrives in this tick in one message; [] when nothing does."""
    own, heard = _call(around, sensor), []
    for call in around.air.receive_calls(clock.frame, own):
        power = _arriving(around, sensor, own, call)
        if power is not None:
            for message in call.messages:
                message["power"] = power  # of this receiver; a copy of a record would not have
                heard.append(message.tobytes())  # the zeros between its fields
    return [(b"".join(heard),)] if heard else []


def _arriving(around: Surroundings, sensor: Sensor, own: Call, call: Call) -> float | None:
    """Returns the power in dBm at which a call arrives; None when it is too far or too weak.

    Draws its fading.
    """
    radio = sensor.equipment.radio
    if sum((a - b) ** 2 for a, b in zip(own.place, call.place, strict=True)) >= radio.reach**2:
        return None
    carriers = (own.carrier, call.carrier)
    tops = find_crossed_boxes(around.cars(), call.place, own.place, carriers)
    blocked = find_crossed_boxes(around.get_roadside_boxes(), call.place, own.place)
    way = Way.BUILDING if blocked else Way.VEHICLE if tops else Way.CLEAR
    fading = radio.deviation(way) * float(sensor.rng.standard_normal())
    lost = loss(radio, way, call, own.place, own.ground, tops) + fading
    power = call.power + radio.gain - lost
    return power if power >= radio.sensitivity else None


def _forward(around: Surroundings, carrier: Actor) -> float:
    """Returns the speed in m/s of the carrier along its heading, negative in reverse."""
    x, y, _ = around.actors.velocity(carrier)
    yaw = around.actors.pose(carrier).yaw
    return x * cos(yaw) + y * sin(yaw)


def _type(carrier: Actor) -> int:
    """Returns the code of the carrier's station type; emergency vehicles have a code of their own."""
    a = carrier.attributes
    return cam.EMERGENCY if a["special_type"] == "emergency" else cam.STATIONS[a["base_type"]]


def _place(around: Surroundings, sensor: Sensor, pose: Pose) -> cam.Motion:
    """Returns the noisy geographic position (deg, deg, m) of a pose in CARLA's frame."""
    x, y, _ = vector_from_carla(pose.x, pose.y, pose.z)
    noise, n = sensor.rng.standard_normal(3), sensor.number
    latitude, longitude = around.map.geolocation(x, y)
    latitude, longitude, altitude = (
        float(value + n(f"noise_{name}_bias") + noise[k] * n(f"noise_{name}_stddev"))
        for k, (name, value) in enumerate((("lat", latitude), ("lon", longitude), ("alt", pose.z)))
    )
    return cam.Motion(latitude, longitude, altitude)


def _motion(
    around: Surroundings, sensor: Sensor, carrier: Actor, place: cam.Motion, speed: float
) -> cam.Motion:
    """Returns the motion of a vehicle, felt at its origin, with the sensor's noise."""
    assert carrier.body is not None
    row, moving = around.moving.row(carrier.body), around.moving
    felt = inertial.imu(Pose(0.0, 0.0), moving.states, row, around.gravity)
    noise, n = sensor.rng.standard_normal(6), sensor.number
    force = vector_from_carla(*felt.force)
    x, y, z = (
        float(force[k] + noise[k] * n(f"noise_accel_stddev_{axis}")) for k, axis in enumerate("xyz")
    )
    rate = turn_from_carla(*felt.rate)[2]
    rate += n("noise_yawrate_bias") + noise[3] * n("noise_yawrate_stddev")
    heading = degrees(felt.compass) + n("noise_head_bias") + noise[4] * n("noise_head_stddev")
    return replace(
        place,
        heading=float(heading),
        speed=float(speed + noise[5] * n("noise_vel_stddev_x")),
        force=(x, y, z),
        yaw_rate=degrees(rate),
        size=(2.0 * carrier.half[0], 2.0 * carrier.half[1]),
        lamps=around.lamps(carrier),
    )
