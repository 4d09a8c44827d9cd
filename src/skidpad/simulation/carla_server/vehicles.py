"""Vehicles: clients' commands, physics settings and forces on one side, the fleet on the other.

Slots are the fleet's rows; the fleet is rebuilt when a vehicle comes or goes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin

import msgspec
import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.fleet import Fleet
from skidpad.physics.types import VehicleType, vehicle_type
from skidpad.simulation.carla_server.ackermann import AckermannDriver, AckermannSettings
from skidpad.simulation.carla_server.catalogue import Blueprint
from skidpad.simulation.carla_server.physics_control import PhysicsControl
from skidpad.simulation.carla_server.wire import Vector

Floats = NDArray[np.float64]

MODELS = {  # physics type that stands for a blueprint of this kind; sizes are the blueprint's own
    ActorKind.CAR: "mini_cooper_s",
    ActorKind.VAN: "van",
    ActorKind.TRUCK: "truck",
    ActorKind.BUS: "bus",
    ActorKind.MOTORCYCLE: "mini_cooper_s",
    ActorKind.BICYCLE: "mini_cooper_s",
}
"""Two-wheelers are narrow cars to the physics: they do not lean (listed as a difference)."""

STICKY_SPEED = 0.2  # m/s below which a vehicle without throttle comes to rest and stays there
STICKY_TIME = 1.0  # s for which a push frees it; both as PhysX's sticky tyres


@dataclass(slots=True)
class Control:
    """VehicleControl as last applied; ISO steer."""

    throttle: float = 0.0
    steer: float = 0.0
    brake: float = 0.0
    hand_brake: bool = False
    reverse: bool = False
    manual: bool = False
    gear: int = 0


@dataclass(slots=True, eq=False)
class Vehicle:
    """What the server knows about one vehicle beside its motion."""

    actor: int
    type: VehicleType
    physics: PhysicsControl
    control: Control = field(default_factory=Control)
    driver: AckermannDriver | None = None  # while Ackermann commands drive it
    ackermann: AckermannSettings = field(default_factory=AckermannSettings)
    constant_velocity: Vector | None = None  # m/s in the body frame
    simulated: bool = True  # set_simulate_physics
    collides: bool = True
    pushed: float = 0.0  # s for which a push still frees it
    lights: int = 0  # VehicleLightState flags
    lane: int = -1  # hint for projection
    speed_limit: float = 30.0 / 3.6  # m/s; CARLA's default until the first sign


def model_of(blueprint: Blueprint) -> VehicleType:
    """The physics type of a blueprint: its class's type, scaled to the blueprint's size."""
    base = vehicle_type(MODELS[blueprint.kind])
    length, width, height = blueprint.size
    scale = length / base.length
    mass = base.mass * scale * (width / base.width) * (height / base.height)
    return msgspec.structs.replace(
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
    )


class Vehicles:
    """All vehicles, in the fleet's order."""

    def __init__(self) -> None:
        self.members: list[Vehicle] = []
        self.slots: dict[int, int] = {}  # by actor id
        self.dt = 0.05
        self.fleet = Fleet((), self.dt)
        self.commands: Floats = np.zeros((0, 5))

    def __len__(self) -> int:
        return len(self.members)

    def of(self, actor: int) -> Vehicle:
        """The vehicle that is this actor."""
        return self.members[self.slots[actor]]

    def pose(self, actor: int) -> Pose:
        """Where it is."""
        return self.fleet.states.pose(self.slots[actor])

    def add(self, actor: int, blueprint: Blueprint, pose: Pose) -> Vehicle:
        """A new vehicle at rest."""
        model = model_of(blueprint)
        vehicle = Vehicle(actor, model, PhysicsControl.of(model))
        self._rebuild([*self.members, vehicle], [*range(len(self.members)), None])
        self.fleet.place(len(self.members) - 1, pose)
        return vehicle

    def remove(self, actor: int) -> None:
        """Take a vehicle out."""
        slot = self.slots[actor]
        kept = [i for i in range(len(self.members)) if i != slot]
        self._rebuild([self.members[i] for i in kept], list(kept))

    def replace_type(self, actor: int, model: VehicleType) -> None:
        """Other physics for a vehicle that keeps its motion."""
        self.of(actor).type = model
        self._rebuild(self.members, list(range(len(self.members))))

    def set_step(self, dt: float) -> None:
        """Advance by dt from now on."""
        if dt != self.dt:
            self.dt = dt
            self._rebuild(self.members, list(range(len(self.members))))

    def clear(self) -> None:
        """No vehicle."""
        self._rebuild([], [])

    def _rebuild(self, members: list[Vehicle], origins: list[int | None]) -> None:
        """A fleet of `members`; member i goes on from row origins[i] of the old one."""
        old, old_commands = self.fleet, self.commands
        self.members = list(members)
        self.slots = {v.actor: i for i, v in enumerate(self.members)}
        self.fleet = Fleet([v.type for v in self.members], self.dt)
        self.commands = np.zeros((len(members), 5))
        for i, origin in enumerate(origins):
            if origin is None:
                continue
            for new_column, column in zip(self.fleet.states, old.states, strict=True):
                new_column[i] = column[origin]
            for new_column, column in zip(self.fleet.wheels, old.wheels, strict=True):
                new_column[i] = column[origin]
            self.fleet.mu[i] = old.mu[origin]
            self.commands[i] = old_commands[origin]
        for i, vehicle in enumerate(self.members):
            self.fleet.tire_friction[i] = vehicle.physics.tire_friction

    def teleport(self, actor: int, pose: Pose) -> None:
        """Put it elsewhere; its velocity is kept, as CARLA does."""
        s, i = self.fleet.states, self.slots[actor]
        s.x[i], s.y[i], s.z[i] = pose.x, pose.y, pose.z
        s.yaw[i], s.pitch[i], s.roll[i] = pose.yaw, pose.pitch, pose.roll
        self.members[i].lane = -1

    def set_velocity(self, actor: int, velocity: Vector) -> None:
        """Set the velocity in world axes and let the wheels roll with it."""
        s, i = self.fleet.states, self.slots[actor]
        s.vx[i], s.vy[i] = velocity[0], velocity[1]
        along = velocity[0] * cos(s.yaw[i]) + velocity[1] * sin(s.yaw[i])
        self.fleet.wheels.omega[i] = along / self.fleet.params.wheel_radius[i]
        self.members[i].pushed = STICKY_TIME if any(velocity) else 0.0

    def push(self, actor: int, impulse: Vector, point: Vector | None = None) -> None:
        """An impulse in N s at a point of the world, the centre of gravity when None."""
        s, p, i = self.fleet.states, self.fleet.params, self.slots[actor]
        if point is None:
            x = s.x[i] + p.x_cog[i] * cos(s.yaw[i])
            y = s.y[i] + p.x_cog[i] * sin(s.yaw[i])
        else:
            x, y = point[0], point[1]
        self.fleet.apply_impulse(i, (impulse[0], impulse[1]), (x, y))
        self.members[i].pushed = STICKY_TIME

    def twist(self, actor: int, moment: float) -> None:
        """An angular impulse about the vertical in N m s."""
        i = self.slots[actor]
        self.fleet.states.yaw_rate[i] += moment / self.fleet.params.yaw_inertia[i]
        self.members[i].pushed = STICKY_TIME

    def step(self, mu: Floats, grade: Floats, bank: Floats) -> None:
        """One tick of driving: commands, physics, and those that move by other rules."""
        for i, vehicle in enumerate(self.members):
            if vehicle.driver is not None:
                vehicle.driver.drive(vehicle.control, self.fleet, i, self.dt)
            c = vehicle.control
            reverse = c.reverse or (c.manual and c.gear < 0)
            throttle = 0.0 if c.manual and c.gear == 0 else c.throttle
            brake = 1.0 if throttle == 0.0 and self._sticks(vehicle) else c.brake
            self.commands[i] = (throttle, brake, c.steer, c.hand_brake, reverse)
        active = np.array([v.simulated for v in self.members], dtype=np.bool_)
        self.fleet.step(self.commands, mu, grade, bank, active)
        for i, vehicle in enumerate(self.members):
            if vehicle.constant_velocity is not None:
                self._hold_velocity(i, vehicle.constant_velocity)
            elif not vehicle.simulated:
                _stand(self.fleet.states, i)

    def _sticks(self, vehicle: Vehicle) -> bool:
        """Whether it stands, so that a slope does not set it rolling."""
        if vehicle.pushed > 0.0:
            vehicle.pushed -= self.dt
            return False
        return self.speed(vehicle.actor) < STICKY_SPEED

    def _hold_velocity(self, i: int, velocity: Vector) -> None:
        s = self.fleet.states
        c, sn = cos(s.yaw[i]), sin(s.yaw[i])
        vx = velocity[0] * c - velocity[1] * sn
        vy = velocity[0] * sn + velocity[1] * c
        self.set_velocity(self.members[i].actor, (vx, vy, 0.0))

    def speed(self, actor: int) -> float:
        """m/s, never negative."""
        s, i = self.fleet.states, self.slots[actor]
        return hypot(s.vx[i], s.vy[i])


def _stand(states: ActorStates, i: int) -> None:
    states.vx[i] = states.vy[i] = states.yaw_rate[i] = states.ax[i] = states.ay[i] = 0.0
