"""Processor time of runs alone and of runs that share."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from statistics import median

from msgspec import structs

from skidpad.campaign.cells.matrix import describe_run
from skidpad.campaign.driving.drivers import describe_driver
from skidpad.campaign.runs.many import drive_many
from skidpad.campaign.runs.run import run
from skidpad.campaign.stepping import Scenario
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import find_weather

TURNS, SEEDS = 9, 10


def cases() -> dict[str, list[RunSpec]]:
    """Returns lists of runs that differ in the seed, by what they are."""
    template = RunSpec(
        course=Roads(allow_fewer=True),
        duration=15.0,
        sensors=SensorLevel.OBJECTS,
        settings=load_profile("recommended", {}),
    )
    roads = describe_run(describe_driver(4), find_weather("rain-night"), 1, template)
    found = {
        name: Scenario(name, weather="icy_30", duration=15.0).spec
        for name in ("front_accident", "ghost_cut_in")
    }
    found["figure8, 21 vehicles, configuration 4"] = roads
    return {
        f"{name}, 15 s": [structs.replace(spec, seed=seed) for seed in range(1, SEEDS + 1)]
        for name, spec in found.items()
    }


def measure(specs: Sequence[RunSpec]) -> tuple[list[float], list[float]]:
    """Returns the ms of processor time per run in each turn: alone, and by one call."""

    def alone() -> None:
        for spec in specs:
            run(spec)

    def together() -> None:
        drive_many(specs, judge=lambda _: None)

    together()
    found: tuple[list[float], list[float]] = [], []
    for turn in range(TURNS):
        for k in (0, 1) if turn % 2 else (1, 0):
            found[k].append(_time((alone, together)[k]) / len(specs))
    return found


def main() -> None:
    """Prints medians with their range."""
    print("| runs | alone | by one call | ratio |\n|---|---|---|---|")
    for name, specs in cases().items():
        alone, together = measure(specs)
        ratio = median(b / a for a, b in zip(alone, together, strict=True))
        print(f"| {name} | {_text(alone)} | {_text(together)} | {ratio:.3f} |", flush=True)


def _time(call: Callable[[], None]) -> float:
    """Returns the processor time of a call, ms."""
    began = time.process_time()
    call()
    return 1e3 * (time.process_time() - began)


def _text(ms: Sequence[float]) -> str:
    """Returns median and range in words."""
    return f"{median(ms):.1f} ms ({min(ms):.1f} to {max(ms):.1f})"


if __name__ == "__main__":
    main()
