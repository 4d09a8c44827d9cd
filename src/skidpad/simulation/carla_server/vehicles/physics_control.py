"""VehiclePhysicsControl: what a client reads and writes, and which of it acts.

Acting members: mass, drag, the engine's torque curve, revolutions and ratios of gears, every wheel's
tire_friction, radius, brake and handbrake torque and steering angle.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import isclose
from typing import Any

import msgspec
import numpy as np

from skidpad.physics.types import VehicleType
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.vehicles.engine import (
    Engine,
    at_wheels,
    engine_of,
    parse_engine,
)

WHEELS = 4
CM = 100.0  # a wheel's radius and position travel in cm
RADIUS_LEAST = 10.0  # cm

STEERING_CURVE = [[0.0, 1.0], [20.0, 0.9], [60.0, 0.8], [120.0, 0.7]]
MEMBERS = 17
DRAG_PER_AREA = 0.3 / 0.7  # CARLA's coefficient for a car of 0.7 m^2 drag area; estimated


@dataclass(frozen=True, slots=True)
class PhysicsControl:
    """A vehicle's physics as last set, in the wire's order and units; wheels FL, FR, RL, RR."""

    engine: Engine
    mass: float
    drag: float
    com: list[float]
    steering_curve: list[list[float]]
    wheels: tuple[tuple[Any, ...], ...]
    sweep: bool = False
    tire_friction: np.ndarray[Any, Any] = field(default_factory=lambda: np.full(WHEELS, 3.5))

    @classmethod
    def of(cls, model: VehicleType) -> PhysicsControl:
        """Returns what a fresh vehicle of this type reports."""
        wheels = tuple(
            (
                model.tire_friction,
                0.25,
                model.steer_max_deg if w < 2 else 0.0,
                model.wheel_radius * CM,
                model.brake_torque_front if w < 2 else model.brake_torque_rear,
                0.0 if w < 2 else model.handbrake_torque,
                2.0,
                model.stiffness_front if w < 2 else model.stiffness_rear,
                1000.0,
                [0.0, 0.0, 0.0],
            )
            for w in range(WHEELS)
        )
        return cls(
            engine_of(model),
            model.mass,
            model.drag_area * DRAG_PER_AREA,
            [0.0, 0.0, 0.0],
            STEERING_CURVE,
            wheels,
            tire_friction=np.full(WHEELS, model.tire_friction),
        )

    def pack(self, positions: list[list[float]]) -> list[Any]:
        """Returns the control for the wire; positions: wheel centres in the world, cm, CARLA's axes."""
        wheels = [[*w[:9], p] for w, p in zip(self.wheels, positions, strict=True)]
        return [
            *self.engine.pack(),
            self.mass,
            self.drag,
            self.com,
            self.steering_curve,
            wheels,
            self.sweep,
        ]


def parse_physics(value: Any) -> PhysicsControl:
    """Returns the physics of a call.

    Two wheels of a two-wheeler count for both sides. WireError for others.
    """
    v = wire.items(value, "physics control", MEMBERS)
    wheels = [wire.items(w, "wheel", 10) for w in wire.items(v[15], "wheels")]
    if len(wheels) == 2:
        wheels = [wheels[0], wheels[0], wheels[1], wheels[1]]
    if len(wheels) != WHEELS:
        raise wire.WireError(f"physics control: needs {WHEELS} wheels, got {len(wheels)}")
    packed = []
    for w in wheels:
        numbers = wire.numbers(w[:9], "wheel", 9)
        if min(numbers[0], *numbers[3:6]) < 0.0:
            raise wire.WireError("wheel: friction, radius and torques must not be negative")
        packed.append((*numbers, wire.vector(w[9], "wheel.position")))
    mass = wire.number(v[11], "physics control.mass")
    if not 1.0 <= mass <= 1.0e6:
        raise wire.WireError(f"physics control.mass must be between 1 and 1e6 kg, got {mass:g}")
    return PhysicsControl(
        engine=parse_engine(v[:11]),
        mass=mass,
        drag=max(wire.number(v[12], "physics control.drag_coefficient"), 0.0),
        com=list(wire.vector(v[13], "physics control.center_of_mass")),
        steering_curve=[wire.numbers(p, "steering curve", 2) for p in wire.items(v[14], "curve")],
        wheels=tuple(packed),
        sweep=wire.flag(v[16], "physics control.use_sweep"),
        tire_friction=np.array([w[0] for w in packed]),
    )


def with_engine(new: PhysicsControl, old: PhysicsControl) -> PhysicsControl:
    """Returns the new physics, with the old one's engine where it tells none."""
    return new if new.engine.is_told else replace(new, engine=old.engine)


def apply_control(model: VehicleType, old: PhysicsControl, new: PhysicsControl) -> VehicleType:
    """Returns the physics type after a client changed members that act; unchanged ones stay exact.

    The same object where none changed. WireError for a wheel that is too small or does not steer.
    """
    front, rear = new.wheels[0], new.wheels[2]
    if front[3] < RADIUS_LEAST or front[2] <= 0.0:
        raise wire.WireError("wheel: radius must be >= 10 cm and max_steer_angle > 0")
    changes: dict[str, Any] = {}
    if not isclose(new.mass, old.mass, rel_tol=1e-6):
        changes["mass"] = new.mass
    if not isclose(new.drag, old.drag, rel_tol=1e-6, abs_tol=1e-9):
        changes["drag_area"] = new.drag / DRAG_PER_AREA
    drive = at_wheels(new.engine, front[3] / CM)
    had = at_wheels(old.engine, old.wheels[0][3] / CM)
    if any(not isclose(a, b, rel_tol=1e-6) for a, b in zip(drive, had, strict=True)):
        changes |= {"force_max": drive.force, "power": drive.power, "speed_max": drive.speed}
    for name, wheel, was, member, scale in (
        ("wheel_radius", front, old.wheels[0], 3, 1.0 / CM),
        ("steer_max_deg", front, old.wheels[0], 2, 1.0),
        ("brake_torque_front", front, old.wheels[0], 4, 1.0),
        ("brake_torque_rear", rear, old.wheels[2], 4, 1.0),
        ("handbrake_torque", rear, old.wheels[2], 5, 1.0),
    ):
        if not isclose(wheel[member], was[member], rel_tol=1e-6):
            changes[name] = wheel[member] * scale
    return msgspec.structs.replace(model, **changes) if changes else model
