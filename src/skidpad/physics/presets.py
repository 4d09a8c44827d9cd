"""Weather by name or from a user's file."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec

from skidpad.core.errors import ConfigError
from skidpad.core.files.reading import convert_plain, decode_yaml, read_bytes
from skidpad.core.objects.registry import Registry
from skidpad.core.weather import Weather

MATRIX, GRIP = "matrix", "grip"
SNOW = "snow"  # the one preset that only the physical grip model knows


def _weather(fields: Any, where: str) -> Weather:
    """Returns a Weather of a mapping; ConfigError, beginning with `where`, for anything else in it."""
    if not isinstance(fields, dict):
        raise ConfigError(
            f"{where} must be a mapping of weather fields, got one of type {type(fields).__name__}"
        )
    known = Weather.__dataclass_fields__
    unknown = sorted(str(key) for key in fields if key not in known)
    if unknown:
        raise ConfigError(
            f"{where}: unknown field {unknown[0]!r:.100}; known are {', '.join(known)}"
        )
    weather: Weather = convert_plain(fields, Weather, where)
    return weather


@lru_cache(maxsize=1)
def preset_groups() -> dict[str, dict[str, Weather]]:
    """Returns presets by group (`matrix`, `grip`) and name, in the published order."""
    text = resources.files("skidpad.physics").joinpath("presets.yaml").read_bytes()
    groups = msgspec.yaml.decode(text, type=dict[str, dict[str, dict[str, Any]]])
    return {
        group: {
            name: _weather({"name": name, **fields}, f"preset {name}")
            for name, fields in members.items()
        }
        for group, members in groups.items()
    }


def _own_presets() -> tuple[Weather, ...]:
    """Returns the weather presets of all groups that come with Skidpad."""
    return tuple(w for members in preset_groups().values() for w in members.values())


WEATHERS = Registry("weather", "skidpad.weathers", Weather, _own_presets)


def all_presets() -> dict[str, Weather]:
    """Returns every preset by its name: those of Skidpad, then those of installed packages."""
    return {weather.name: weather for weather in WEATHERS.entries()}


def preset_name(text: str) -> str | None:
    """Returns the preset's own spelling of `text`; None where there is no such preset.

    Case does not matter, and `-` and `_` are one.
    """
    wanted = text.strip().lower().replace("_", "-")
    return next((name for name in WEATHERS.names() if name.replace("_", "-") == wanted), None)


def preset(name: str) -> Weather:
    """Returns the preset with this name, spelled as in `preset_name`; ConfigError lists all names."""
    known = preset_name(name)
    return WEATHERS.get(name if known is None else known)


def load_weather(path: Path) -> Weather:
    """Returns a weather from a YAML file of fields; its name is the file's unless it gives one.

    FileError where it cannot be read, ConfigError for what is not a weather.
    """
    fields = decode_yaml(read_bytes(path, "weather file"), f"weather file {path}")
    weather = _weather(fields, f"weather file {path}")
    return weather if weather.name else replace(weather, name=path.stem)


def find_weather(text: str) -> Weather:
    """Returns the weather that a user writes: a preset's name, or a .yaml file; raises what those raise."""
    path = Path(text)
    if path.suffix in (".yaml", ".yml"):
        return load_weather(path)
    return preset(text)


class WeatherManager:
    """The weather of a session: apply by name, or go to the next preset (A-217)."""

    def __init__(self, weathers: tuple[Weather, ...] | None = None) -> None:
        """Presets to cycle through, at least one; None: the six of the matrix."""
        self.weathers = tuple(preset_groups()[MATRIX].values()) if weathers is None else weathers
        if not self.weathers:
            raise ConfigError("a weather manager needs at least one weather")
        self.index = 0

    @property
    def current(self) -> Weather:
        """The weather that is in force; its name and parameters."""
        return self.weathers[self.index]

    def apply(self, name: str) -> bool:
        """Switches to the weather with this name or title and returns True.

        False, and no change, if unknown.
        """
        wanted = name.replace("_", "-")
        for index, weather in enumerate(self.weathers):
            if wanted in (weather.name.replace("_", "-"), weather.title):
                self.index = index
                return True
        return False

    def cycle(self) -> Weather:
        """Switches to the next weather, after the last to the first, and returns it."""
        self.index = (self.index + 1) % len(self.weathers)
        return self.current
