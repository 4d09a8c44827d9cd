"""Lost and false returns of a lidar by weather, beside published models: `python tools/lidar_curves.py FILE`.

Writes the CSV of docs/lidar-weather.md. Columns named after an author follow that author's published
procedure with its own numbers; `here` is ours.
"""

from __future__ import annotations

import csv
import sys
from math import inf, log, tan
from pathlib import Path

import numpy as np

from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.droplets import (
    FOG_BACKSCATTER,
    SMALLEST_MM,
    Drops,
    drop_extinction,
    rain_drops,
    snow_flakes,
)
from skidpad.physics.optics import CONTRAST_SEEN, LidarAir, rain_extinction
from skidpad.sensors.ranging import lidar_returns
from skidpad.sensors.ranging.lidar_returns import DIVERGENCE, NEAREST, ON_GROUND, OTHER, WHITE

REACH, DISTANCE = 100.0, 30.0
BEAMS, OURS = 40_000, 1_000_000  # drawn by LISA, and here
FIELDS = (
    "kind", "amount", "unit", "extinction_here_per_km", "extinction_spectrum_per_km",
    "range_of_0.5_here_m", "range_of_0.5_lisa_m", "range_of_0.5_hahner_m",
    "false_on_ground_30_m_here_pct", "false_on_ground_30_m_lisa_pct", "false_in_sky_here_pct",
)  # fmt: skip


def farthest(air: LidarAir) -> float:
    """Distance in m to which a surface of 0.5 is the strongest return."""
    distance = np.arange(1.0, REACH, 0.1)
    model = lidar_returns.ReturnModel(air._replace(drops=Drops()), REACH)
    found = model.measure(distance, np.full(len(distance), int(SemanticClass.CAR)), 0)
    return float(distance[np.isfinite(found.distance) & ~found.false].max())


def lisa_range(alpha: float) -> float:
    """The same by LISA, which knows a threshold and no backscatter of fog."""
    distance = np.arange(1.0, REACH, 0.1)
    power = OTHER * np.exp(-2.0 * alpha * distance) / distance**2
    return float(distance[power > WHITE / REACH**2].max())


def hahner_range(sight: float) -> float:
    """The same by Hahner et al.: receiver and beam overlap from 1 m on."""
    ours, lidar_returns.MEETS = lidar_returns.MEETS, (0.9, 1.0)
    found = farthest(LidarAir(-log(CONTRAST_SEEN) / sight, backscatter=FOG_BACKSCATTER / sight))
    lidar_returns.MEETS = ours
    return found


def false_share(air: LidarAir, distance: float) -> float:
    """Percent of beams on ground at this distance, inf: none, that return a drop."""
    label = np.full(OURS, int(SemanticClass.ROAD))
    model = lidar_returns.ReturnModel(air, REACH)
    found = model.measure(np.full(OURS, distance), label, 1)
    return 100.0 * float(found.false.mean())


def lisa_false_share(drops: Drops, alpha: float) -> float:
    """The same by LISA: every drop of every beam is drawn."""
    rng = np.random.default_rng(2)
    volume = np.pi / 3.0 * DISTANCE * (tan(DIVERGENCE) * DISTANCE / 2.0) ** 2
    mean = drops.density / drops.slope * np.exp(-drops.slope * SMALLEST_MM) * volume
    surface = ON_GROUND * np.exp(-2.0 * alpha * DISTANCE) / DISTANCE**2
    false = 0
    for _ in range(10):
        beam = np.repeat(np.arange(BEAMS // 10), rng.poisson(mean, BEAMS // 10))
        r = DISTANCE * rng.random(len(beam)) ** (1.0 / 3.0)
        size = rng.exponential(1.0 / drops.slope, len(beam)) + SMALLEST_MM
        share = np.minimum((size / (1e3 * tan(DIVERGENCE) * r)) ** 2, 1.0)
        power = drops.reflectivity * np.exp(-2.0 * alpha * r) * share / r**2
        wins = (r > NEAREST) & (power > max(surface, WHITE / REACH**2))
        false += len(np.unique(beam[wins]))
    return 100.0 * false / BEAMS


def rows() -> list[dict[str, object]]:
    """All lines of the table."""
    found: list[dict[str, object]] = []
    falls = [("rain", r, rain_drops(r), rain_extinction(r)) for r in (5.0, 10.0, 25.0, 50.0, 100.0)]
    falls += [("snow", r, snow_flakes(r), drop_extinction(snow_flakes(r))) for r in (0.5, 2.5, 5.0)]
    for kind, amount, drops, alpha in falls:
        air = LidarAir(falling=alpha, drops=drops)
        values: tuple[float | None, ...] = (
            1000.0 * alpha, 1000.0 * drop_extinction(drops), farthest(air), lisa_range(alpha), None,
            false_share(air, DISTANCE), lisa_false_share(drops, alpha), false_share(air, inf),
        )  # fmt: skip
        found.append(dict(zip(FIELDS, (kind, amount, "mm/h", *values), strict=True)))
    for sight in (20.0, 40.0, 60.0, 100.0, 200.0, 500.0, 1000.0):
        alpha = -log(CONTRAST_SEEN) / sight
        air = LidarAir(alpha, backscatter=FOG_BACKSCATTER / sight)
        values = (
            1000.0 * alpha, None, farthest(air), lisa_range(alpha), hahner_range(sight),
            false_share(air, DISTANCE), None, false_share(air, inf),
        )  # fmt: skip
        found.append(dict(zip(FIELDS, ("fog", sight, "m of sight", *values), strict=True)))
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
