"""The runs of the matrix: every driver in every weather with every seed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import isfinite

from msgspec import structs

from skidpad.campaign.driving.drivers import NUMBERS
from skidpad.core.errors import ConfigError, require_range
from skidpad.core.run import (
    REFERENCE,
    AdasDriver,
    DriverSpec,
    ReferenceDriver,
    RunSpec,
    check_limits,
)
from skidpad.core.text.told import describe_value
from skidpad.core.weather import RANGES, Weather
from skidpad.stack.configurations import (
    CONFIGURATIONS,
    CRUISE_RANGE,
    Functions,
    numbered_driver,
    parse_functions,
)

SWEEP_MAX = 10_000  # values of one sweep
FIRST_SEED = 1  # seeds that reports use count up from here
TUNING_SEEDS = range(900_000, 1_000_000)  # seeds for choosing parameters, never reported


def published_drivers(numbers: str) -> list[AdasDriver]:
    """Returns drivers of numbers like "0,1,4", "all" for all five; ConfigError for an unknown one."""
    if numbers == "all":
        return [AdasDriver(label=str(n), functions=f) for n, f in CONFIGURATIONS.items()]
    drivers = []
    for text in numbers.split(","):
        if text.strip() not in NUMBERS:
            allowed = ", ".join([*NUMBERS, REFERENCE])
            raise ConfigError(
                f"unknown configuration {describe_value(text.strip(), 100)}; choose among: {allowed}"
            )
        drivers.append(numbered_driver(NUMBERS[text.strip()]))
    return drivers


def matrix_drivers(text: str) -> list[DriverSpec]:
    """Returns drivers of text like "0,4,reference"; "all" is the five configurations and the reference."""
    if text == "all":
        return [*published_drivers(text), ReferenceDriver()]
    words = [word.strip() for word in text.split(",")]
    found: list[DriverSpec] = []
    for word in words:
        found += [ReferenceDriver()] if word == REFERENCE else published_drivers(word)
    return found


def drivers_with(functions: Iterable[str]) -> list[AdasDriver]:
    """Returns a driver for each set of functions, such as "aeb" or "acc,lca", named after them."""
    chosen = [parse_functions(names) for names in functions]
    return [
        AdasDriver(label=join_functions(own, added) or "none", functions=own, added=added)
        for own, added in chosen
    ]


def join_functions(functions: Functions, added: Iterable[str] = ()) -> str:
    """Returns a set of functions as one word with "+", sorted, then the added ones; "" for none."""
    return "+".join([*sorted(f.value for f in functions), *added])


def cruising(drivers: Sequence[AdasDriver], text: str) -> list[AdasDriver]:
    """Returns each driver with each cruise target in km/h: "110", or "60:150:10", ends included.

    Raises ConfigError for a target out of CRUISE_RANGE or another form.
    """
    span = text if ":" in text else f"{text}:{text}:1"
    targets = _steps("--cruise", span)
    for target in targets:
        require_range("--cruise", target, *CRUISE_RANGE)
    return [
        structs.replace(d, label=f"{d.label} at {v:g} km/h", cruise_kmh=v)
        for d in drivers
        for v in targets
    ]


def sweep(weather: Sequence[Weather], text: str) -> list[Weather]:
    """Returns a copy of each weather for each value of a field, as "wetness=0:100:20", ends included.

    Raises ConfigError for an unknown field, another form, or values out of range.
    """
    name, equals, span = text.partition("=")
    if not equals or name not in RANGES:
        raise ConfigError(
            f"--sweep takes FIELD=FROM:TO:STEP with a weather field ({', '.join(RANGES)}), "
            f"got {describe_value(text, 100)}"
        )
    values = _steps(f"--sweep {name}", span)
    for value in values:
        require_range(f"weather.{name}", value, *RANGES[name])
    return [
        replace(
            w,
            name=f"{w.name}_{name}-{value:g}",
            title=f"{w.title}, {name} {value:g}",
            **{name: value},
        )
        for w in weather
        for value in values
    ]


def _steps(option: str, span: str) -> list[float]:
    """Returns the values of FROM:TO:STEP, ends included; ConfigError for another form or over SWEEP_MAX."""
    try:
        start, stop, step = (float(part) for part in span.split(":"))
    except ValueError:
        raise ConfigError(
            f"{option} takes three numbers FROM:TO:STEP, got {describe_value(span, 100)}"
        ) from None
    if not (step > 0.0 and start <= stop and isfinite(stop - start)):
        raise ConfigError(f"{option} needs A <= B and STEP > 0, got {describe_value(span, 100)}")
    if (stop - start) / step > SWEEP_MAX:
        raise ConfigError(
            f"{option} makes more than {SWEEP_MAX} values, got {describe_value(span, 100)}"
        )
    return [start + k * step for k in range(int((stop - start) / step + 1e-9) + 1)]


def seeds(n: int, first: int = FIRST_SEED) -> range:
    """Returns n seeds from `first` on, as reports use them; ConfigError where they reach tuning seeds.

    Common to all drivers and weathers, so comparisons are paired.
    """
    require_range("--seeds", n, 1, 100_000)
    require_range("--first-seed", first, 1, TUNING_SEEDS.start - n)
    return range(first, first + n)


def describe_run(driver: DriverSpec, weather: Weather, seed: int, template: RunSpec) -> RunSpec:
    """Returns the template with this driver in this weather: what commands and `drive` run.

    Raises ConfigError for a number outside the limits of its field.
    """
    described = structs.replace(template, driver=driver, weather=weather, seed=seed)
    check_limits(described)
    check_limits(described.course)
    return described


def cross(
    drivers: Sequence[DriverSpec], weather: Sequence[Weather], n: int, template: RunSpec
) -> list[RunSpec]:
    """Returns every driver in every weather with n seeds from the template's on, the rest as there.

    Raises ConfigError when two runs would have the same name.
    """
    cells = [
        describe_run(d, w, s, template)
        for s in seeds(n, template.seed)
        for w in weather
        for d in drivers
    ]
    if len({c.name for c in cells}) != len(cells):
        raise ConfigError("two cells have the same name: a driver or a weather is given twice")
    return cells
