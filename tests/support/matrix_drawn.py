"""Campaigns of the matrix with numbers drawn at random."""

from __future__ import annotations

import numpy as np

from skidpad.recording.campaign.matrix import MATRIX, Metrics, RunKey
from skidpad.recording.campaign.results import Timing
from skidpad.report.matrix.data import (
    WEATHERS,
)

RATES = {"0": 3.0, "1": 0.5, "2": 1.0, "3": 1.5, "4": 0.0}


def key(config, weather, seed, outcome="completed", log_hash=None):
    kind, time = weather.split("-")
    return RunKey(
        config=config,
        weather=weather,
        precipitation_kind=kind,
        time_of_day=time,
        seed=seed,
        profile="recommended",
        map="figure8",
        sensors="objects",
        grip="physical",
        range="physical",
        outcome=outcome,
        version="0",
        log_hash=log_hash or f"{config}{weather}{seed}",
    )


def write_drawn_campaign(folder, seeds=3, **changes):
    rng = np.random.default_rng(1)
    rows, timing = [], []
    for config, rate in RATES.items():
        for weather in WEATHERS:
            for seed in range(1, seeds + 1):
                n = int(rng.poisson(rate))
                values = {
                    "fatal_collisions": n,
                    "collisions_vehicle": n,
                    "crashes_vehicle": n,
                    "road_departures": 0,
                    "off_road": 0,
                    "fatal_first": min(n, 1),
                    "first_fatal_s": 400.0 / n if n else None,
                    "collisions_static": 0,
                    "wrong_way": 0,
                    "contacts": n,
                    "rear_ended": 0,
                    "bend_exits": 0,
                    "stuck_relocations": 0,
                    "lane_invasions": int(rng.poisson(1)),
                    "dropout_pct": float(rng.uniform(5, 12)),
                    "mean_error_m": float(rng.uniform(1, 4)),
                    "headway_variance_m2": float(rng.uniform(10, 90)),
                    "radar_fpr_pct": 50.0,
                    "mean_speed_kmh": float(rng.normal(50, 3)),
                    "p95_speed_kmh": 90.0,
                    "bend_speed_kmh": 70.0,
                    "ttc_below_1_5_s": 3.0,
                    "distance_km": 7.0,
                    "duration_s": 500.0,
                }
                rows.append((key(config, weather, seed, **changes), Metrics(**values)))
                timing.append(Timing(wall_s=9, cpu_s=8, rtf=55))
    MATRIX.write(folder, rows, timing)
    return rows
