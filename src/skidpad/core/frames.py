"""What a stack receives each tick. A frame is valid until the next step: copy what you keep (X-11)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.objects.slots import fill_slots
from skidpad.core.states import ContactEvent, EgoEstimate, LaneInvasion
from skidpad.core.vocabulary import LightState, Supervision


@dataclass(frozen=True, slots=True)
class CameraImage:
    """One view; only the field of the camera's modality is there, the others are None.

    Row 0 is the top, column 0 the left.
    """

    inverse_depth: Floats32 | None = None  # (H, W) 1/m, planar; 0 where there is nothing
    labels: NDArray[np.uint8] | None = None  # (H, W) SemanticClass; may be a strided view
    instances: NDArray[np.uint16] | None = None  # (H, W) 0 static, else actor index + 1
    rgb: NDArray[np.uint8] | None = None  # (H, W, 3) red, green, blue
    packed: NDArray[np.uint32] | None = None  # (H, W) rgb as 4-byte pixels, where it is kept so

    def depth(self) -> Floats32:
        """Returns (H, W) planar depth in m, +inf where there is nothing; computed at each call."""
        assert self.inverse_depth is not None, "this camera delivers no depth"
        with np.errstate(divide="ignore"):
            metres: Floats32 = np.float32(1.0) / self.inverse_depth
        return metres


def pack(rgb: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Returns (H, W) pixels of 4 bytes, red, green, blue and 255, of an (H, W, 3) image."""
    padded = np.full((*rgb.shape[:2], 4), 255, dtype=np.uint8)
    padded[..., :3] = rgb
    return padded.view(np.dtype("<u4"))[..., 0]


class PartialImages(Mapping[str, CameraImage]):
    """Images by sensor id from a backend that can draw some rows of one alone."""

    @abstractmethod
    def rows(self, id: str, first: int, end: int) -> CameraImage:
        """Returns the image with at least the rows first <= row < end; the others may hold anything."""


def image_rows(
    images: Mapping[str, CameraImage], id: str, rows: tuple[int, int]
) -> CameraImage | None:
    """Returns the image of a sensor with at least the rows [first, end); None: there is none.

    Arrays have the size of the whole image; rows outside may hold anything.
    """
    if id not in images:
        return None
    return images.rows(id, *rows) if isinstance(images, PartialImages) else images[id]


class RadarPoints(NamedTuple):
    """n radar returns; azimuth left positive, altitude up positive, velocity negative closing."""

    range: Floats32  # m along the ray
    azimuth: Floats32  # rad
    altitude: Floats32  # rad
    velocity: Floats32  # m/s, range rate

    @classmethod
    def none(cls) -> RadarPoints:
        """Returns a reading without returns."""
        return cls(*(np.empty(0, dtype=np.float32) for _ in range(4)))


class RadarObjects(NamedTuple):
    """What an object list of a radar adds to its n rows of `RadarPoints`."""

    snr: Floats32  # dB, power over the noise
    section: Floats32  # dBsm, radar cross section by the radar equation


class RadarTracks(NamedTuple):
    """What tracks add to n rows: places and velocities in the radar's axes (x forward, y left)."""

    number: NDArray[np.int64]  # the same from tick to tick
    x: Floats32  # m
    y: Floats32
    vx: Floats32  # m/s, over ground
    vy: Floats32
    age: NDArray[np.int64]  # ticks since it began


class LidarPoints(NamedTuple):
    """n returns in the lidar's frame (x forward, y left, z up)."""

    xyz: Floats32  # (n, 3) m
    intensity: Floats32  # (n,) 0 .. 1
    cosine: Floats32  # (n,) of the angle of incidence
    label: NDArray[np.uint8]  # (n,) SemanticClass
    instance: NDArray[np.uint16]  # (n,) 0 static, else actor index + 1


class GnssFix(NamedTuple):
    """Place of the GNSS antenna on the globe."""

    latitude: float  # deg, north positive; north is the map's +y
    longitude: float  # deg, east positive
    altitude: float  # m


class ImuReading(NamedTuple):
    """What the inertial unit feels, in its own axes: x forward, y left, z up at a level mount."""

    force: tuple[float, float, float]  # m/s^2, specific force: +g upwards at rest
    rate: tuple[float, float, float]  # rad/s about x, y, z
    compass: float  # rad clockwise from north, [0, 2 pi)


class Segments(NamedTuple):
    """The object level's stand-in for a depth and label image: m vertical runs of equal content.

    Run i covers `width[i]` columns centred on `u[i]` and rows top[i] <= row < bottom[i]; all its
    pixels carry `label[i]` at planar depth `depth[i]`. Only visible vehicle faces are listed.
    """

    u: Floats32  # px
    width: Floats32  # px
    top: Floats32  # px
    bottom: Floats32  # px
    depth: Floats32  # m
    label: NDArray[np.uint8]


@fill_slots
@dataclass(frozen=True, slots=True)
class SensorFrame:
    """One tick of all sensors of the ego (decision L-3).

    Attributes:
        tick: Number of the tick.
        ego: What localisation and own sensors say.
        images: By sensor id; rendered when first read.
        segments: By id of the depth camera; object level only, else empty.
        radar: Returns of the common radar.
        lights: By signal id: the lights that this stack may see.
        contacts: Contacts that began in this tick.
        invasions: Lane markings that were crossed in this tick.
        supervision: Phase of the recovery supervisor.
        extra: Readings of the sensors that the stack asked for, by id: plain data and
            arrays as their type in `core.sensor_types` says; each is made when it is first
            read.
        radar_objects: Of each row of `radar`: setting radar_output.
        radar_tracks: Tracks of the common radar: setting radar_output.

    Example:
        >>> nearest = min(frame.radar.range, default=200.0)
    """

    tick: int
    ego: EgoEstimate
    images: Mapping[str, CameraImage]
    segments: Mapping[str, Segments]
    radar: RadarPoints
    lights: Mapping[int, LightState]
    contacts: tuple[ContactEvent, ...] = ()
    invasions: tuple[LaneInvasion, ...] = ()
    supervision: Supervision = Supervision.NONE
    extra: Mapping[str, Any] = field(default_factory=dict)
    radar_objects: RadarObjects | None = None
    radar_tracks: RadarTracks | None = None


# A backend's frame is the ego's sensor frame.
Frame = SensorFrame
