"""What a person at the desk does while a run is driven. An input acts in the tick that it is given.

A run with the same inputs at the same ticks is the same run: they are stored in its folder
(`recording/run/inputs.py`) and given again by `skidpad rerun`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from msgspec import Struct

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import require_range
from skidpad.core.run import Function
from skidpad.core.vocabulary import GripModel, LightState, RangeModel
from skidpad.core.weather import Weather


class Method(str, Enum):
    """The device by which a person drives (A-274)."""

    KEYBOARD = "keyboard"
    GAMEPAD = "gamepad"
    WHEEL = "wheel"
    TOUCH = "touch"  # pedals and wheel on a touch screen


class LampSwitch(str, Enum):
    """Where the switch of the headlights stands (A-219)."""

    AUTO = "auto"  # by night and by sight
    OFF = "off"
    LOW = "low"
    HIGH = "high"


class Beam(IntEnum):
    """Which beam the headlights show."""

    OFF = 0
    LOW = 1
    HIGH = 2


class Wheel(Struct, frozen=True, tag="wheel", forbid_unknown_fields=True):
    """The person takes over, or hands back."""

    manual: bool


class Pedals(Struct, frozen=True, tag="pedals", forbid_unknown_fields=True):
    """Where pedals and wheel stand from now on, as the person moves them."""

    throttle: float = 0.0
    brake: float = 0.0
    steer: float = 0.0  # left positive
    handbrake: bool = False
    method: Method = Method.KEYBOARD

    def __post_init__(self) -> None:
        require_range("throttle", self.throttle, 0.0, 1.0)
        require_range("brake", self.brake, 0.0, 1.0)
        require_range("steer", self.steer, -1.0, 1.0)


class Functions(Struct, frozen=True, tag="functions", forbid_unknown_fields=True):
    """Which functions of our stack are on from now on (A-273)."""

    on: tuple[Function, ...]


class Sky(Struct, frozen=True, tag="sky", forbid_unknown_fields=True):
    """The weather from the next tick on, and how it acts."""

    weather: Weather
    grip: GripModel
    range: RangeModel


class Lamps(Struct, frozen=True, tag="lamps", forbid_unknown_fields=True):
    """The switch of the headlights is moved."""

    switch: LampSwitch


class Crowd(Struct, frozen=True, tag="crowd", forbid_unknown_fields=True):
    """Sets the number of background vehicles from now on, at most those of the run and its reserve."""

    vehicles: int

    def __post_init__(self) -> None:
        require_range("vehicles", self.vehicles, 0, 80)


Input = Wheel | Pedals | Functions | Sky | Lamps | Crowd


@dataclass(frozen=True, slots=True)
class Timed:
    """An input and the tick in which it acts."""

    tick: int
    input: Input


@dataclass(frozen=True, slots=True, kw_only=True)
class Outside:
    """What may change around the ego between two steps, on every backend."""

    weather: Weather
    grip: GripModel
    range_model: RangeModel
    beam: Beam | None = None  # None: low beam by night
    mu_ref: float | None = None  # on a dry road; None: as it was (embedded backend)
    # traffic lights that a person has taken over, by OpenDRIVE id, and what they show
    lights: tuple[tuple[int, LightState], ...] = ()
    unseen: frozenset[str] = frozenset()  # actors that no sensor sees (embedded backend)
    # actors whose brake lamps something else than the brake works, and whether they shine (embedded)
    brake_lamps: tuple[tuple[str, bool], ...] = ()
    # as (m/s, rad it blows to), where wind pushes vehicles; None: as it was (embedded backend)
    wind: tuple[float, float] | None = None
    # what lies on parts of the road; None: as it was (embedded backend)
    patches: tuple[SurfacePatch, ...] | None = None
