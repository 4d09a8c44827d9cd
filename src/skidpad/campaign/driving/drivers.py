"""Which stack drives, by name: the same words for `--stack`, `skidpad.drive` and `skidpad.Scenario`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msgspec import structs

from skidpad.core.errors import ConfigError
from skidpad.core.run import (
    REFERENCE,
    AgentDriver,
    CameraDriver,
    DriverSpec,
    Passenger,
    ReferenceDriver,
    StackDriver,
)
from skidpad.stack.configurations import CONFIGURATIONS, GOVERNED, numbered_driver
from skidpad.stack.loading import load_stack

IDEAL, CAMERA, AGENT = "ideal", "camera", "agent:"
STACK = "stack"  # what results of scenarios call our own stack
NUMBERS = {str(number): number for number in (*CONFIGURATIONS, *GOVERNED)}


def describe_driver(
    stack: str | int, options: Mapping[str, object] | None = None, label: str = ""
) -> DriverSpec:
    """Returns the driver of this name; a user's class is not looked for yet.

    Args:
        stack: 0 to 4 for our stack in a published configuration, 5 and 6 for it with the speed
            envelope, "reference", "camera", "ideal" for a scenario that moves the ego itself,
            "agent:PATH:CLASS" for an agent of the CARLA leaderboard, or a stack's class as
            "module:Class" or "FILE.py:Class".
        options: what a class is given as its settings.
        label: what results call our stack; its number by default.

    Raises:
        ConfigError: the name stands for no driver, or options are given to a driver of ours.
    """
    name = str(stack)
    ours = _describe_ours(name, label)
    if ours is None:
        given: dict[str, Any] = dict(options or {})
        return StackDriver(name, given)
    if options:
        raise ConfigError(
            f"--stack-set is for your own stack: give it with --stack FILE:CLASS, not {name}"
        )
    return ours


def find_driver(
    stack: str | int, options: Mapping[str, object] | None = None, label: str = ""
) -> DriverSpec:
    """Returns the driver as `describe_driver` does, once a user's class was found and loaded.

    Raises:
        ConfigError: also when there is no such class, or it is no stack.
        FileError: its file is not there.
    """
    driver = describe_driver(stack, options, label)
    if isinstance(driver, StackDriver):
        load_stack(driver.where)
    elif isinstance(driver, AgentDriver):
        from skidpad.stack.agents import load_agent  # kernels come with it

        load_agent(driver.where)
    return driver


def _describe_ours(name: str, label: str) -> DriverSpec | None:
    """Returns the driver of a name of ours or of "agent:PATH:CLASS"; None for other text with ":".

    label: what results call a numbered configuration, "" for its name; other drivers ignore it.
    Raises ConfigError for an unknown name without ":".
    """
    if name in NUMBERS:
        return structs.replace(numbered_driver(NUMBERS[name]), label=label or name)
    if name == REFERENCE:
        return ReferenceDriver()
    if name == CAMERA:
        return CameraDriver()
    if name == IDEAL:
        return Passenger()
    if name.startswith(AGENT):
        return AgentDriver(name.removeprefix(AGENT))
    if ":" not in name:
        raise ConfigError(
            f"unknown stack {name!r}; choose one of: {', '.join([*NUMBERS, REFERENCE, CAMERA, IDEAL])}, "
            "module:Class, FILE.py:Class, agent:PATH:CLASS"
        )
    return None
