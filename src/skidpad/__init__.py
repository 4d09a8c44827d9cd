"""Skidpad: a proving ground for driving automation in bad weather."""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"
__all__ = ["Scenario", "__version__", "drive", "drive_many", "register"]


def __getattr__(name: str) -> Any:
    # Lazy, so that `skidpad --version` does not pay for numba.
    if name == "drive":
        return import_module("skidpad.campaign.runs.drive").drive
    if name == "drive_many":
        return import_module("skidpad.campaign.runs.many").drive_many
    if name == "Scenario":
        return import_module("skidpad.campaign.stepping").Scenario
    if name == "register":
        return import_module("skidpad.scenarios.registry").register
    raise AttributeError(f"module 'skidpad' has no attribute {name!r}")
