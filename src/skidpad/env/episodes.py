"""Where episodes come from: checked options, the run of a seed, and worlds that are kept between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, TypedDict, TypeVar

import numpy as np
from msgspec import structs

from skidpad.campaign.cells.matrix import describe_run
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.run import RunSpec, StackDriver
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import GripModel, SensorLevel, TrafficStart
from skidpad.core.weather import Weather
from skidpad.env.wheel import WHERE
from skidpad.physics.presets import find_weather

OPTIONS = ("weather", "grip")  # of `reset`
LONGEST = 2**31 - 1  # of a seed


class Course(TypedDict, total=False):
    """What all environments take; `DriveEnv` says what each is, `Episodes` what it is by default."""

    map: str | Path
    weather: str | Weather
    grip: str
    vehicles: int
    traffic: str
    duration: float
    seeds: Sequence[int] | None
    profile: str


class Episode(Protocol):
    """A run that can go back to its first tick."""

    def restart(self) -> None:
        """Goes back to the first tick."""
        ...

    def close(self) -> None:
        """Releases the world of the run."""
        ...


E = TypeVar("E", bound=Episode)


class Episodes(Generic[E]):
    """Gives the episode of a seed. Arguments but the first are those of the environments.

    make: builds the episode of a run, at its first tick.
    """

    def __init__(
        self,
        make: Callable[[RunSpec], E],
        *,
        map: str | Path = "figure8",
        weather: str | Weather = "clear-noon",
        grip: str = "physical",
        vehicles: int = 20,
        traffic: str = "fixed",
        duration: float = 60.0,
        seeds: Sequence[int] | None = None,
        profile: str = "recommended",
    ) -> None:
        if seeds is not None and not len(seeds):
            raise ConfigError("seeds: at least one is needed, or None for any")
        starts = [start.value for start in TrafficStart]
        course = Roads(
            map=str(map),
            traffic=TrafficStart(require_choice("traffic", traffic, starts)),
            vehicles=vehicles,
            allow_fewer=True,
        )
        self.template = RunSpec(
            course=course,
            duration=duration,
            sensors=SensorLevel.OBJECTS,
            settings=load_profile(profile, {}),
        )
        self.make, self.seeds = make, None if seeds is None else tuple(seeds)
        self.outside: dict[str, Any] = {"weather": weather, "grip": grip}
        self.spec(1, {})  # says now what is wrong with them
        self._idle: dict[object, list[E]] = {}
        self._keys: dict[int, object] = {}  # of episodes that are kept, by id

    def spec(self, seed: int, options: Mapping[str, Any]) -> RunSpec:
        """Returns the run of an episode. options: of `reset`, in place of the environment's own."""
        for name in options:
            require_choice("reset option", name, OPTIONS)
        chosen = self.outside | dict(options)
        weather, models = chosen["weather"], [model.value for model in GripModel]
        model = GripModel(require_choice("grip", chosen["grip"], models))
        outside = find_weather(weather) if isinstance(weather, str) else weather
        settings = self.template.settings
        settings = load_profile(settings.profile, {**settings.to_plain(), "grip": model})
        template = structs.replace(self.template, settings=settings)
        return describe_run(StackDriver(WHERE, {}), outside, seed, template)

    def draw(self, rng: np.random.Generator) -> int:
        """Returns a seed, of those that are listed where any are."""
        if self.seeds is None:
            return int(rng.integers(LONGEST))
        return int(self.seeds[rng.integers(len(self.seeds))])

    def begin(self, seed: int, options: Mapping[str, Any] | None, last: E | None) -> E:
        """Returns an episode at its first tick: a new one, or a kept one that goes back to it.

        last: the one that it follows, whose world may be taken again. It stays as it is where this fails.
        """
        options = options or {}
        key = (seed, *(self.outside | dict(options)).values())
        if last is not None and self._keys.get(id(last)) == key:
            last.restart()
            return last
        if idle := self._idle.get(key):
            found = idle.pop()
            found.restart()
        else:
            found = self.make(self.spec(seed, options))
            if self.seeds is not None and seed in self.seeds:
                self._keys[id(found)] = key
        if last is not None:
            self.put_aside(last)
        return found

    def put_aside(self, last: E) -> None:
        """Keeps a world for another episode of its seed where seeds are listed, else releases it."""
        key = self._keys.get(id(last))
        if key is None:
            last.close()
        else:
            self._idle.setdefault(key, []).append(last)

    def close(self) -> None:
        """Releases all worlds that were put aside."""
        for idle in self._idle.values():
            for episode in idle:
                episode.close()
        self._idle.clear()
        self._keys.clear()
