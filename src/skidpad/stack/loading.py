"""Anybody's stack: found by `module:Class` or `file.py:Class`, and kept to its word."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from math import isfinite
from numbers import Real
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from skidpad.core.errors import ConfigError, FileError, StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.run import Function
from skidpad.core.sensor_types import SENSORS, find_sensor_type
from skidpad.core.specs import PointSensorSpec, SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.text.told import clean, describe_value
from skidpad.stack.interface import Stack

if TYPE_CHECKING:  # kernels come with it, and a name that is wrong is said before they load
    from skidpad.roads.queries import RoadMap

T = TypeVar("T")
FOREIGN = (Exception, SystemExit)  # what foreign code may raise; Ctrl-C remains the user's
SWITCHES = (bool, np.bool_)
REPORTED = tuple(field.name for field in fields(StackReport))
# modules of stacks that need no guarding: they run no foreign code
OWN = frozenset({"skidpad.stack.adas", "skidpad.env.wheel"})
INT_MAX = 2**31 - 1  # the log's whole numbers have 32 bits
LONGEST_MODE = 200  # characters
NO_REPORT = StackReport()


def load_stack(where: str) -> type[Stack]:
    """Returns the class named by `module:Class` or `path/to/file.py:Class`, which runs its module.

    ConfigError where it has no `tick`; errors of `import_class`.
    """
    found = import_class(where, "stack")
    if not callable(getattr(found, "tick", None)):
        raise ConfigError(f"stack {where!r}: class {found.__name__} has no method tick(frame)")
    return found


def import_class(where: str, what: str) -> type[Any]:
    """Returns the class named by `module:Class` or `path/to/file.py:Class`; `what` it is, for messages.

    ConfigError for another form, a failing import or a missing class, FileError for a missing file.
    """
    place, colon, name = where.rpartition(":")
    if not colon or not place or not name.isidentifier():
        raise ConfigError(f"a {what} is given as module:Class or file.py:Class, got {where!r}")
    with _kept_home():
        from_file = place.endswith(".py")
        module = _from_file(Path(place), what) if from_file else _from_module(place, what)
    found = getattr(module, name, None)
    if not isinstance(found, type):
        raise ConfigError(f"{what} {where!r}: {place} has no class {name}")
    return found


@contextmanager
def _kept_home() -> Iterator[None]:
    """Undoes what foreign code does to the working folder; ends a child process that it forks."""
    process, home = os.getpid(), _folder()
    try:
        yield
    finally:
        if os.getpid() != process:
            os._exit(0)
        _enter(home)


def _from_file(path: Path, what: str) -> ModuleType:
    """Returns the module in a .py file, imported and kept in sys.modules under a name of its own.

    FileError where there is no such file, ConfigError where its import fails.
    """
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
    except FOREIGN as error:
        raise ConfigError(
            f"{what} file {str(path)!r} cannot be imported: {describe_value(error)}"
        ) from error
    return module


def _from_module(name: str, what: str) -> ModuleType:
    """Returns the module of that name; raises ConfigError where its import fails."""
    try:
        return import_module(name)
    except FOREIGN as error:  # an import runs foreign code: anything can happen
        raise ConfigError(
            f"{what} module {name!r} cannot be imported: {describe_value(error)}"
        ) from error


class GuardedStack:
    """Runs a stack; whatever it does wrong becomes a StackError, the outcome of its run.

    A folder that it changes to is its own alone, and a child that it forks ends where it would
    return to us.
    """

    def __init__(
        self,
        kind: type[Stack],
        specs: Sequence[SensorSpec],
        map: RoadMap,
        settings: Mapping[str, Any],
    ) -> None:
        self.name = kind.__name__
        self._is_own = kind.__module__ in OWN and not _has_added(settings)
        self._tick = -1  # the last one
        self._taken = frozenset(spec.id for spec in specs)
        self._process, self._folder = os.getpid(), _folder()
        try:
            self.stack = self._call(kind, specs, map, settings)
        except (StackError, ConfigError):
            raise
        except FOREIGN as error:
            raise StackError(f"{self.name} could not be built: {describe_value(error)}") from error

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the stack's checked command; raises StackError where the stack fails."""
        self._tick = frame.tick
        try:
            command = self._call(self.stack.tick, frame)
        except StackError:
            raise
        except FOREIGN as error:
            raise StackError(
                f"{self.name} raised in tick {frame.tick}: {describe_value(error)}"
            ) from error
        if not isinstance(command, VehicleCommand):
            raise StackError(
                f"{self.name} must return a VehicleCommand, got {type(command).__name__} "
                f"in tick {frame.tick}"
            )
        _check(self.name, command, frame.tick)
        return command

    def check(self, command: VehicleCommand, tick: int) -> None:
        """Raises StackError where a value of the command is out of range."""
        _check(self.name, command, tick)

    def close(self) -> None:
        """Ends the stack's run by its `close`, if any; what it does wrong here no longer matters."""
        with suppress(*FOREIGN):
            close = getattr(self.stack, "close", None)
            if callable(close):
                self._call(close)

    @property
    def report(self) -> StackReport:
        """What the stack says about its last tick; empty for a stack that says nothing of the kind.

        StackError where reading it fails or a value cannot be recorded.
        """
        if self._is_own:
            own: StackReport = getattr(self.stack, "report", NO_REPORT)
            return own
        try:
            report = self._call(getattr, self.stack, "report", NO_REPORT)
        except FOREIGN as error:
            raise StackError(
                f"{self.name}.report raised in tick {self._tick}: {describe_value(error)}"
            ) from error
        if not isinstance(report, StackReport):
            return NO_REPORT
        _check_report(self.name, report, self._tick)
        return report

    @property
    def mode(self) -> str:
        """The mode of the last tick in the stack's words; "" for a stack that has none or fails to say."""
        with suppress(*FOREIGN):
            mode = self._call(getattr, self.stack, "mode", "")
            return clean(mode, LONGEST_MODE) if isinstance(mode, str) else ""
        return ""

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the specs of the further sensors that the stack asks for.

        StackError where it fails, or asks for an unknown sensor or one with an id that is taken.
        """
        try:
            wanted = self._call(_sensors_of, self.stack)
        except FOREIGN as error:
            raise StackError(f"{self.name}.sensors() raised: {describe_value(error)}") from error
        _check_sensors(self.name, wanted, self._taken)
        return wanted

    def _call(self, function: Callable[..., T], *arguments: Any) -> T:
        """Calls foreign code in the folder that it last chose and returns what it returns.

        A child process that it forks ends here.
        """
        if self._is_own:
            return function(*arguments)
        home = _folder()
        if self._folder != home:
            _enter(self._folder)
        try:
            return function(*arguments)
        finally:
            if os.getpid() != self._process:  # a child that it forked
                os._exit(0)
            self._folder = _folder()
            if self._folder != home:
                _enter(home)


def _has_added(settings: Mapping[str, Any]) -> bool:
    """Returns whether functions of packages drive along in our stack."""
    own = {function.value for function in Function}
    return not own.issuperset(settings.get("functions", ()))


def _sensors_of(stack: Stack) -> tuple[Any, ...]:
    """Returns the sensors that the stack asks for; empty where it has no method `sensors`."""
    ask = getattr(stack, "sensors", None)
    return () if ask is None else tuple(ask())


def _folder() -> str:
    """Returns the working directory; empty text where it was removed."""
    try:
        return os.getcwd()
    except OSError:  # it was removed
        return ""


def _enter(folder: str) -> None:
    """Changes the working directory; does nothing where that fails."""
    with suppress(OSError):
        os.chdir(folder)


def _check(name: str, command: VehicleCommand, tick: int) -> None:
    """Raises StackError for a command out of range: throttle and brake 0..1, steer -1..1, two switches."""
    throttle, brake, steer = command.throttle, command.brake, command.steer
    if (
        (type(throttle) is type(brake) is type(steer) is float)
        and 0.0 <= throttle <= 1.0
        and 0.0 <= brake <= 1.0
        and -1.0 <= steer <= 1.0
        and type(command.handbrake) is type(command.reverse) is bool
    ):
        return  # as in nearly all ticks
    ranges: tuple[tuple[str, Any, float], ...] = (
        ("throttle", throttle, 0.0),
        ("brake", brake, 0.0),
        ("steer", steer, -1.0),
    )
    for what, value, low in ranges:
        if not _is_number(value) or not isfinite(value) or not low <= value <= 1.0:
            raise StackError(
                f"{name}: {what} must be between {low:g} and 1, "
                f"got {describe_value(value, 100)} in tick {tick}"
            )
    for what, switch in (("handbrake", command.handbrake), ("reverse", command.reverse)):
        if not isinstance(switch, SWITCHES):
            raise StackError(
                f"{name}: {what} must be true or false, got {describe_value(switch, 100)} in tick {tick}"
            )


def _is_number(value: Any) -> bool:
    """Returns whether the value is a real number."""
    return isinstance(value, Real)


def _check_report(name: str, report: StackReport, tick: int) -> None:
    """Raises StackError where a report holds what is neither None nor a number that can be recorded."""
    for field in REPORTED:
        value: Any = getattr(report, field)
        if value is None:
            continue
        whole = isinstance(value, int)
        if not _is_number(value) or (whole and abs(value) > INT_MAX):
            raise StackError(
                f"{name}: report.{field} must be a number or None, "
                f"got {describe_value(value, 100)} in tick {tick}"
            )


def _check_sensors(name: str, wanted: Sequence[SensorSpec], taken: Collection[str]) -> None:
    """Raises StackError for a wanted sensor of unknown kind or with an id that is taken."""
    for k, spec in enumerate(wanted):
        kind = find_sensor_type(spec)
        if kind is None and isinstance(spec, PointSensorSpec):
            words = ", ".join(k.word for k in SENSORS.entries() if k.word)
            raise StackError(
                f"{name}.sensors(): sensor {spec.id!r} has kind {spec.kind!r}; choose one of: {words}"
            )
        if kind is None:  # there is one common radar, and every stack has it
            raise StackError(
                f"{name}.sensors() must return specs of registered sensors "
                f"({', '.join(SENSORS.names())}), got {describe_value(spec)}"
            )
        if spec.id in taken or spec.id in {other.id for other in wanted[:k]}:
            raise StackError(f"{name}.sensors(): there is a sensor {spec.id!r} already")
