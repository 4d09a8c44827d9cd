"""The driving functions of the stack as entries of a registry, to which installed packages add."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from skidpad.core.errors import ConfigError, StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.objects.registry import Registry
from skidpad.core.run import Function
from skidpad.core.specs import SensorSpec
from skidpad.core.states import VehicleCommand
from skidpad.core.text.told import describe_value

if TYPE_CHECKING:  # kernels come with it
    from skidpad.roads.queries import RoadMap


class DrivingFunction(Protocol):
    """A function that acts after those of the stack, on what the stack would do.

    Optional: `sensors()` returns specs of further sensors, whose readings arrive in `frame.extra` by id;
    `numbers()` returns numbers of the last tick by "name_unit", which are recorded; `mode` is a text
    on its present state, for the cockpit.
    """

    def update(self, frame: SensorFrame, command: VehicleCommand) -> VehicleCommand:
        """Returns the command of this tick, changed or as it is.

        Args:
            frame: What the stack saw in this tick.
            command: What the stack, and the functions before this one, would do.

        Returns:
            The command that the next function gets, or the vehicle.

        Raises:
            Exception: anything; the run ends as a failure of the stack that names this function.

        Example:
            >>> def update(self, frame, command):
            ...     return replace(command, throttle=min(command.throttle, 0.5))
        """
        ...


Factory = Callable[["RoadMap", float], DrivingFunction]


@dataclass(frozen=True, slots=True)
class FunctionType:
    """A driving function that a configuration of the stack can have.

    Attributes:
        name: The word of `--functions`.
        title: A few words for tables and pages.
        units: What its numbers are, with units.
        factory: `factory(map, dt)` returns the function of one run; None: the stack has it built in.
    """

    name: str
    title: str
    units: str = ""
    factory: Factory | None = None


def _own_functions() -> tuple[FunctionType, ...]:
    """Returns the driving functions that Skidpad itself registers."""
    titles = {
        Function.ACC: "ACC",
        Function.LCA: "lane centring",
        Function.TLA: "traffic-light assist",
        Function.RESUME: "resume",
        Function.LIMITER: "limiter",
        Function.AEB: "emergency braking",
        Function.BEND: "slow in bends",
    }
    return tuple(FunctionType(function.value, title) for function, title in titles.items())


FUNCTIONS = Registry("function", "skidpad.functions", FunctionType, _own_functions)


def factory_of(name: str) -> Factory:
    """Returns the factory of a function that a package adds; ConfigError where it has none."""
    factory = FUNCTIONS.get(name).factory
    if factory is None:
        package = FUNCTIONS.sources()[name].package
        raise ConfigError(
            f"function {name!r} of the package {package}: `factory` must be a callable, got None"
        )
    return factory


class AddedFunctions:
    """The functions of packages in one run, one after the other."""

    def __init__(self, names: Sequence[str], map: RoadMap, dt: float) -> None:
        self.kinds = tuple(FUNCTIONS.get(name) for name in names)
        self._factories = [factory_of(name) for name in names]
        self._map, self._dt = map, dt
        self.reset()

    def reset(self) -> None:
        """Makes all added functions anew from their factories."""
        self._functions = [factory(self._map, self._dt) for factory in self._factories]

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the further sensors that the functions ask for; one that two ask for alike is one."""
        asked: list[SensorSpec] = []
        for function in self._functions:
            specs = function.sensors() if hasattr(function, "sensors") else ()
            asked += [spec for spec in specs if spec not in asked]
        return tuple(asked)

    def update(self, frame: SensorFrame, command: VehicleCommand) -> VehicleCommand:
        """Returns the command after each function has changed it.

        Raises:
            StackError: a function raised; the sentence names it and its package.
        """
        for kind, function in zip(self.kinds, self._functions, strict=True):
            try:
                command = function.update(frame, command)
            except Exception as error:
                package = FUNCTIONS.sources()[kind.name].package
                raise StackError(
                    f"function {kind.name} (package {package}) raised in tick {frame.tick}: "
                    f"{describe_value(error)}"
                ) from error
        return command

    @property
    def mode(self) -> str:
        """The texts of those that say something, each as " [text]"; "" for none."""
        texts = (getattr(function, "mode", "") for function in self._functions)
        return "".join(f" [{text}]" for text in texts if text)

    def numbers(self) -> dict[str, Mapping[str, float]]:
        """Returns the numbers of the last tick by name of function; functions without any are left out."""
        pairs = zip(self.kinds, self._functions, strict=True)
        return {kind.name: f.numbers() for kind, f in pairs if hasattr(f, "numbers")}
