"""Vehicles: control, physics settings, lamps, telemetry, doors."""

from __future__ import annotations

from typing import Any

from skidpad.core.maths.constants import G
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import Shape, Table
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.ackermann import (
    AckermannDriver,
    AckermannSettings,
    parse_target,
)
from skidpad.simulation.carla_server.vehicles.control import Control
from skidpad.simulation.carla_server.vehicles.engine import revolutions
from skidpad.simulation.carla_server.vehicles.physics_control import (
    apply_control,
    parse_physics,
    with_engine,
)
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicle

TABLE = Table("vehicles")


def vehicle_of(served: Served, id: Any) -> Vehicle:
    """Returns the living vehicle with this actor id; CallError where there is none."""
    return served.episode.vehicles.of(served.episode.actors.get(id, Family.VEHICLE).id)


def parse_control(value: Any) -> Control:
    """Returns a call's VehicleControl with ISO steer, clamped to its ranges; WireError for another shape."""
    v = wire.items(value, "control", 7)
    throttle, steer, brake = wire.numbers(v[:3], "control", 3)
    return Control(
        throttle=min(max(throttle, 0.0), 1.0),
        steer=wire.iso_steer(min(max(steer, -1.0), 1.0)),
        brake=min(max(brake, 0.0), 1.0),
        hand_brake=wire.flag(v[3], "control.hand_brake"),
        reverse=wire.flag(v[4], "control.reverse"),
        manual=wire.flag(v[5], "control.manual_gear_shift"),
        gear=wire.integer(v[6], "control.gear", -(2**31), 2**31 - 1),
    )


@TABLE.method("apply_control_to_vehicle", Shape.VOID)
def apply_control_to_vehicle(served: Served, id: Any, control: Any) -> None:
    """Sets a vehicle's control, held until the next one; ends Ackermann control."""
    vehicle = vehicle_of(served, id)
    vehicle.control = parse_control(control)
    vehicle.driver = None


@TABLE.method("apply_ackermann_control_to_vehicle", Shape.VOID)
def apply_ackermann_control_to_vehicle(served: Served, id: Any, control: Any) -> None:
    """Sets the target of two controllers, which drive the vehicle from now on."""
    vehicle = vehicle_of(served, id)
    target = parse_target(control)
    if vehicle.driver is None:
        vehicle.driver = AckermannDriver(vehicle.ackermann)
    vehicle.driver.target = target


@TABLE.method("get_ackermann_controller_settings")
def get_ackermann_controller_settings(served: Served, id: Any) -> list[float]:
    """Returns the gains of a vehicle's Ackermann controller."""
    return vehicle_of(served, id).ackermann.pack()


@TABLE.method("apply_ackermann_controller_settings", Shape.VOID)
def apply_ackermann_controller_settings(served: Served, id: Any, settings: Any) -> None:
    """Sets the gains of a vehicle's Ackermann controller."""
    vehicle = vehicle_of(served, id)
    vehicle.ackermann = AckermannSettings(*wire.numbers(settings, "ackermann settings", 6))
    if vehicle.driver is not None:
        vehicle.driver.settings = vehicle.ackermann


@TABLE.method("get_physics_control")
def get_physics_control(served: Served, id: Any) -> list[Any]:
    """Returns the physics as last set, with the wheels' present places."""
    actor = served.episode.actors.get(id, Family.VEHICLE)
    vehicle = served.episode.vehicles.of(actor.id)
    pose = served.episode.actors.pose(actor)
    places = []
    for x, y in wheel_centres(vehicle):
        place = pose.moved(forward=x, left=y, up=vehicle.type.wheel_radius)
        px, py, pz = wire.iso_to_wire((place.x, place.y, place.z))
        places.append([100.0 * px, 100.0 * py, 100.0 * pz])
    return vehicle.physics.pack(places)


def wheel_centres(vehicle: Vehicle) -> list[tuple[float, float]]:
    """Returns x forward and y left of FL, FR, RL, RR from the footprint's centre, m."""
    t = vehicle.type
    half = t.track / 2.0
    return [
        (t.x_front_axle, half),
        (t.x_front_axle, -half),
        (t.x_rear_axle, half),
        (t.x_rear_axle, -half),
    ]


@TABLE.method("apply_physics_control", Shape.VOID)
def apply_physics_control(served: Served, id: Any, control: Any) -> None:
    """Replaces a vehicle's physics and its type.

    What acts: mass, drag, engine and gears, wheels' friction, radius, brakes and steering angle.
    """
    vehicle = vehicle_of(served, id)
    new = with_engine(parse_physics(control), vehicle.physics)
    model = apply_control(vehicle.type, vehicle.physics, new)
    served.episode.vehicles.reshape(vehicle.actor, new, model)


@TABLE.method("get_vehicle_light_state")
def get_vehicle_light_state(served: Served, id: Any) -> list[int]:
    """Returns the flags of a vehicle's lamps."""
    return [vehicle_of(served, id).lights]


@TABLE.method("get_vehicle_light_states")
def get_vehicle_light_states(served: Served) -> list[list[int]]:
    """Returns actor id and lamp flags of all vehicles."""
    return [[v.actor, v.lights] for v in served.episode.vehicles]


@TABLE.method("set_vehicle_light_state", Shape.VOID)
def set_vehicle_light_state(served: Served, id: Any, state: Any) -> None:
    """Sets a vehicle's lamp flags; the lamps are kept, not drawn."""
    flags = state[0] if isinstance(state, list) and len(state) == 1 else state
    vehicle_of(served, id).lights = wire.integer(flags, "light state", 0, 2**32 - 1)


@TABLE.method("get_telemetry_data")
def get_telemetry_data(served: Served, id: Any) -> list[Any]:
    """Returns speed, pedals, revolutions and gear, and per wheel friction, spin and load, as on the wire."""
    vehicle = vehicle_of(served, id)
    i = served.episode.vehicles.row(vehicle.actor)
    fleet, c = served.episode.moving.fleet, vehicle.control
    wheels = []
    for w in range(4):
        load, mu = float(fleet.wheels.load[i, w]), float(fleet.mu[i, w])
        rest = vehicle.type.mass * G / 4.0
        omega = float(fleet.wheels.omega[i, w])
        friction = float(fleet.tire_friction[i, w])
        wheels.append(
            [friction, 0.0, 0.0, omega, load, load / rest, 0.0, mu * load, mu * load, mu, mu]
        )
    engine, radius, speed = vehicle.physics.engine, vehicle.type.wheel_radius, fleet.speed(i)
    gear = vehicle.gear(speed)
    rpm = revolutions(engine, gear, speed, radius)
    return [speed, wire.iso_steer(c.steer), c.throttle, c.brake, rpm, gear, 0.0, wheels]


@TABLE.method("get_wheel_steer_angle")
def get_wheel_steer_angle(served: Served, id: Any, wheel: Any) -> float:
    """Returns a wheel's angle in deg, right positive; rear wheels do not steer."""
    vehicle = vehicle_of(served, id)
    if wire.integer(wheel, "wheel", 0, 8) > 1:
        return 0.0
    row = served.episode.vehicles.row(vehicle.actor)
    return wire.yaw_to_wire(float(served.episode.moving.fleet.wheels.steer[row]))


@TABLE.method("get_wheel_pitch_angle")
def get_wheel_pitch_angle(served: Served, id: Any, wheel: Any) -> float:
    """Returns 0 deg, as the turning of wheels is not tracked."""
    vehicle_of(served, id)
    wire.integer(wheel, "wheel", 0, 8)
    return 0.0


def _accept_without_effect(name: str, reason: str) -> None:
    """Registers a call that checks its actor and has no effect, for the given reason."""

    @TABLE.method(name, Shape.VOID, without_effect=reason)
    def accept_call(served: Served, id: Any, a: Any = None, b: Any = None, c: Any = None, d: Any = None,
                 e: Any = None, f: Any = None) -> None:  # fmt: skip
        """Checks that the actor is alive and does nothing else."""
        del a, b, c, d, e, f
        served.episode.actors.get(id)


for _name, _reason in {
    "set_wheel_steer_direction": "wheels are drawn by the physics alone",
    "set_wheel_pitch_angle": "wheels are drawn by the physics alone",
    "open_vehicle_door": "doors do not open",
    "close_vehicle_door": "doors do not open",
    "set_actor_autopilot": "the Traffic Manager lives in the client",
    "show_vehicle_debug_telemetry": "nothing is drawn on a screen",
    "set_ignored_vehicles": "vehicles collide with all others",
    "enable_carsim": "there is no CarSim",
    "use_carsim_road": "there is no CarSim",
    "enable_chrono_physics": "there is no Chrono",
    "restore_physx_physics": "there is one physics",
}.items():
    _accept_without_effect(_name, _reason)
