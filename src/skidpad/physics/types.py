"""Vehicle types: sizes, masses, wheels, drive and brakes as data with sources (`vehicles.yaml`)."""

from __future__ import annotations

from enum import Enum
from functools import lru_cache
from importlib import resources
from math import radians

import msgspec

from skidpad.core.environment.tyres import find_tyres
from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import ActorKind

TIRE_FRICTION_REFERENCE = 3.5  # the blueprints' own tire_friction, at which mu is mu_ref (B-033)


class DrivenWheels(str, Enum):
    """Driven wheels; all-wheel drive splits evenly."""

    FRONT = "front"
    REAR = "rear"
    ALL = "all"


class VehicleType(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One type of four-wheeled vehicle. Positions are along x from the footprint's centre."""

    title: str
    kind: str  # a vehicle of ActorKind, in lower case
    length: float  # m
    width: float  # m, without mirrors
    height: float  # m
    mass: float  # kg, with driver
    wheelbase: float  # m
    front_overhang: float  # m, bumper to front axle
    track: float  # m, mean of both axles
    cog_height: float  # m
    front_share: float  # of the weight at rest
    wheel_radius: float  # m, rolling
    wheel_inertia: float  # kg m^2, one wheel with its share of the drive line
    tyre_width: float = 0.205  # m, of the tread; usual sizes of such vehicles, an assumption
    tyres: str = ""  # by name, `core.tyres`; empty: those of the run
    drive: DrivenWheels
    power: float  # W at the wheels
    force_max: float  # N at the wheels, lowest gear
    speed_max: float | None = None  # m/s, beyond which the engine does not drive
    engine_drag: float = 0.5  # m/s^2 at closed throttle
    brake_torque_front: float  # N m per wheel at full pedal
    brake_torque_rear: float
    handbrake_torque: float = 3000.0  # N m per rear wheel; carla.WheelPhysicsControl
    steer_max_deg: float = 70.0  # road wheel; carla.WheelPhysicsControl
    steer_rate_deg: float = 70.0  # road wheel per s; 1000 deg/s at the wheel over ratio 14.5
    drag_area: float  # m^2, cw * A
    rolling_resistance: float = 0.011  # of the load; ISO 28580 class C
    # Lateral force per unit slip over load, of the axle: tyre, steering and suspension together.
    # Tyres alone have 11.5 (205/60R15) to 17.5 (245/40R18, sources in `tyre`); front axles give way
    # to the force, rear axles steer with it. Our choice for an understeer of 2 deg/g at 0.1 to 0.4 g.
    stiffness_front: float = 14.0
    stiffness_rear: float = 22.0
    roll_share_front: float = 0.55  # of the lateral load transfer
    pitch_gradient: float = 0.0035  # rad per m/s^2
    roll_gradient: float = 0.0075  # rad per m/s^2
    tire_friction: float = TIRE_FRICTION_REFERENCE  # CARLA's scale
    abs: bool = True
    source: str

    def __post_init__(self) -> None:
        require_choice("vehicle kind", self.kind, [k.name.lower() for k in ActorKind][:4])
        for name in ("length", "width", "height", "mass", "wheelbase", "track", "wheel_radius"):
            require_range(f"vehicle {self.title}: {name}", getattr(self, name), 0.1, 1.0e5)
        require_range(f"vehicle {self.title}: front_share", self.front_share, 0.2, 0.8)
        if self.tyres:
            find_tyres(self.tyres)
        if self.front_overhang + self.wheelbase > self.length:
            raise ConfigError(f"vehicle {self.title}: the rear axle lies behind the rear bumper")

    @property
    def actor_kind(self) -> ActorKind:
        """Returns the kind of actor that this vehicle is."""
        return ActorKind[self.kind.upper()]

    @property
    def x_front_axle(self) -> float:
        """Distance in m of the front axle ahead of the footprint's centre."""
        return 0.5 * self.length - self.front_overhang

    @property
    def x_rear_axle(self) -> float:
        """Returns x of the rear axle in m from the footprint's centre; negative."""
        return self.x_front_axle - self.wheelbase

    @property
    def x_cog(self) -> float:
        """Distance in m of the centre of gravity ahead of the footprint's centre."""
        return self.x_rear_axle + self.front_share * self.wheelbase

    @property
    def yaw_inertia(self) -> float:
        """kg m^2 about the centre of gravity, dynamic index 1: m * a * b.

        Source: Heydinger et al., SAE 1999-01-1336 (measured dynamic indices 0.9 to 1.1).
        """
        return self.mass * self.front_share * (1.0 - self.front_share) * self.wheelbase**2

    @property
    def steer_max(self) -> float:
        """Returns the largest road-wheel angle in rad."""
        return radians(self.steer_max_deg)

    @property
    def a_brake(self) -> float:
        """Deceleration in m/s^2 of the brakes at full pedal, if the tyres give it."""
        torque = 2.0 * (self.brake_torque_front + self.brake_torque_rear)
        return torque / (self.wheel_radius * self.mass)

    @property
    def a_drive(self) -> float:
        """Acceleration in m/s^2 at full throttle in the lowest gear."""
        return self.force_max / self.mass

    @property
    def understeer(self) -> float:
        """Steering angle per lateral acceleration beyond the wheelbase's own, rad s^2/m."""
        return (1.0 / self.stiffness_front - 1.0 / self.stiffness_rear) / G

    @property
    def drive_share_front(self) -> float:
        """Share of the drive force at the front axle."""
        return {DrivenWheels.FRONT: 1.0, DrivenWheels.REAR: 0.0, DrivenWheels.ALL: 0.5}[self.drive]

    @property
    def weight_driven(self) -> float:
        """Share of the weight at rest on the driven wheels."""
        rear = 1.0 - self.front_share
        return {
            DrivenWheels.FRONT: self.front_share,
            DrivenWheels.REAR: rear,
            DrivenWheels.ALL: 1.0,
        }[self.drive]


EGO_TYPE = "mini_cooper_s"


@lru_cache(maxsize=1)
def vehicle_types() -> dict[str, VehicleType]:
    """Returns all types by id, sorted, so that lists made from them are reproducible (A-206)."""
    text = resources.files("skidpad.physics").joinpath("vehicles.yaml").read_bytes()
    types = msgspec.yaml.decode(text, type=dict[str, VehicleType])
    return dict(sorted(types.items()))


def vehicle_type(name: str) -> VehicleType:
    """Returns the type with this id; ConfigError lists the known ones."""
    types = vehicle_types()
    return types[require_choice("vehicle type", name, list(types))]


def traffic_types() -> tuple[str, ...]:
    """Returns ids of passenger cars for background traffic, sorted (A-206), the ego's type among them."""
    return tuple(k for k, t in vehicle_types().items() if t.actor_kind is ActorKind.CAR)
