"""The cells of the matrix: what drives, in which weather, with which seed. All of it is data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import Enum
from typing import Any

from skidpad.core.errors import ConfigError, require_range
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import RANGES, Weather
from skidpad.stack.configurations import CONFIGURATIONS, Functions, functions_of
from skidpad.stack.settings import Settings

DURATION = 500.0  # s
FIRST_SEED = 1  # seeds that reports use count up from here
TUNING_SEEDS = range(900_000, 1_000_000)  # seeds for choosing parameters, never reported
DEADLINE_BASE_S, DEADLINE_PER_SIMULATED_S = 180.0, 4.0  # wall time after which a run is killed


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """What drives: a set of our functions, or any stack as module:Class."""

    label: str  # "0" to "4", "acc+lca", or module:Class
    functions: Functions = frozenset()
    stack: str | None = None
    options: dict[str, Any] = field(default_factory=dict)  # for a stack of somebody else


class BackendKind(str, Enum):
    """Which simulator drives the world."""

    EMBEDDED = "embedded"
    CARLA = "carla"


@dataclass(frozen=True, slots=True, kw_only=True)
class BackendChoice:
    """A simulator and, for a CARLA server, where it is and how it is used."""

    kind: BackendKind = BackendKind.EMBEDDED
    host: str = "127.0.0.1"
    port: int = 2000
    pace: bool = False  # hold runs at real time
    without: tuple[str, ...] = ()  # optimisations that are switched off
    server: tuple[str, ...] = ()  # command that starts the server; (): it runs already
    restart_every: int = 0  # runs after which that server is started anew; 0: never

    def resolved(self) -> dict[str, Any]:
        """What of it decides a run; an address does not."""
        return {"kind": self.kind.value, "pace": self.pace, "without": sorted(self.without)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One run."""

    driver: Driver
    weather: Weather
    seed: int
    profile: str
    settings: Settings
    map: str = "figure8"
    duration: float = DURATION
    traffic: str = "fixed"  # or "random"
    vehicles: int = 20
    allow_fewer: bool = False
    level: SensorLevel = SensorLevel.PIXELS
    render_all: bool = False
    backend: BackendChoice = field(default_factory=BackendChoice)

    @property
    def name(self) -> str:
        """Name of the run and of its folder: driver, weather, seed."""
        driver = "".join(c if c.isalnum() else "-" for c in self.driver.label)
        return f"{driver}_{self.weather.name}-{self.seed:03d}"

    @property
    def deadline_s(self) -> float:
        """Wall time after which the run counts as hanging."""
        return DEADLINE_BASE_S + DEADLINE_PER_SIMULATED_S * self.duration

    def resolved(self) -> dict[str, Any]:
        """Everything that decides the run, as plain data (A-260)."""
        return {
            "driver": self.driver.label,
            "functions": sorted(f.value for f in self.driver.functions),
            "stack": self.driver.stack,
            "options": self.driver.options,
            "weather": asdict(self.weather),
            "seed": self.seed,
            "profile": self.profile,
            "settings": self.settings.as_plain(),
            "map": self.map,
            "duration": self.duration,
            "traffic": self.traffic,
            "vehicles": self.vehicles,
            "allow_fewer": self.allow_fewer,
            "sensors": self.level.value,
            "render": "all" if self.render_all else "needed",
            "backend": self.backend.resolved(),
        }


def published_drivers(numbers: str) -> list[Driver]:
    """`0,1,4` to drivers; "all" is all five."""
    if numbers == "all":
        return [Driver(label=str(n), functions=f) for n, f in CONFIGURATIONS.items()]
    drivers = []
    for text in numbers.split(","):
        if not text.strip().isdigit():
            allowed = ", ".join(map(str, CONFIGURATIONS))
            raise ConfigError(f"unknown configuration {text.strip()!r}; choose among: {allowed}")
        drivers.append(Driver(label=text.strip(), functions=functions_of(int(text))))
    return drivers


def sweep(weather: Sequence[Weather], text: str) -> list[Weather]:
    """`wetness=0:100:20` to a copy of each weather for each value, ends included."""
    name, equals, span = text.partition("=")
    if not equals or name not in RANGES:
        raise ConfigError(
            f"--sweep takes FIELD=FROM:TO:STEP with a weather field ({', '.join(RANGES)}), got {text!r}"
        )
    try:
        start, stop, step = (float(part) for part in span.split(":"))
    except ValueError:
        raise ConfigError(
            f"--sweep {name} takes three numbers FROM:TO:STEP, got {span!r}"
        ) from None
    if step <= 0.0 or stop < start:
        raise ConfigError(f"--sweep {name} needs A <= B and STEP > 0, got {span!r}")
    values = [start + k * step for k in range(int((stop - start) / step + 1e-9) + 1)]
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


def seeds(n: int) -> range:
    """The first n reported seeds; common to all drivers and weathers, so comparisons are paired."""
    require_range("--seeds", n, 1, 100_000)
    return range(FIRST_SEED, FIRST_SEED + n)


def cross(
    drivers: Sequence[Driver], weather: Sequence[Weather], n: int, template: Cell
) -> list[Cell]:
    """Every driver in every weather with every seed, the rest as in `template`."""
    cells = [
        replace(template, driver=d, weather=w, seed=s)
        for s in seeds(n)
        for w in weather
        for d in drivers
    ]
    if len({c.name for c in cells}) != len(cells):
        raise ConfigError("two cells have the same name: a driver or a weather is given twice")
    return cells
