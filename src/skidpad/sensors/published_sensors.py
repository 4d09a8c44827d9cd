"""The twelve published sensors (A-018 to A-030) with their mountings as printed: CARLA axes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from skidpad.core.maths.lefthanded import pose_from_carla
from skidpad.core.specs import CameraSpec, Modality, PointSensorSpec, RadarSpec, SensorSpec


class CaptureSize(Enum):
    """Which published image sizes the display cameras take (D-002 to D-004)."""

    TILE = "tile"  # as in the text: what the display shows
    LISTING = "listing"  # 800x600, top view 400x400


@dataclass(frozen=True, slots=True)
class Mounting:
    """One camera as printed; angles in deg, CARLA-handed."""

    id: str
    modality: Modality
    tile: tuple[int, int]  # px, width and height
    listing: tuple[int, int]
    fov_deg: float
    x: float
    y: float
    z: float
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    shows_own_body: bool = False
    attributes: tuple[tuple[str, str], ...] = ()


EXPOSURE = (("iso", "1200"), ("gamma", "2.2"), ("exposure_mode", "histogram"))
CAMERAS = (
    Mounting(
        "rgb_front", Modality.RGB, (800, 600), (800, 600), 90, 0.05, -0.35, 1.3, attributes=EXPOSURE
    ),
    Mounting("depth_roof", Modality.DEPTH, (800, 600), (800, 600), 90, 1.5, 0, 2.4),
    Mounting("semantic_roof", Modality.SEMANTIC, (800, 600), (800, 600), 90, 1.5, 0, 2.4),
    Mounting("semantic_bumper", Modality.SEMANTIC, (400, 300), (400, 300), 100, 2.3, 0, 0.4, -20),
    Mounting("depth_bumper", Modality.DEPTH, (400, 300), (400, 300), 100, 2.3, 0, 0.4, -20),
    Mounting("rgb_rear", Modality.RGB, (450, 180), (800, 600), 90, -2.0, 0, 2.4, 0, 180),
    Mounting(
        "rgb_mirror_left", Modality.RGB, (280, 180), (800, 600), 90, 0.325, -0.8, 1.3, 0, -140, True
    ),
    Mounting(
        "rgb_mirror_right", Modality.RGB, (280, 180), (800, 600), 90, 0.325, 0.8, 1.3, 0, 140, True
    ),
    Mounting("rgb_top", Modality.RGB, (160, 160), (400, 400), 70, 0, 0, 10.0, -90, 0, True),
)
RADAR_ID = "radar_front"
COLLISION_ID = "collision"
LANE_INVASION_ID = "lane_invasion"


def twelve_sensors(
    *,
    bumper_depth_fov_deg: float = 100.0,
    display: CaptureSize = CaptureSize.TILE,
    with_radar: bool = True,
) -> tuple[SensorSpec, ...]:
    """Returns the published suite in the published order (A-018).

    bumper_depth_fov_deg: 90 repeats the listing's mismatch with the labels (A-023, D-001).
    with_radar: False gives the reduced suite of the second prototype (A-038).
    """
    cameras = [_camera(m, bumper_depth_fov_deg, display) for m in CAMERAS]
    radar = (RadarSpec(RADAR_ID, pose_from_carla(2.0, 0.0, 1.0), 30.0, 30.0, 150.0, 1500),)
    events = (
        PointSensorSpec(COLLISION_ID, "collision"),
        PointSensorSpec(LANE_INVASION_ID, "lane_invasion"),
    )
    return (*cameras, *(radar if with_radar else ()), *events)


def _camera(m: Mounting, bumper_depth_fov_deg: float, display: CaptureSize) -> CameraSpec:
    """Returns the spec of a published camera mounting, in ISO 8855 axes, for the given capture size."""
    width, height = m.tile if display is CaptureSize.TILE else m.listing
    return CameraSpec(
        id=m.id,
        modality=m.modality,
        width=width,
        height=height,
        fov_deg=bumper_depth_fov_deg if m.id == "depth_bumper" else m.fov_deg,
        mount=pose_from_carla(m.x, m.y, m.z, 0.0, m.pitch_deg, m.yaw_deg),
        shows_own_body=m.shows_own_body,
        attributes=dict(m.attributes),
    )


def mounts_outside(
    specs: tuple[SensorSpec, ...], length: float, width: float, height: float
) -> list[str]:
    """Returns one warning per sensor and axis along which it stands outside the actor's box (A-039, D-012).

    Sizes in m; [] where all are inside. The mirrors, roof and top view stand outside of any car on
    purpose: they are named all the same.
    """
    warnings = []
    for spec in specs:
        mount = spec.mount
        over = (abs(mount.x) - length / 2, abs(mount.y) - width / 2, mount.z - height)
        for axis, value in zip("xyz", over, strict=True):
            if value > 1e-9:
                warnings.append(
                    f"sensor {spec.id} is mounted {value:.2f} m outside the "
                    f"{length:.2f} x {width:.2f} x {height:.2f} m body along {axis}"
                )
    return warnings
