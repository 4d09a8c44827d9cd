"""IMU and GNSS: what CARLA documents of them, with its noise attributes."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geodesy import geolocation
from skidpad.core.lefthanded import turn_from_carla, vector_from_carla
from skidpad.sensors.inertial import compass
from skidpad.simulation.carla_server import codec
from skidpad.simulation.carla_server.catalogue import Family

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.sensing.sensors import Sensor
    from skidpad.simulation.carla_server.world import World

Floats = NDArray[np.float64]
Motion = tuple[Floats, Floats]


def motion_of_carrier(world: World, sensor: Sensor) -> Motion:
    """(acceleration at the sensor, angular velocity) in world axes, ISO."""
    carrier = world.actors.alive.get(sensor.actor.parent)
    if carrier is None:
        return np.zeros(3), np.zeros(3)
    if carrier.family is not Family.VEHICLE:
        return np.array(carrier.acceleration), np.array(carrier.turn)
    s, i = world.vehicles.fleet.states, world.vehicles.slots[carrier.id]
    c, sn = cos(s.yaw[i]), sin(s.yaw[i])
    rate = float(s.yaw_rate[i])
    lever = sensor.actor.mount
    ax = s.ax[i] - rate * rate * lever.x  # centripetal part of the lever arm
    ay = s.ay[i] - rate * rate * lever.y
    return np.array([ax * c - ay * sn, ax * sn + ay * c, 0.0]), np.array([0.0, 0.0, rate])


def imu(world: World, sensor: Sensor) -> list[tuple[bytes | memoryview, ...]]:
    """Specific force, rate of turn and compass in the sensor's axes."""
    acceleration, turn = motion_of_carrier(world, sensor)
    pose = world.pose(sensor.actor)
    to_sensor = pose.rotation().T
    force = to_sensor @ (acceleration + np.array([0.0, 0.0, world.sensors.gravity]))
    rate = to_sensor @ turn
    noise, n = sensor.rng.standard_normal(6), sensor.number
    out_force = [
        v + noise[k] * n(f"noise_accel_stddev_{axis}")
        for k, (axis, v) in enumerate(zip("xyz", vector_from_carla(*force.tolist()), strict=True))
    ]
    out_rate = [
        v + n(f"noise_gyro_bias_{axis}") + noise[3 + k] * n(f"noise_gyro_stddev_{axis}")
        for k, (axis, v) in enumerate(zip("xyz", turn_from_carla(*rate.tolist()), strict=True))
    ]
    return [(codec.pack([out_force, out_rate, compass(pose)]),)]


def gnss(world: World, sensor: Sensor) -> list[tuple[bytes | memoryview, ...]]:
    """Latitude and longitude in deg, altitude in m.

    Latitude grows with CARLA's y, as in the client's own map, although the IMU's north is its -y.
    """
    pose = world.pose(sensor.actor)
    x, y, _ = vector_from_carla(pose.x, pose.y, pose.z)
    latitude, longitude = geolocation(x, y, *world.map.origin)
    noise, n = sensor.rng.standard_normal(3), sensor.number
    values = [
        v + n(f"noise_{name}_bias") + noise[k] * n(f"noise_{name}_stddev")
        for k, (name, v) in enumerate((("lat", latitude), ("lon", longitude), ("alt", pose.z)))
    ]
    return [(codec.pack(values),)]
