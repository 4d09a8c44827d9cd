"""Runs as tests ask for them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec import structs

from skidpad.campaign.cells.grip import template
from skidpad.campaign.channels.routes import driven_routes
from skidpad.core.courses import Roads, Scenario
from skidpad.core.run import AdasDriver, ChannelCrew, RunSpec
from skidpad.core.settings.parts import Settings, load_profile
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.presets import find_weather
from skidpad.stack.configurations import functions_of


def adas_run(number: int = 2, weather: str | Weather = "clear-noon", **changes: Any) -> RunSpec:
    """A published configuration on objects, settings written out; `changes` are fields of the run.

    vehicles: of the background. settings: single ones over the profile, or all of them.
    """
    profile, settings = changes.pop("profile", "recommended"), changes.pop("settings", None)
    if not isinstance(settings, Settings):
        settings = load_profile(profile, settings)
    base = RunSpec(
        driver=AdasDriver(label=str(number), functions=functions_of(number)),
        course=Roads(vehicles=changes.pop("vehicles", 20)),
        weather=find_weather(weather) if isinstance(weather, str) else weather,
        settings=settings,
        sensors=SensorLevel.OBJECTS,
    )
    return structs.replace(base, **changes)


def segment_run(route: str = "route-4", crew: ChannelCrew | None = None, **changes: Any) -> RunSpec:
    """Four seconds of a route with two channels; `changes` are fields of the run."""
    driver = ChannelCrew() if crew is None else crew
    fields = {"seed": 1, "duration": 4.0, "driver": driver, **changes}
    return structs.replace(driven_routes()[route], **fields)


def scenario_run(file: str | Path, grip: str = "none", **changes: Any) -> RunSpec:
    """A scenario, by name or file, played on objects in clear weather by configuration 2."""
    course = structs.replace(changes.pop("course", Scenario()), file=str(file))
    settings = Settings().with_values({"grip": grip})
    base = {"weather": Weather(), "seed": 0, "settings": settings}
    return template(course=course, **{**base, **changes})
