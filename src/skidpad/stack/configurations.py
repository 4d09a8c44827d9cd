"""Which functions drive: the five published configurations, or any set of functions (A-008)."""

from __future__ import annotations

from skidpad.core.errors import ConfigError
from skidpad.core.run import AdasDriver, Function
from skidpad.stack.functions import factory_of

V_CRUISE_KMH = 150.0  # cruise target without a limiter
V_LIMITER_KMH = 80.0  # limiter of configuration 4
CRUISE_RANGE = (1.0, 400.0)  # km/h


Functions = frozenset[Function]

CONFIGURATIONS: dict[int, Functions] = {
    0: frozenset(),
    1: frozenset({Function.ACC}),
    2: frozenset({Function.ACC, Function.LCA}),
    3: frozenset({Function.ACC, Function.LCA, Function.TLA, Function.RESUME}),
    4: frozenset({Function.ACC, Function.LCA, Function.TLA, Function.RESUME, Function.LIMITER}),
}

# ours: their speed stays inside the envelope in place of the fixed limit (docs/envelope.md)
GOVERNED: dict[int, Functions] = {
    5: CONFIGURATIONS[3],
    6: frozenset({Function.ACC, Function.LCA}),
}


def numbered_driver(number: int) -> AdasDriver:
    """Returns the driver of configuration 0 to 6; ConfigError for another number."""
    if number in GOVERNED:
        return AdasDriver(label=str(number), functions=GOVERNED[number], envelope=True)
    return AdasDriver(label=str(number), functions=functions_of(number))


def functions_of(configuration: int) -> Functions:
    """Returns the functions of a published configuration; raises ConfigError for an unknown one."""
    if configuration not in CONFIGURATIONS:
        raise ConfigError(
            f"unknown configuration {configuration!r}; choose one of: "
            + ", ".join(map(str, CONFIGURATIONS))
        )
    return CONFIGURATIONS[configuration]


def parse_functions(text: str) -> tuple[Functions, tuple[str, ...]]:
    """Returns the functions of a text like `acc,lca`: those of the stack, and names of those of packages.

    ConfigError for a name that nothing has.
    """
    names = {name.strip() for name in text.split(",") if name.strip()}
    own = {function.value for function in Function}
    added = tuple(sorted(names - own))
    for name in added:
        factory_of(name)
    return frozenset(Function(name) for name in names & own), added
