"""What a tick costs, part by part, in CPU time (decision M-16): the loop with a clock in between.

For `skidpad bench tick`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import wraps
from time import process_time_ns
from typing import Any, TypeVar

import cv2
import numpy as np

from skidpad.campaign.cells import Cell, Driver
from skidpad.campaign.drive import prepare
from skidpad.core.vocabulary import SensorLevel, Supervision
from skidpad.physics.presets import find_weather
from skidpad.recording.ticks import TickLog
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.sensing import Pixels
from skidpad.stack.configurations import functions_of
from skidpad.stack.settings import load_profile

F = TypeVar("F", bound=Callable[..., Any])
WARM_UP = 2.0  # s simulated before the clock counts: kernels load, caches fill
MS = 1.0e-6  # per ns
CONFIGURATIONS = (0, 2, 3, 4)
WEATHERS = ("clear-noon", "rain-night")
SECONDS = 60.0  # s simulated per measurement
# ms per tick (decision M-16); configurations without lights, with lights, and at object level.
TARGET_PLAIN, TARGET_LIGHTS, TARGET_ALL_IMAGES, TARGET_OBJECTS = 2.6, 3.2, 5.5, 0.35
COMPILE_SECONDS = 30.0  # s simulated, in which a light comes into range
LIGHTS_FROM = 3  # configuration from which lamps are looked for


@dataclass(frozen=True, slots=True)
class TickCost:
    """CPU milliseconds per tick of one drive."""

    mean: float
    median: float
    p99: float
    parts: dict[str, float]  # means: world, sensors, rendering, stack, supervisor, log


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table of tick costs."""

    configuration: int
    weather: str
    sensors: str  # pixels, objects or all images
    cost: TickCost
    target: float  # ms, for the mean


def bench_cell(
    configuration: int, weather: str, level: SensorLevel, render_all: bool = False
) -> Cell:
    """A cell of the matrix as users run it: figure8, 20 vehicles, recommended settings."""
    return Cell(
        driver=Driver(label=str(configuration), functions=functions_of(configuration)),
        weather=find_weather(weather),
        seed=1,
        profile="recommended",
        settings=load_profile("recommended"),
        level=level,
        render_all=render_all,
    )


def tick_costs(seconds: float = SECONDS) -> Iterator[Row]:
    """The whole table, line by line as it is measured; each drive is driven once before."""
    for level in (SensorLevel.PIXELS, SensorLevel.OBJECTS):
        for configuration in CONFIGURATIONS:
            for weather in WEATHERS:
                plain = TARGET_LIGHTS if configuration >= LIGHTS_FROM else TARGET_PLAIN
                target = plain if level is SensorLevel.PIXELS else TARGET_OBJECTS
                cell = bench_cell(configuration, weather, level)
                yield Row(configuration, weather, level.value, warm_cost(cell, seconds), target)
    for weather in WEATHERS:
        cell = bench_cell(2, weather, SensorLevel.PIXELS, render_all=True)
        yield Row(2, weather, "all images", warm_cost(cell, seconds), TARGET_ALL_IMAGES)


def warm_cost(cell: Cell, seconds: float) -> TickCost:
    """The cost of a drive whose kernels are compiled."""
    tick_cost(cell, seconds=COMPILE_SECONDS)
    return tick_cost(cell, seconds)


class Meter:
    """Adds up the CPU time of named parts."""

    def __init__(self) -> None:
        self.total: dict[str, int] = {}

    def timed(self, name: str, function: F) -> F:
        """`function`, its time added to `name`."""

        @wraps(function)
        def wrapper(*args: Any, **kwargs: Any) -> Any:
            begin = process_time_ns()
            try:
                return function(*args, **kwargs)
            finally:
                self.total[name] = self.total.get(name, 0) + process_time_ns() - begin

        return wrapper  # type: ignore[return-value]


def tick_cost(cell: Cell, seconds: float = 60.0) -> TickCost:
    """Drive `cell` for some simulated seconds on the embedded simulator and measure."""
    cv2.setNumThreads(1)  # as in the workers (decision X-10): helpers that wait would count, too
    meter = Meter()
    ready = prepare(replace(cell, duration=WARM_UP + seconds))
    backend = EmbeddedBackend()
    frame = backend.reset(ready.setup, cell.seed)
    _instrument(backend, meter)
    tick = meter.timed("stack", ready.stack.tick)
    observe = meter.timed("supervisor", ready.supervisor.observe)
    act = meter.timed("supervisor", ready.supervisor.act)
    warm, count = round(WARM_UP / ready.setup.dt), round(seconds / ready.setup.dt)
    log = TickLog(backend.truth().table, ready.header, cell.weather.name, warm + count)
    append = meter.timed("log", log.append)
    spans = np.zeros(warm + count)
    for k in range(warm + count):
        if k == warm:
            meter.total.clear()
        begin = process_time_ns()
        truth = backend.truth()
        phase = observe(truth)
        if phase is not Supervision.NONE:
            frame = replace(frame, supervision=phase)
        command = tick(frame)
        action = act(command, ready.stack.report)
        append(truth, frame, command, ready.stack.report, phase)
        if action.relocate is not None:
            backend.relocate(action.relocate.pose, action.relocate.v)
        frame = backend.step(action.command)
        spans[k] = process_time_ns() - begin
    backend.close()
    return _summary(spans[warm:], meter.total, not cell.render_all)


def _instrument(backend: EmbeddedBackend, meter: Meter) -> None:
    """Clocks around the world's step, the sensors, and images that the stack asks for."""
    world: Any = backend.world
    world.step = meter.timed("world", world.step)
    sensing: Any = backend.sensing
    sensing.read = meter.timed("sensors", sensing.read)
    if isinstance(sensing, Pixels):
        suite: Any = sensing.suite
        suite.render = meter.timed("rendering", suite.render)


def _summary(spans: np.ndarray[Any, Any], total: dict[str, int], lazy: bool) -> TickCost:
    """lazy: images are rendered when the stack reads them, else when the sensors observe."""
    parts = {name: ns * MS / len(spans) for name, ns in total.items()}
    if lazy:
        parts["stack"] -= parts.get("rendering", 0.0)
    elif "rendering" in parts:
        parts["sensors"] -= parts["rendering"]
    return TickCost(
        mean=float(spans.mean()) * MS,
        median=float(np.median(spans)) * MS,
        p99=float(np.percentile(spans, 99)) * MS,
        parts=parts,
    )
