"""How long the matrix takes on two cores: estimated from ticks, or driven."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from skidpad.campaign.bench.tick import SECONDS, bench_run, warm_cost
from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes.matrix import RECIPE, warm_up
from skidpad.campaign.workers.pool import local, warm
from skidpad.core.setup import DT
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import preset_groups
from skidpad.stack.configurations import CONFIGURATIONS

RUNS, DURATION, CORES = 30, 500.0, 2
TARGET = 9.0  # min, without installation and compilation (decision M-16)


def estimated_minutes(seconds: float = SECONDS) -> float:
    """Estimates the minutes of the matrix from each configuration's mean tick, clear and in rain at night."""
    costs = [
        warm_cost(bench_run(n, weather, SensorLevel.PIXELS), seconds).mean
        for n in CONFIGURATIONS
        for weather in ("clear-noon", "rain-night")
    ]
    return sum(costs) / len(costs) * 1.0e-3 * RUNS * DURATION / DT / CORES / 60.0


def driven_minutes() -> float:
    """Drives all 30 runs by the campaign's workers, throws the results away; returns the wall time, min."""
    cells = [
        bench_run(n, weather, SensorLevel.PIXELS)
        for weather in preset_groups()["matrix"]
        for n in CONFIGURATIONS
    ]
    warm(warm_up)
    with TemporaryDirectory() as folder:
        begin = time.perf_counter()
        Campaign(RECIPE, cells).run(Path(folder) / "matrix", local(CORES))
        return (time.perf_counter() - begin) / 60.0
