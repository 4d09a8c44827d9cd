"""What a tick costs, part by part, in CPU time (decision M-16): the loop with a clock in between.

For `skidpad bench tick`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from time import process_time_ns
from typing import Any, TypeVar

import cv2
import numpy as np
from msgspec import structs

from skidpad.campaign.driving.loop import Moment, Sink, loop
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.stack_at_wheel import driver_of
from skidpad.campaign.runs.log_sink import log_of
from skidpad.core.run import AdasDriver, Render, RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.sensing import Pixels
from skidpad.stack.configurations import functions_of

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


def bench_run(
    configuration: int, weather: str, level: SensorLevel, render: Render = Render.NEEDED
) -> RunSpec:
    """Returns a run of the matrix as users run it: figure8, 20 vehicles, recommended settings."""
    return RunSpec(
        driver=AdasDriver(label=str(configuration), functions=functions_of(configuration)),
        weather=find_weather(weather),
        sensors=level,
        render=render,
    )


def tick_costs(seconds: float = SECONDS) -> Iterator[Row]:
    """Yields the rows of the table as they are measured; each drive is driven once before the clock."""
    for level in (SensorLevel.PIXELS, SensorLevel.OBJECTS):
        for configuration in CONFIGURATIONS:
            for weather in WEATHERS:
                plain = TARGET_LIGHTS if configuration >= LIGHTS_FROM else TARGET_PLAIN
                target = plain if level is SensorLevel.PIXELS else TARGET_OBJECTS
                spec = bench_run(configuration, weather, level)
                yield Row(configuration, weather, level.value, warm_cost(spec, seconds), target)
    for weather in WEATHERS:
        spec = bench_run(2, weather, SensorLevel.PIXELS, render=Render.ALL)
        yield Row(2, weather, "all images", warm_cost(spec, seconds), TARGET_ALL_IMAGES)


def warm_cost(spec: RunSpec, seconds: float) -> TickCost:
    """Returns the cost of a drive of `seconds` s, after COMPILE_SECONDS s that compile its kernels."""
    tick_cost(spec, seconds=COMPILE_SECONDS)
    return tick_cost(spec, seconds)


class Meter:
    """Adds up the CPU time of named parts."""

    def __init__(self) -> None:
        self.total: dict[str, int] = {}

    def time_calls(self, name: str, function: F) -> F:
        """Returns `function` wrapped so that the CPU time of its calls is added to `name`."""

        @wraps(function)
        def wrapper(*args: Any, **kwargs: Any) -> Any:
            begin = process_time_ns()
            try:
                return function(*args, **kwargs)
            finally:
                self.total[name] = self.total.get(name, 0) + process_time_ns() - begin

        return wrapper  # type: ignore[return-value]


class Spans(Sink):
    """Takes the CPU time from tick to tick; after `warm` of them it clears the meter's sums."""

    def __init__(self, meter: Meter, warm: int) -> None:
        self.meter, self.warm = meter, warm
        self.stamps: list[int] = []

    def see(self, moment: Moment) -> None:
        """Notes the CPU time at one more tick."""
        del moment
        if len(self.stamps) == self.warm:
            self.meter.total.clear()
        self.stamps.append(process_time_ns())

    @property
    def spans(self) -> np.ndarray[Any, Any]:
        """Returns the CPU ns of each tick after the warm-up."""
        return np.diff(self.stamps[self.warm :])


def tick_cost(spec: RunSpec, seconds: float = 60.0) -> TickCost:
    """Drives `spec` for some simulated s on the embedded simulator; returns its CPU time per tick."""
    cv2.setNumThreads(1)  # as in the workers (decision X-10): helpers that wait would count, too
    meter = Meter()
    spec = structs.replace(spec, duration=WARM_UP + seconds)
    stage = stage_of(spec)
    driver: Any = driver_of(spec, stage)
    supervisor: Any = stage.supervisor
    log: Any = log_of(spec, stage)
    backend = EmbeddedBackend()
    frame = backend.reset(stage.setup, spec.seed)
    _instrument(backend, meter)
    driver.act = meter.time_calls("stack", driver.act)
    supervisor.observe = meter.time_calls("supervisor", supervisor.observe)
    supervisor.act = meter.time_calls("supervisor", supervisor.act)
    log.see = meter.time_calls("log", log.see)
    clock = Spans(meter, round(WARM_UP / stage.setup.dt))
    failure = loop(backend, frame, driver, supervisor, stage.script, (log, clock))
    backend.close()
    if failure is not None:
        raise failure
    return _summary(clock.spans, meter.total, spec.render is Render.NEEDED)


def _instrument(backend: EmbeddedBackend, meter: Meter) -> None:
    """Replaces the backend's step, sensing and rendering by ones that the meter times."""
    world: Any = backend.world
    world.step = meter.time_calls("world", world.step)
    sensing: Any = backend.sensing
    sensing.read = meter.time_calls("sensors", sensing.read)
    if isinstance(sensing, Pixels):
        suite: Any = sensing.suite
        suite.render = meter.time_calls("rendering", suite.render)


def _summary(spans: np.ndarray[Any, Any], total: dict[str, int], lazy: bool) -> TickCost:
    """Returns the cost of ticks from ns; rendering's time is taken off the part that called it.

    lazy: images are rendered when the stack reads them, else when the sensors observe.
    """
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
