"""`skidpad profiles sensors`: where the sensors are mounted, what they cover, and their layout drawn."""

from __future__ import annotations

from math import degrees, radians, tan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from skidpad.cli.output.pictures import write_figure
from skidpad.core.specs import CameraSpec, RadarSpec
from skidpad.sensors.published_sensors import twelve_sensors

EGO = (4.7, 1.85)  # m, length and width of the drawn car
CAMERA_REACH = 3.0  # m, how far the drawn field of a camera reaches


class SensorRow(NamedTuple):
    """A mounted sensor in the frame of the vehicle: x forward, y left, z up, from its centre."""

    name: str
    kind: str
    x: float
    y: float
    z: float
    yaw_deg: float
    pitch_deg: float  # down is positive, as in ISO 8855
    fov_deg: float
    reach: str  # pixels of a camera, range of a radar


def sensor_rows() -> list[SensorRow]:
    """Returns the rows of all cameras and radars, in the published order."""
    return [row(spec) for spec in twelve_sensors() if isinstance(spec, (CameraSpec, RadarSpec))]


def row(spec: CameraSpec | RadarSpec) -> SensorRow:
    """Returns the row of one sensor, angles in deg."""
    m = spec.mount
    x, y, z, yaw, pitch = (
        round(v, 9) + 0.0 for v in (m.x, m.y, m.z, degrees(m.yaw), degrees(m.pitch))
    )
    if isinstance(spec, CameraSpec):
        pixels = f"{spec.width} x {spec.height} px"
        kind = spec.modality.value
        return SensorRow(spec.id, kind, x, y, z, yaw, pitch, spec.fov_deg, pixels)
    fov, reach = spec.horizontal_fov_deg, f"{spec.range:g} m"
    return SensorRow(spec.id, "radar", x, y, z, yaw, pitch, fov, reach)


def sensor_table() -> str:
    """Returns the rows as text that fits 80 columns."""
    lines = [
        f"{'sensor':<18}{'x m':>7}{'y m':>7}{'z m':>7}{'yaw':>6}{'pitch':>7}{'fov':>6}  covers"
    ]
    lines += [
        f"{r.name:<18}{r.x:>7.2f}{r.y:>7.2f}{r.z:>7.2f}{r.yaw_deg:>6.0f}{r.pitch_deg:>7.0f}"
        f"{r.fov_deg:>6.0f}  {r.reach}"
        for r in sensor_rows()
    ]
    return "\n".join(lines)


def draw_layout(axes: Any) -> None:
    """Draws the car from above with every sensor and its field of view, CAMERA_REACH m long."""
    length, width = EGO
    axes.plot(
        np.array([-1, 1, 1, -1, -1]) * length / 2, np.array([-1, -1, 1, 1, -1]) * width / 2, "k-"
    )
    for r in sensor_rows():
        half = radians(min(r.fov_deg, 170.0)) / 2
        if abs(r.pitch_deg) < 80.0:  # one that looks down has no field in this view
            yaw = radians(r.yaw_deg)
            along, across = CAMERA_REACH, CAMERA_REACH * tan(half)
            corners = np.array([[0, 0], [along, across], [along, -across], [0, 0]])
            turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
            x, y = (corners @ turn + [r.x, r.y]).T
            axes.fill(x, y, alpha=0.12)
        axes.plot(r.x, r.y, "o", markersize=4)
    for k, (place, names) in enumerate(_names_by_place().items()):
        below = {"xytext": (4, -12 if k % 2 else 4), "textcoords": "offset points"}
        axes.annotate("\n".join(names), place, fontsize=7, va="top" if k % 2 else "bottom", **below)
    axes.set(xlabel="x forward, m", ylabel="y left, m", aspect="equal")
    axes.grid(alpha=0.3)


def _names_by_place() -> dict[tuple[float, float], list[str]]:
    """Returns the names of the sensors by x, y in m, as seen from above."""
    found: dict[tuple[float, float], list[str]] = {}
    for r in sensor_rows():
        found.setdefault((r.x, r.y), []).append(r.name)
    return found


def write_layout(path: Path) -> None:
    """Writes the picture of the layout; the suffix of `path` chooses the format."""
    write_figure(path, lambda figure: draw_layout(figure.add_subplot()), (8.0, 6.0), dpi=100)
