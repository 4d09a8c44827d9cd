"""Size and processor time of checkpoints as files."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from skidpad.campaign.cells.matrix import describe_run
from skidpad.campaign.driving.drivers import describe_driver
from skidpad.campaign.runs.run import OpenRun
from skidpad.campaign.runs.state_files import StateFiles, unpack_state
from skidpad.campaign.stepping import Scenario
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import find_weather

TICKS, REPEATS = 100, 15


def cases() -> dict[str, RunSpec]:
    """Returns the runs that are measured, by what they are."""
    found = {
        f"{map}, 21 vehicles, configuration {stack}": _on_roads(map, stack, SensorLevel.OBJECTS)
        for map, stack in (("figure8", 4), ("town", 1), ("motorway", 3))
    }
    found["front_accident, 3 actors, configuration 2"] = Scenario("front_accident").spec
    found["figure8, configuration 4, pixels"] = _on_roads("figure8", 4, SensorLevel.PIXELS)
    return found


def measure(spec: RunSpec) -> tuple[float, float, float, float]:
    """Returns the size of a file in kB, and in ms a tick, to write the file and to restore it."""
    run = OpenRun(spec)
    run.step()
    files = StateFiles(run)
    began = time.process_time()
    for _ in range(TICKS):
        run.step()
    tick = (time.process_time() - began) / TICKS
    with TemporaryDirectory() as folder:
        path = Path(folder) / "state"
        write = _median(lambda: files.write(path))
        restore = _median(lambda: files.restore(unpack_state(path)))
        size = path.stat().st_size
    run.close()
    return size / 1e3, 1e3 * tick, write, restore


def main() -> None:
    """Prints a table of all cases."""
    print("| run | file | tick | write | restore |\n|---|---|---|---|---|")
    for name, spec in cases().items():
        size, *times = measure(spec)
        print(f"| {name} | {size:.0f} kB | {' | '.join(f'{ms:.2f} ms' for ms in times)} |")


def _on_roads(map: str, stack: int, level: SensorLevel) -> RunSpec:
    """Returns a run at night in rain."""
    template = RunSpec(
        course=Roads(map=map, allow_fewer=True), sensors=level, settings=load_profile("recommended")
    )
    return describe_run(describe_driver(stack), find_weather("rain-night"), 3, template)


def _median(call: Callable[[], object]) -> float:
    """Returns the median processor time of a call, ms."""
    found = []
    for _ in range(REPEATS):
        began = time.process_time()
        call()
        found.append(time.process_time() - began)
    return 1e3 * median(found)


if __name__ == "__main__":
    main()
