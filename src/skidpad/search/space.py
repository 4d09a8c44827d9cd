"""From words to a space, and from a point of it to a run."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import ceil

from msgspec import structs

from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.maths.space import Choice, Law, Normal, Space, Uniform, Value, Variable
from skidpad.core.run import RunSpec
from skidpad.core.text.told import describe_value
from skidpad.core.traffic.disturbance import (
    KNOT_S,
    PREFIX,
    actor_of_draw,
    name_draw,
    parse_disturbance,
)
from skidpad.core.weather import RANGES
from skidpad.physics.presets import find_weather

SEED = "seed"  # name of the variable that draws sensor noise: whole numbers of a range
WEATHER = "weather"  # name of a variable that chooses presets; "weather.FIELD": one of its fields
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
UNIFORM = re.compile(rf"({NUMBER}):({NUMBER})")
DRAWN = re.compile(rf"(normal|lognormal)\(({NUMBER}),({NUMBER})(?:,({NUMBER}):({NUMBER}))?\)")
HOW = (
    "NAME=LOW:HIGH, NAME=normal(MEAN,SIGMA), NAME=lognormal(MEAN,SIGMA) of the logarithm, either with "
    "a range after a comma, as normal(3,1,0:8), or NAME=one|other|third"
)


def parse_variable(text: str) -> Variable:
    """Return the variable of one `--vary`.

    Raises:
        ConfigError: the text is none of the forms, a range is empty or a sigma is not positive.
    """
    name, equals, words = (part.strip() for part in text.partition("="))
    if not name or not equals:
        raise ConfigError(f"--vary takes {HOW}; got {describe_value(text, 100)}")
    return Variable(name, _parse_law(name, words.replace(" ", "")))


def _parse_law(name: str, words: str) -> Law:
    """Returns the law that the words of --vary describe; raises ConfigError for others."""
    if found := UNIFORM.fullmatch(words):
        return _require_range(name, Uniform(float(found[1]), float(found[2])))
    if found := DRAWN.fullmatch(words):
        low, high = (float(found[k]) if found[k] else None for k in (4, 5))
        is_log = found[1] == "lognormal"
        return _require_range(name, Normal(float(found[2]), float(found[3]), low, high, is_log))
    if "|" in words and all(words.split("|")):
        return Choice(tuple(words.split("|")))
    raise ConfigError(f"--vary {name}: takes {HOW}; got {describe_value(words, 100)}")


def _require_range(name: str, law: Uniform | Normal) -> Law:
    """Returns the law; raises ConfigError for an empty range or a sigma of 0 or less."""
    low, high = law.range
    if not low < high:
        raise ConfigError(f"--vary {name}: the range {low:g}:{high:g} is empty")
    if isinstance(law, Normal) and not law.sigma > 0.0:
        raise ConfigError(f"--vary {name}: sigma must be above 0, got {law.sigma:g}")
    return law


def apply_values(template: RunSpec, values: Mapping[str, Value]) -> RunSpec:
    """Returns the run with these values in its scenario, disturbances, weather and seed."""
    course = template.course
    assert isinstance(course, Scenario)
    draws: dict[str, tuple[float, ...]] = {}
    for name in values:  # in the order of the space: that of the draws
        if actor := actor_of_draw(name):
            draws[actor] = (*draws.get(actor, ()), float(values[name]))
    parameters = {n: v for n, v in values.items() if is_parameter(n)}
    weather = template.weather
    if WEATHER in values:
        weather = find_weather(str(values[WEATHER]))
    fields = {n.partition(".")[2]: v for n, v in values.items() if n.startswith(f"{WEATHER}.")}
    return structs.replace(
        template,
        course=structs.replace(
            course, parameters={**course.parameters, **parameters}, draws={**course.draws, **draws}
        ),
        weather=replace(weather, **fields),  # type: ignore[arg-type]
        seed=int(values.get(SEED, template.seed)),
    )


def is_parameter(name: str) -> bool:
    """Returns whether a variable is a parameter of the scenario: no disturbance, weather or seed."""
    return name != SEED and name.partition(".")[0] != WEATHER and not actor_of_draw(name)


def disturbance_variables(template: RunSpec) -> tuple[Variable, ...]:
    """Returns the draws of the run's disturbances over its longest time as standard normal variables."""
    course = template.course
    assert isinstance(course, Scenario)
    return tuple(
        Variable(name_draw(one.actor, k), Normal(0.0, 1.0), one.source)
        for one in map(parse_disturbance, course.disturb)
        for k in range(ceil(template.duration / KNOT_S))
    )


def _require_own(variable: Variable) -> None:
    """Raises ConfigError where the law does not fit its variable: the seed, or a weather field."""
    word, dot, name = variable.name.partition(".")
    if variable.name == SEED and isinstance(variable.law, Choice):
        raise ConfigError("--vary seed: takes a range, as seed=1:1000000")
    if variable.name.startswith(PREFIX):
        raise ConfigError(
            f"--vary {variable.name}: disturbances are given by --disturb ACTOR=accel"
        )
    if word != WEATHER:
        return
    if not dot:
        if not isinstance(variable.law, Choice):
            raise ConfigError(
                "--vary weather takes presets, as weather=clear-noon|rain-noon|icy_30"
            )
        for preset in variable.law.words:
            find_weather(preset)
        return
    require_choice("--vary weather.FIELD", name, tuple(RANGES))
    low, high = RANGES[name]
    if isinstance(variable.law, Choice):
        raise ConfigError(f"--vary {variable.name}: takes a range of numbers")
    lowest, highest = variable.law.range
    if lowest < low or highest > high:
        raise ConfigError(
            f"--vary {variable.name}: must lie within {low:g}:{high:g}, got {lowest:g}:{highest:g}"
        )


def parse_space(texts: Iterable[str]) -> Space:
    """Return the space of all `--vary`, as `parse_variable` reads each."""
    return check_space(Space(tuple(parse_variable(text) for text in texts)))


def check_space(space: Space) -> Space:
    """Returns the same space; raises ConfigError where a law does not fit its variable.

    The seed takes a range, `weather` known presets, `weather.FIELD` a range within that of a known
    field; other variables are not checked.
    """
    for variable in space.variables:
        _require_own(variable)
    return space
