"""What a sensor is and where it is mounted. Poses are ISO 8855, relative to the actor's origin:
the centre of the footprint at road height, x forward."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import radians, tan

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose


class Modality(str, Enum):
    """The quantity that a camera measures per pixel."""

    RGB = "rgb"
    DEPTH = "depth"
    SEMANTIC = "semantic"
    INSTANCE = "instance"


@dataclass(frozen=True, slots=True)
class CameraSpec:
    """A pin-hole camera: x right and y down in the image, square pixels."""

    id: str
    modality: Modality
    width: int  # px
    height: int  # px
    fov_deg: float  # horizontal
    mount: Pose
    shows_own_body: bool = False  # mirrors and top view (decision M-11)
    attributes: dict[str, str] = field(default_factory=dict, hash=False, compare=False)

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ConfigError(
                f"camera {self.id}: size must be >= 1x1 px, got {self.width}x{self.height}"
            )
        if not 1.0 <= self.fov_deg <= 170.0:
            raise ConfigError(
                f"camera {self.id}: fov_deg must be in [1, 170], got {self.fov_deg:g}"
            )

    @property
    def focal(self) -> float:
        """Returns the focal length in px: W / (2 tan(FOV / 2)) (eq. 6, A-040)."""
        return self.width / (2.0 * tan(radians(self.fov_deg) / 2.0))

    @property
    def cx(self) -> float:
        """Returns the column of the principal point in px (A-040)."""
        return self.width / 2.0

    @property
    def cy(self) -> float:
        """Returns the row of the principal point in px."""
        return self.height / 2.0

    @property
    def view(self) -> tuple[Pose, int, int, float, bool]:
        """Returns what decides the raster: cameras with equal views share one pass."""
        return (self.mount, self.width, self.height, self.fov_deg, self.shows_own_body)


@dataclass(frozen=True, slots=True)
class RadarSpec:
    """A radar that samples `points_per_second` random directions (decision M-9)."""

    id: str
    mount: Pose
    horizontal_fov_deg: float = 30.0
    vertical_fov_deg: float = 30.0
    range: float = 150.0  # m
    points_per_second: int = 1500


@dataclass(frozen=True, slots=True)
class LidarSpec:
    """Mounting and properties of a rotating lidar."""

    id: str
    mount: Pose
    channels: int = 32
    range: float = 10.0  # m
    points_per_second: int = 56_000
    rotation_hz: float = 10.0
    upper_fov_deg: float = 10.0
    lower_fov_deg: float = -30.0


GNSS, IMU, SPEEDOMETER = "gnss", "imu", "speedometer"
COLLISION, LANE_INVASION = "collision", "lane_invasion"
RAIN_SENSOR, AIR_THERMOMETER = "rain_sensor", "air_thermometer"
AIR_SENSORS = frozenset({RAIN_SENSOR, AIR_THERMOMETER})  # they change with the weather alone


@dataclass(frozen=True, slots=True)
class PointSensorSpec:
    """GNSS, IMU, speedometer, collision or lane-invasion sensor, rain sensor or thermometer."""

    id: str
    kind: str  # one of the words above
    mount: Pose = Pose(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class EyesSpec:
    """A human driver's eyes; their reading is a `core.sight.DriverView`."""

    id: str
    reaction: float = 1.0  # s by which others and lights are seen late
    mount: Pose = Pose(0.0, 0.0, 1.2)  # its height counts; AASHTO's Green Book has 1.08 m

    def __post_init__(self) -> None:
        if not 0.0 <= self.reaction <= 10.0:
            raise ConfigError(
                f"eyes {self.id}: reaction must be in [0, 10] s, got {self.reaction:g}"
            )


@dataclass(frozen=True, slots=True)
class ChannelSpec:
    """The sensors of a shipped channel, measured together; their reading is a `ChannelView`.

    They measure in the first tick of the run and then every `period` ticks: their noise has a
    state, so they measure whether the reading is read or not.
    """

    id: str  # the channel's name
    noise: float = 1.0  # factor on all errors
    jumps: float = 1.0  # factor on how often the position jumps
    period: int = 2  # ticks from one cycle to the next
    first: int = 0  # number of the cycle that the first tick begins; negative before a recording
    mount: Pose = Pose(0.0, 0.0, 0.0)


SensorSpec = CameraSpec | RadarSpec | LidarSpec | PointSensorSpec | EyesSpec | ChannelSpec
