"""Campaigns of the matrix with given numbers."""

from __future__ import annotations

from skidpad.recording.campaign.matrix import MATRIX, Metrics
from skidpad.recording.campaign.results import Timing
from skidpad.report.matrix.data import WEATHERS, load_matrix
from support.matrix_drawn import key


def metrics(barriers=0, struck=0, hit=0, speed=40.0):
    """A run of 500 s with so many interventions of three kinds."""
    vehicles = struck + hit
    return Metrics(
        fatal_collisions=barriers + vehicles,
        serious_contacts=vehicles,
        contacts_heavy=hit,
        contacts_medium=struck,
        crashes_vehicle=vehicles,
        collisions_vehicle=vehicles,
        rear_ended=struck,
        road_departures=barriers,
        collisions_static=barriers,
        off_road=0,
        wrong_way=0,
        fatal_first=barriers + vehicles,
        first_fatal_s=100.0 if barriers + vehicles else None,
        bend_exits=0,
        mean_speed_kmh=speed,
        dropout_pct=5.0,
        distance_km=5.0,
        duration_s=500.0,
    )


def campaign(folder, of, seeds=10, alike=True, configs="01234"):
    """Runs of configurations in six weathers; of(config, kind) has the metrics of each."""
    rows = []
    for weather in WEATHERS:
        kind, time = weather.split("-")
        for config in configs:
            for seed in range(1, seeds + 1):
                drive = f"{config}{kind}{'' if alike else time}{seed}"
                rows.append((key(config, weather, seed, log_hash=drive), of(config, kind)))
    MATRIX.write(folder, rows, [Timing(wall_s=9, cpu_s=8, rtf=55)] * len(rows))
    return load_matrix(folder)


def clear_cut(config, kind):
    """Configuration 1 is best, 2 as good in clear sky only, 3 and 4 are worse in rain."""
    return {
        "0": metrics(hit=30),
        "1": metrics(),
        "2": metrics(hit=4 * (kind == "rain")),
        "3": metrics(barriers=6, struck=1),
        "4": metrics(barriers=2 + 3 * (kind == "rain"), speed=35.0),
    }[config]
