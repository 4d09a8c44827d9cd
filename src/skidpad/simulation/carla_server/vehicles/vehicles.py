"""Vehicles: what clients told them, and the commands that follow for the moving world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import atan2, radians

import msgspec
import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.types import VehicleType, vehicle_type
from skidpad.physics.vehicle import steer_share
from skidpad.simulation.carla_server.actors.catalogue import Blueprint
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.carla_server.vehicles.ackermann import AckermannDriver, AckermannSettings
from skidpad.simulation.carla_server.vehicles.control import Control
from skidpad.simulation.carla_server.vehicles.engine import (
    at_wheels,
    engine_of,
    gear_at,
    shift_speeds,
)
from skidpad.simulation.carla_server.vehicles.physics_control import PhysicsControl
from skidpad.simulation.world.interventions import push, set_tyres, set_velocity, twist
from skidpad.simulation.world.rows import Newcomer
from skidpad.simulation.world.world import World

MODELS = {  # physics type that stands for a blueprint of this kind; sizes are the blueprint's own
    ActorKind.CAR: "mini_cooper_s",
    ActorKind.VAN: "van",
    ActorKind.TRUCK: "truck",
    ActorKind.BUS: "bus",
    ActorKind.MOTORCYCLE: "mini_cooper_s",
    ActorKind.BICYCLE: "mini_cooper_s",
}
"""Two-wheelers are narrow cars to the physics: they do not lean (listed as a difference)."""
TWO_WHEELERS = (ActorKind.MOTORCYCLE, ActorKind.BICYCLE)
LEAN_SHARE = 0.8  # of the grip across that a rider uses; more makes a rider fall (assumption)

# Steering as clients' controllers expect it, the Traffic Manager's among them: under it, lorries that
# steer as slowly as real ones leave their lane in every junction.
STEER_MAX_DEG = 70.0  # road wheel; carla.WheelPhysicsControl's own
STEER_PER_S = (
    2.5  # of all of it; SteeringInputRate.RiseRate of Unreal's wheeled vehicles (public source)
)
STICKY_SPEED = 0.2  # m/s below which a vehicle without throttle comes to rest and stays there
STICKY_TIME = 1.0  # s for which a push frees it; both as PhysX's sticky tyres


@dataclass(slots=True, eq=False)
class Vehicle:
    """What the server knows about one vehicle beside its motion."""

    actor: int
    body: int  # its id in the moving world
    type: VehicleType
    physics: PhysicsControl
    shifts: tuple[float, ...] = ()  # m/s at which its box shifts up
    control: Control = field(default_factory=Control)
    driver: AckermannDriver | None = None  # while Ackermann commands drive it
    ackermann: AckermannSettings = field(default_factory=AckermannSettings)
    sticky: bool = True  # a control holds until the next one; else for one tick
    pushed: float = 0.0  # s for which a push still frees it
    lights: int = 0  # VehicleLightState flags
    most_throttle: float = 1.0  # with which it drives, whatever its client asks for
    least_brake: float = 0.0
    speed_limit: float = 30.0 / 3.6  # m/s; CARLA's default until the first sign
    is_ridden: bool = False  # two wheels

    def command(self, speed: float, mu: float, dt: float) -> tuple[float, float, float, bool, bool]:
        """Returns throttle, brake, steer, handbrake, reverse of the coming tick of dt s.

        Call it once per tick. Below a speed of STICKY_SPEED in m/s it is held without throttle unless it was
        pushed; a rider steers no further than the grip mu of the tyres allows to lean.
        """
        c = self.control
        throttle = 0.0 if c.manual and c.gear == 0 else min(c.throttle, self.most_throttle)
        brake = max(c.brake, self.least_brake)
        brake = 1.0 if throttle == 0.0 and self._sticks(speed < STICKY_SPEED, dt) else brake
        steer = self._ride(c.steer, speed, mu) if self.is_ridden else c.steer
        return throttle, brake, steer, c.hand_brake, c.reverse or (c.manual and c.gear < 0)

    def _ride(self, steer: float, speed: float, mu: float) -> float:
        """Returns the part of a steer that needs LEAN_SHARE of the grip mu at this speed in m/s."""
        full = radians(self.type.steer_max_deg) * steer_share(speed)
        most = atan2(self.type.wheelbase * LEAN_SHARE * mu * G, speed * speed) / full
        return min(max(steer, -most), most)

    def gear(self, speed: float) -> int:
        """Returns the gear that is in at this speed in m/s, -1 in reverse."""
        c = self.control
        return c.gear if c.manual else -1 if c.reverse else gear_at(self.shifts, speed)

    def _sticks(self, slow: bool, dt: float) -> bool:
        """Returns whether it is held, so that no slope sets it rolling; a push frees it for some dt s."""
        if self.pushed > 0.0:
            self.pushed -= dt
            return False
        return slow


def model_of(blueprint: Blueprint) -> VehicleType:
    """Returns the physics type of a blueprint: its class's type, scaled to the blueprint's size."""
    base = vehicle_type(MODELS[blueprint.kind])
    length, width, height = blueprint.size
    scale = length / base.length
    mass = base.mass * scale * (width / base.width) * (height / base.height)
    model = msgspec.structs.replace(
        base,
        title=blueprint.id,
        length=length,
        width=width,
        height=height,
        mass=mass,
        wheelbase=base.wheelbase * scale,
        front_overhang=base.front_overhang * scale,
        track=max(base.track * width / base.width, 0.3),
        cog_height=base.cog_height * height / base.height,
        power=base.power * mass / base.mass,
        force_max=base.force_max * mass / base.mass,
        brake_torque_front=base.brake_torque_front * mass / base.mass,
        brake_torque_rear=base.brake_torque_rear * mass / base.mass,
        handbrake_torque=base.handbrake_torque * mass / base.mass,
        steer_max_deg=STEER_MAX_DEG,
        steer_rate_deg=STEER_PER_S * STEER_MAX_DEG,
    )
    speed_max = at_wheels(engine_of(model), model.wheel_radius).speed
    return msgspec.structs.replace(model, speed_max=speed_max)


class Vehicles:
    """All vehicles by actor id, in order of spawning: the order of the moving world's rows."""

    def __init__(self, moving: World) -> None:
        self.moving = moving
        self._by_actor: dict[int, Vehicle] = {}

    def __len__(self) -> int:
        return len(self._by_actor)

    def __iter__(self) -> Iterator[Vehicle]:
        return iter(self._by_actor.values())

    def __contains__(self, actor: int) -> bool:
        return actor in self._by_actor

    def of(self, actor: int) -> Vehicle:
        """Returns the vehicle that is this actor; KeyError where there is none."""
        return self._by_actor[actor]

    def row(self, actor: int) -> int:
        """Returns an actor's row in the moving world."""
        return self.moving.row(self._by_actor[actor].body)

    def add(self, actor: int, blueprint: Blueprint, pose: Pose) -> Vehicle:
        """Adds a vehicle at rest at the pose, with a body in the moving world, and returns it."""
        model = model_of(blueprint)
        body = self.moving.add(Newcomer(model, type=blueprint.id), pose)
        is_ridden = blueprint.kind in TWO_WHEELERS
        vehicle = Vehicle(actor, body, model, PhysicsControl.of(model), is_ridden=is_ridden)
        vehicle.shifts = shift_speeds(vehicle.physics.engine, model.wheel_radius)
        self._by_actor[actor] = vehicle
        return vehicle

    def remove(self, actor: int) -> None:
        """Forgets a vehicle; its body leaves with the actor's."""
        del self._by_actor[actor]

    def reshape(self, actor: int, physics: PhysicsControl, model: VehicleType) -> None:
        """Replaces physics, type and tyres of a vehicle, which keeps its motion."""
        vehicle = self._by_actor[actor]
        vehicle.physics = physics
        if model is not vehicle.type:
            vehicle.type = model
            self.moving.reshape(vehicle.body, model)
        vehicle.shifts = shift_speeds(physics.engine, model.wheel_radius)
        set_tyres(self.moving, vehicle.body, physics.tire_friction.tolist())

    def set_velocity(self, actor: int, velocity: Vector) -> None:
        """Sets the velocity in world axes, m/s, and lets the wheels roll with it."""
        vehicle = self._by_actor[actor]
        set_velocity(self.moving, vehicle.body, velocity[0], velocity[1])
        vehicle.pushed = STICKY_TIME if any(velocity) else 0.0

    def push(self, actor: int, impulse: Vector, point: Vector | None = None) -> None:
        """Applies an impulse in N s at a point of the world, the centre of gravity when None."""
        vehicle = self._by_actor[actor]
        at = None if point is None else (point[0], point[1])
        push(self.moving, vehicle.body, (impulse[0], impulse[1]), at)
        vehicle.pushed = STICKY_TIME

    def twist(self, actor: int, moment: float) -> None:
        """Applies an angular impulse about the vertical in N m s."""
        vehicle = self._by_actor[actor]
        twist(self.moving, vehicle.body, moment)
        vehicle.pushed = STICKY_TIME

    def command(self, dt: float) -> None:
        """Writes the commands of the coming tick of dt s into the moving world; call it once per tick."""
        if not self._by_actor:
            return
        fleet = self.moving.fleet
        speed = np.hypot(fleet.states.vx, fleet.states.vy).tolist()
        mu = self.moving.mu[: len(speed)].mean(axis=1).tolist()
        commands = []
        for i, vehicle in enumerate(self):
            if vehicle.driver is not None:
                vehicle.driver.drive(vehicle.control, fleet, i, dt)
            commands.append(vehicle.command(speed[i], mu[i], dt))
        self.moving.commands[: len(commands)] = commands

    def let_go(self) -> None:
        """Ends controls that are not sticky, after the tick in which they have acted."""
        for vehicle in self:
            if not vehicle.sticky:
                vehicle.control = Control()

    def heed(self, limits: list[float]) -> None:
        """Notes the speed limits, m/s by row, where the road gives one (not NaN)."""
        for vehicle, limit in zip(self, limits, strict=False):
            if limit == limit:
                vehicle.speed_limit = limit
