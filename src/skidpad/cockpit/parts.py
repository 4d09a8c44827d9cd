"""What a run is made of, in words for the page: stack, functions, road, weather, simulator."""

from __future__ import annotations

from typing import Any

from skidpad.core.courses import Scenario
from skidpad.core.objects.registry import Registry
from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.simulator import BACKENDS
from skidpad.physics.presets import WEATHERS
from skidpad.roads.map_files import MAPS
from skidpad.stack.functions import FUNCTIONS

Part = tuple[str, str]  # what it is, and which one


def list_parts(spec: RunSpec) -> tuple[Part, ...]:
    """Returns what a run is made of; parts of installed packages say the package that they come from."""
    driver, course = spec.driver, spec.course
    parts: list[Part] = [("stack", driver.label)]
    if isinstance(driver, AdasDriver):
        names = (*(f.value for f in driver.functions), *driver.added)
        order = list(FUNCTIONS.names())
        known = sorted(names, key=lambda n: (n not in order, order.index(n) if n in order else n))
        parts += [("function", describe_part(FUNCTIONS, name)) for name in known]
    if isinstance(course, Scenario):
        parts.append(("scenario", course.name or course.file))
    elif isinstance(map := getattr(course, "map", None), str):
        parts.append(("map", describe_part(MAPS, map)))
    parts.append(("weather", describe_part(WEATHERS, spec.weather.name, spec.weather.title)))
    parts.append(("simulator", describe_part(BACKENDS, spec.backend.backend)))
    return tuple(parts)


def describe_part(registry: Registry[Any], name: str, title: str = "") -> str:
    """Returns name, title and package of an entry; the name alone where no installed package has it.

    name: may have a setting behind a colon. title: where the entry has none.
    """
    source = registry.sources().get(name.partition(":")[0])
    if source is None:
        return f"{name}: {title}" if title else name
    title = source.load().title or title
    package = "" if source.package == "skidpad" else f" [package {source.package}]"
    return f"{name}: {title}{package}" if title else f"{name}{package}"
