"""How far a physical radar finds what, by weather: `python tools/radar_curves.py FILE`.

Writes the CSV of docs/radar-weather.md. Distances are the farthest, in steps of 5 m, at which a target
is found in at least half of 100 ticks, on the axis of a radar of 150 m range at 1 m height.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.core.weather import Weather
from skidpad.physics.optics import RADAR_GHZ, rain_attenuation_db_km
from skidpad.physics.radio import radome_film, rain_scatter, wet_radome_db
from skidpad.roads.roadside import Roadside
from skidpad.sensors.physical_radar.radar import PhysicalRadar

SPEC = RadarSpec("radar", Pose(0.0, 0.0, 1.0))
TICKS, STEP, SPEED = 100, 5.0, 27.8  # m, m/s: 100 km/h
# kind, length, width, height in m, yaw in rad
TARGETS = {
    "car_rear_m": (ActorKind.CAR, 4.5, 1.8, 1.5, 0.0),
    "car_side_m": (ActorKind.CAR, 4.5, 1.8, 1.5, np.pi / 2.0),
    "truck_rear_m": (ActorKind.TRUCK, 9.0, 2.5, 3.6, 0.0),
    "motorcycle_rear_m": (ActorKind.MOTORCYCLE, 2.2, 0.8, 1.4, 0.0),
    "pedestrian_m": (ActorKind.PEDESTRIAN, 0.5, 0.6, 1.75, 0.0),
}
FIELDS = (
    "weather", "rain_mm_h", "speed_km_h", "itu_p838_3_db_km", "mie_db_km", "eta_db", "film_mm",
    "radome_two_way_db", *TARGETS,
)  # fmt: skip


def farthest(kind: ActorKind, size: tuple[float, float, float], yaw: float, weather: Weather,
             speed: float) -> float:  # fmt: skip
    """Distance in m to which a target is found in half of the ticks; it moves with the ego."""
    table = ActorTable(
        ("ego", "target"), ("car", "car"), np.array([ActorKind.CAR, kind], dtype=np.uint8),
        np.array([4.5, size[0]]), np.array([1.8, size[1]]), np.array([1.5, size[2]]),
        np.zeros((2, 3), dtype=np.uint8),
    )  # fmt: skip
    states = ActorStates.empty(2)
    states.present[:] = True
    states.vx[:], states.yaw[1] = speed, yaw
    radar = PhysicalRadar(SPEC, Roadside(), table, 1, weather)
    half = size[1 if yaw else 0] / 2.0
    reached = 0.0
    for distance in np.arange(STEP, SPEC.range + 1e-9, STEP):
        states.x[1] = distance + half
        found = sum(
            bool(np.any(abs(radar.measure(k, states).range - distance) < 1.0)) for k in range(TICKS)
        )
        if 2 * found >= TICKS:
            reached = float(distance)
    return reached


def rows() -> list[dict[str, object]]:
    """All lines of the table."""
    found: list[dict[str, object]] = []
    for rain, speed in ((0, SPEED), (5, SPEED), (25, 0.0), (25, SPEED), (50, SPEED)):
        weather = Weather(precipitation=2.0 * rain)
        mie, eta = rain_scatter(float(rain), RADAR_GHZ) if rain else (0.0, 0.0)
        row: dict[str, object] = {
            "weather": "rain" if rain else "dry", "rain_mm_h": rain,
            "speed_km_h": round(3.6 * speed),
            "itu_p838_3_db_km": rain_attenuation_db_km(float(rain)), "mie_db_km": mie,
            "eta_db": 10.0 * float(np.log10(eta)) if eta else "",
            "film_mm": 1e3 * radome_film(float(rain), speed),
            "radome_two_way_db": abs(wet_radome_db(float(rain), speed, RADAR_GHZ)),
        }  # fmt: skip
        for name, (kind, *size, yaw) in TARGETS.items():
            row[name] = farthest(kind, (size[0], size[1], size[2]), yaw, weather, speed)
        found.append(row)
    return found


def main() -> None:
    """Write the CSV."""
    with Path(sys.argv[1]).open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        for row in rows():
            writer.writerow({k: f"{v:.2f}" if isinstance(v, float) else v for k, v in row.items()})


if __name__ == "__main__":
    main()
