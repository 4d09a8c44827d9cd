"""IMU and GNSS: what CARLA documents of them, with its noise attributes."""

from __future__ import annotations

from skidpad.core.frames import ImuReading
from skidpad.core.maths.lefthanded import turn_from_carla, vector_from_carla
from skidpad.sensors import inertial
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import codec
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings


def _measure_motion(around: Surroundings, actor: Actor) -> ImuReading:
    """Returns what a unit on its carrier feels; without one it stands still."""
    carrier = around.actors.carrier(actor)
    if carrier is None or carrier.body is None:
        return inertial.imu_at_rest(around.actors.pose(actor), around.gravity)
    row = around.moving.row(carrier.body)
    return inertial.imu(actor.mount, around.moving.states, row, around.gravity)


def imu(around: Surroundings, _: Clock, sensor: Sensor) -> list[Message]:
    """Returns specific force, rate of turn and compass in the sensor's axes, with noise, as a message."""
    felt = _measure_motion(around, sensor.actor)
    noise, n = sensor.rng.standard_normal(6), sensor.number
    force = [
        v + noise[k] * n(f"noise_accel_stddev_{axis}")
        for k, (axis, v) in enumerate(zip("xyz", vector_from_carla(*felt.force), strict=True))
    ]
    rate = [
        v + n(f"noise_gyro_bias_{axis}") + noise[3 + k] * n(f"noise_gyro_stddev_{axis}")
        for k, (axis, v) in enumerate(zip("xyz", turn_from_carla(*felt.rate), strict=True))
    ]
    return [(codec.pack([force, rate, felt.compass]),)]


def gnss(around: Surroundings, _: Clock, sensor: Sensor) -> list[Message]:
    """Returns latitude and longitude in deg and altitude in m, with noise, as a message.

    Latitude grows with CARLA's y, as in the client's own map, although the IMU's north is its -y.
    """
    pose = around.actors.pose(sensor.actor)
    x, y, _z = vector_from_carla(pose.x, pose.y, pose.z)
    latitude, longitude = around.map.geolocation(x, y)
    noise, n = sensor.rng.standard_normal(3), sensor.number
    values = [
        v + n(f"noise_{name}_bias") + noise[k] * n(f"noise_{name}_stddev")
        for k, (name, v) in enumerate((("lat", latitude), ("lon", longitude), ("alt", pose.z)))
    ]
    return [(codec.pack(values),)]
