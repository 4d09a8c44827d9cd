"""Anybody's stack: found by `module:Class` or `file.py:Class`, and kept to its word."""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Any

from skidpad.core.errors import ConfigError, FileError, StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.specs import (
    GNSS,
    IMU,
    SPEEDOMETER,
    CameraSpec,
    LidarSpec,
    PointSensorSpec,
    SensorSpec,
)
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.roads.queries import RoadMap
from skidpad.stack.interface import Stack

NO_REPORT = StackReport()
ASKABLE = (CameraSpec, LidarSpec, PointSensorSpec)  # there is one radar, and every stack has it
ASKABLE_KINDS = (GNSS, IMU, SPEEDOMETER)


def load_stack(where: str) -> type[Stack]:
    """The class named by `module:Class` or `path/to/file.py:Class`."""
    found = import_class(where, "stack")
    if not callable(getattr(found, "tick", None)):
        raise ConfigError(f"stack {where!r}: class {found.__name__} has no method tick(frame)")
    return found


def import_class(where: str, what: str) -> type[Any]:
    """The class named by `module:Class` or `path/to/file.py:Class`; `what` it is, for messages."""
    place, colon, name = where.rpartition(":")
    if not colon or not place or not name.isidentifier():
        raise ConfigError(f"a {what} is given as module:Class or file.py:Class, got {where!r}")
    module = _from_file(Path(place), what) if place.endswith(".py") else _from_module(place, what)
    found = getattr(module, name, None)
    if not isinstance(found, type):
        raise ConfigError(f"{what} {where!r}: {place} has no class {name}")
    return found


def _from_file(path: Path, what: str) -> ModuleType:
    if not path.is_file():
        raise FileError(f"{what} file {str(path)!r} does not exist")
    name = f"skidpad_user_{what}_{path.stem}"
    spec = spec_from_file_location(name, path)
    assert spec is not None, "a .py file has a loader"
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickling look a class up by its module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ConfigError(f"{what} file {str(path)!r} cannot be imported: {error!r}") from error
    return module


def _from_module(name: str, what: str) -> ModuleType:
    try:
        return import_module(name)
    except Exception as error:  # an import runs foreign code: anything can happen
        raise ConfigError(f"{what} module {name!r} cannot be imported: {error!r}") from error


class GuardedStack:
    """Runs a stack; whatever it does wrong becomes a StackError, the outcome of its run."""

    def __init__(
        self,
        kind: type[Stack],
        specs: Sequence[SensorSpec],
        map: RoadMap,
        settings: Mapping[str, Any],
    ) -> None:
        self.name = kind.__name__
        self._taken = frozenset(spec.id for spec in specs)
        try:
            self.stack = kind(specs, map, settings)
        except (StackError, ConfigError):
            raise
        except Exception as error:
            raise StackError(f"{self.name} could not be built: {error!r}") from error

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """The stack's command, checked."""
        try:
            command = self.stack.tick(frame)
        except Exception as error:
            raise StackError(f"{self.name} raised in tick {frame.tick}: {error!r}") from error
        if not isinstance(command, VehicleCommand):
            raise StackError(
                f"{self.name} must return a VehicleCommand, got {type(command).__name__} "
                f"in tick {frame.tick}"
            )
        _check(self.name, command, frame.tick)
        return command

    def close(self) -> None:
        """The run is over; what a stack does wrong here no longer matters to it."""
        close = getattr(self.stack, "close", None)
        if callable(close):
            with suppress(Exception):
                close()

    @property
    def report(self) -> StackReport:
        """What the stack says about its last tick; empty for a stack that says nothing."""
        report = getattr(self.stack, "report", NO_REPORT)
        return report if isinstance(report, StackReport) else NO_REPORT

    @property
    def mode(self) -> str:
        """The mode of the last tick in the stack's words; empty for one that has none."""
        mode = getattr(self.stack, "mode", "")
        return mode if isinstance(mode, str) else ""

    def sensors(self) -> tuple[SensorSpec, ...]:
        """The further sensors that the stack asks for."""
        ask = getattr(self.stack, "sensors", None)
        if ask is None:
            return ()
        try:
            wanted = tuple(ask())
        except Exception as error:
            raise StackError(f"{self.name}.sensors() raised: {error!r}") from error
        _check_sensors(self.name, wanted, self._taken)
        return wanted


def _check(name: str, command: VehicleCommand, tick: int) -> None:
    ranges = (
        ("throttle", command.throttle, 0.0),
        ("brake", command.brake, 0.0),
        ("steer", command.steer, -1.0),
    )
    for what, value, low in ranges:
        if not isfinite(value) or not low <= value <= 1.0:
            raise StackError(
                f"{name}: {what} must be between {low:g} and 1, got {value!r} in tick {tick}"
            )


def _check_sensors(name: str, wanted: Sequence[SensorSpec], taken: Collection[str]) -> None:
    for k, spec in enumerate(wanted):
        if not isinstance(spec, ASKABLE):
            raise StackError(
                f"{name}.sensors() must name cameras, lidars and point sensors, got {spec!r}"
            )
        if spec.id in taken or spec.id in {other.id for other in wanted[:k]}:
            raise StackError(f"{name}.sensors(): there is a sensor {spec.id!r} already")
        if isinstance(spec, PointSensorSpec) and spec.kind not in ASKABLE_KINDS:
            known = ", ".join(ASKABLE_KINDS)
            raise StackError(
                f"{name}.sensors(): sensor {spec.id!r} has kind {spec.kind!r}; choose one of: {known}"
            )
