"""The scenario file of a course: checked and compiled, with the names that it may use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from msgspec import structs
from msgspec.json import encode

from skidpad.campaign.driving.file_drivers import FILE_DRIVERS
from skidpad.campaign.driving.file_stack import NAME as STACK_NAME
from skidpad.campaign.driving.file_stack import PilotConditions, PilotMaker
from skidpad.campaign.driving.sharing import find_shared
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.text.told import describe_value
from skidpad.scenarios import scenario as scenarios
from skidpad.scenarios.playing.disturbing import read_disturbances
from skidpad.scenarios.registry import Names
from skidpad.scenarios.shipped import NAMES, scenario_file
from skidpad.stack.loading import import_class


def load_scenario(
    course: Scenario, conditions: Callable[[], PilotConditions] = PilotConditions
) -> scenarios.Scenario:
    """Returns the compiled file of a course; ScenarioError lists all that keeps it from being played.

    conditions: gives those in which stacks of other actors drive. Within `share_setups` runs share a file
    that names no code.
    """

    def compile_file() -> tuple[scenarios.Scenario, bool]:
        names = _names_of(course, conditions())
        found = check_scenario(course, names=names).playable()
        read_disturbances(course.disturb, found)  # what is wrong in them is said here
        return found, not names.asked and not course.register

    file = file_of(course)
    changed = file.stat().st_mtime_ns if file.is_file() else 0
    key = encode(structs.replace(course, draws={}), order="deterministic"), file, changed
    return find_shared(key, compile_file)


def file_of(course: Scenario) -> Path:
    """Returns the file of a course: one of the catalogue by its name, else by its path."""
    return scenario_file(course.file) if course.file in NAMES else Path(course.file)


def check_scenario(course: Scenario, names: Names | None = None) -> scenarios.Compiled:
    """Returns the check of a course's file, with everything that was found, playable or not.

    names: that the file may use; None: those that the course says.
    """
    return scenarios.check(
        file_of(course),
        course.parameters,
        course.ego,
        maps=[Path(folder) for folder in course.maps],
        ignore_unsupported=course.ignore_unsupported,
        lenient=course.lenient,
        names=_names_of(course, PilotConditions()) if names is None else names,
    )


def _names_of(course: Scenario, conditions: PilotConditions) -> Names:
    """Returns the names that a course's file may use."""
    own = {**FILE_DRIVERS, STACK_NAME: PilotMaker(conditions)}
    return Names({**own, **_load_registered(course.register)}, strict=course.strict)


def _load_registered(texts: Sequence[str]) -> dict[str, type[Any]]:
    """Returns the classes that a user gives names, of texts NAME=module:Class; ConfigError otherwise."""
    found = {}
    for text in texts:
        name, equals, where = text.partition("=")
        if not equals or not name:
            raise ConfigError(
                f"--register takes NAME=module:Class, got {describe_value(text, 200)}"
            )
        found[name] = import_class(where, "class")
    return found
