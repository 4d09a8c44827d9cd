"""Drive a stack on a map in one call, by plain arguments."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from skidpad.campaign.cells.matrix import describe_run
from skidpad.campaign.driving.drivers import describe_driver
from skidpad.campaign.runs.run import Run, run
from skidpad.core.courses import Roads
from skidpad.core.errors import require_choice
from skidpad.core.run import DriverSpec, RunSpec, StackDriver
from skidpad.core.settings.parts import load_profile
from skidpad.core.settings.setting import Plain
from skidpad.core.simulator import BackendChoice
from skidpad.core.vocabulary import SensorLevel, TrafficStart
from skidpad.core.weather import Weather
from skidpad.physics.presets import find_weather
from skidpad.stack.interface import Stack
from skidpad.stack.loading import load_stack


def drive(
    stack: type[Stack] | str | int,
    *,
    map: str | Path = "figure8",
    weather: str | Weather = "clear-noon",
    seed: int = 1,
    duration: float = 500.0,
    traffic: str = "fixed",
    vehicles: int = 20,
    route_km: float = 0.0,
    sensors: str = "pixels",
    profile: str = "recommended",
    settings: Mapping[str, Plain] | None = None,
    stack_settings: Mapping[str, object] | None = None,
    out: str | Path | None = None,
    backend: BackendChoice | None = None,
) -> Run:
    """Drive a stack on a map with traffic; the defaults are those of `skidpad adas`.

    Args:
        stack: a class with the stack interface, or what `--stack` takes: 0 to 4 for a published
            configuration, "reference", "camera", "module:Class", "FILE.py:Class".
        map: a bundled map's name, or an OpenDRIVE file.
        weather: a preset's name, a weather file (.yaml), or a weather.
        seed: of traffic and noise; the same seed gives the same log.
        duration: simulated seconds. 500 s take minutes with pixels, and seconds with objects.
        traffic: "fixed", "random" or "pack": where background vehicles begin and stay.
        vehicles: how many there are, 0 to 80.
        route_km: the run ends after so many km along the road, as `--route-km`; 0: no end.
        sensors: "pixels" for real images, or "objects", which is much faster.
        profile: "recommended", "thesis_text", "thesis_listing" or "preliminary".
        settings: single settings over the profile, as `--set`; `skidpad profiles` lists them.
        stack_settings: what your own class is given as its settings, as `--stack-set`.
        out: a folder for pictures of collisions; None keeps everything in memory.
        backend: the simulator; None is the embedded one.

    Returns:
        The log, how the drive ended, and what it left behind. A stack that fails is an outcome.

    Raises:
        ConfigError: a value is out of its range, or is no name that exists.
        FileError: a map, weather or stack file is not there, or cannot be read.

    Example:
        >>> run = drive("examples/follow_lane.py:FollowLane", weather="rain-night",
        ...             duration=60, sensors="objects", stack_settings={"cruise_kmh": 60})
        >>> run.outcome.value, len(run.log.contacts)
    """
    spec, kind = describe(
        stack,
        map=map,
        weather=weather,
        seed=seed,
        duration=duration,
        traffic=traffic,
        vehicles=vehicles,
        route_km=route_km,
        sensors=sensors,
        profile=profile,
        settings=settings,
        stack_settings=stack_settings,
        backend=backend,
    )
    return run(spec, kind, folder=None if out is None else Path(out))


def describe(
    stack: type[Stack] | str | int,
    *,
    map: str | Path,
    weather: str | Weather,
    seed: int,
    duration: float,
    traffic: str,
    vehicles: int,
    route_km: float,
    sensors: str,
    profile: str,
    settings: Mapping[str, Plain] | None,
    stack_settings: Mapping[str, object] | None,
    backend: BackendChoice | None,
) -> tuple[RunSpec, type[Stack] | None]:
    """Returns the run that `drive` drives for these arguments, and its stack's class; None: one of ours."""
    driver, kind = _name_driver(stack, dict(stack_settings or {}))
    words = [v.value for v in SensorLevel], [v.value for v in TrafficStart]
    template = RunSpec(
        course=Roads(
            map=str(map),
            traffic=TrafficStart(require_choice("traffic", traffic, words[1])),
            vehicles=vehicles,
            route_km=route_km,
        ),
        duration=duration,
        settings=load_profile(profile, settings),
        sensors=SensorLevel(require_choice("sensors", sensors, words[0])),
        backend=BackendChoice() if backend is None else backend,
    )
    outside = find_weather(weather) if isinstance(weather, str) else weather
    return describe_run(driver, outside, seed, template), kind


def _name_driver(
    stack: type[Stack] | str | int, options: dict[str, Any]
) -> tuple[DriverSpec, type[Stack] | None]:
    """Returns the driver of a stack by class, name or number, and its class; None for one of ours."""
    if isinstance(stack, (str, int)):
        driver = describe_driver(stack, options)
        return driver, load_stack(driver.where) if isinstance(driver, StackDriver) else None
    return StackDriver(f"{stack.__module__}:{stack.__qualname__}", options), stack
