"""The sensors that a stack can ask for, as entries of a registry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from skidpad.core.channels import ChannelView
from skidpad.core.errors import StackError
from skidpad.core.frames import CameraImage, GnssFix, ImuReading, LidarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.objects.registry import Registry, load_factory
from skidpad.core.specs import (
    AIR_THERMOMETER,
    GNSS,
    IMU,
    RAIN_SENSOR,
    SPEEDOMETER,
    CameraSpec,
    ChannelSpec,
    EyesSpec,
    LidarSpec,
    PointSensorSpec,
)
from skidpad.core.traffic.sight import DriverView


class AnySpec(Protocol):
    """What the spec of every sensor has: its id in the frame, and where it is mounted."""

    @property
    def id(self) -> str:
        """Returns the key of its readings in `frame.extra`."""

    @property
    def mount(self) -> Pose:
        """Returns the pose relative to the vehicle's origin."""


R = TypeVar("R")
Measure = Callable[[], Any]  # returns the reading of the present tick


@dataclass(frozen=True, slots=True)
class SensorType:
    """A kind of sensor that a stack can ask for in `sensors()`.

    Attributes:
        name: The name of the kind.
        title: A few words for tables and pages.
        units: What a reading holds, with units.
        spec: The class of its specs, a frozen dataclass with `id` and `mount`.
        reading: The class of its readings: plain data and arrays.
        factory: `factory(spec, host)` returns a function that measures when the stack reads it;
            `host` is a `skidpad.sensors.requested.SensorHost`. A text "module:function" names one
            that is imported when it is needed.
        word: The `kind` of a PointSensorSpec; empty for all others.
        numbers: Sums a reading up as one number per quantity ("name_unit"), written in each tick
            to `readings.parquet` in the run's folder; None: the readings are not recorded.
    """

    name: str
    title: str
    units: str
    spec: type[Any]
    reading: type[Any]
    factory: Callable[[Any, Any], Measure] | str
    word: str = ""
    numbers: Callable[[Any], Mapping[str, float]] | None = None

    def make(self, spec: AnySpec, host: object) -> Measure:
        """Returns a function that measures for this spec in one run."""
        return load_factory(self.factory)(spec, host)

    def describes(self, spec: object) -> bool:
        """Tells whether a spec is of this kind."""
        if not isinstance(spec, self.spec):
            return False
        return not self.word or getattr(spec, "kind", "") == self.word


def _own_types() -> tuple[SensorType, ...]:
    """Returns the sensor types that Skidpad itself registers."""
    at, outside = "skidpad.sensors.requested:", "skidpad.sensors.outside:"
    point = PointSensorSpec
    return (
        SensorType("camera", "Camera", "pixels", CameraSpec, CameraImage, at + "make_camera"),
        SensorType(
            "lidar", "Rotating lidar", "m, intensity 0 to 1", LidarSpec, LidarPoints,
            at + "make_lidar",
        ),
        SensorType(GNSS, "GNSS antenna", "deg, deg, m", point, GnssFix, at + "make_gnss", GNSS),
        SensorType(
            IMU, "Inertial unit", "m/s^2, rad/s, rad", point, ImuReading, at + "make_imu", IMU
        ),
        SensorType(
            SPEEDOMETER, "Speedometer", "m/s", point, float, at + "make_speedometer", SPEEDOMETER
        ),
        SensorType(
            "eyes", "Eyes of a human driver", "m, m/s, rad", EyesSpec, DriverView, at + "make_eyes"
        ),
        SensorType(
            "channel", "All sensors of a channel", "m, m/s, rad", ChannelSpec, ChannelView,
            at + "make_channel",
        ),
        SensorType(
            RAIN_SENSOR, "Rain sensor of the wiper", "stage 0 to 3", point, int,
            outside + "make_rain_sensor", RAIN_SENSOR,
        ),
        SensorType(
            AIR_THERMOMETER, "Thermometer in the bumper", "deg C", point, float,
            outside + "make_thermometer", AIR_THERMOMETER,
        ),
    )  # fmt: skip


SENSORS = Registry("sensor", "skidpad.sensors", SensorType, _own_types)


def read_sensor(frame: SensorFrame, id: str, kind: type[R]) -> R:
    """Returns the reading of a sensor that a stack asked for; StackError for none, or another kind.

    kind: the `reading` of the sensor's type.
    """
    if id not in frame.extra:
        raise StackError(f"sensor {id!r} was not asked for: `sensors()` must return its spec")
    found = frame.extra[id]
    if not isinstance(found, kind):
        raise StackError(f"sensor {id!r} must read {kind.__name__}, got {type(found).__name__}")
    return found


def find_sensor_type(spec: object) -> SensorType | None:
    """Returns the kind of sensor that a spec describes; None: no registered kind has such specs."""
    kinds = (source.load() for source in SENSORS.sources().values())  # packages only where need be
    return next((kind for kind in kinds if kind.describes(spec)), None)
