"""One setting: its default, its source, its range, and how its value is read from text.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class WorldSettings(SettingsPart):
        mu_ref: float = setting_field(0.9, "M-1", "friction of a dry road", low=0.05, high=3.0)

That line is the only place where a setting is declared. Profiles, `--set`, `skidpad profiles`,
`skidpad.drive`, config.yaml and the page of settings read it from there (`skidpad.core.settings.parts`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import Field, dataclass, field, fields
from enum import Enum
from typing import Any, get_args, get_type_hints

from skidpad.core.errors import ConfigError, require_choice, require_range

Plain = bool | float | str | None
SWITCH = {"on": True, "true": True, "yes": True, "off": False, "false": False, "no": False}


def setting_field(
    default: Any,
    source: str,
    text: str,
    *,
    low: float | None = None,
    high: float | None = None,
    words: Mapping[str, float] | None = None,
    choices: Callable[[], Iterable[str]] | None = None,
) -> Any:
    """Returns the field of a setting.

    Args:
        default: its value in the profile `recommended`.
        source: discrepancy, requirement or decision that it settles.
        text: what it decides, in one line.
        low: least value that a number may have.
        high: greatest one.
        words: names that stand for numbers.
        choices: returns the names of which a text must be one.
    """
    about: dict[str, Any] = {"source": source, "text": text, "low": low, "high": high}
    return field(default=default, metadata=about | {"words": words or {}, "choices": choices})


@dataclass(frozen=True, slots=True)
class SettingField:
    """One setting as users meet it: name, type, source and what it decides."""

    name: str
    kind: Any  # bool, float, str or an Enum
    optional: bool
    source: str
    text: str
    low: float | None
    high: float | None
    words: Mapping[str, float]
    choices: Callable[[], Iterable[str]] | None

    @property
    def range_text(self) -> str:
        """Returns in words what values the setting takes."""
        if self.kind is bool:
            return "on or off"
        if self.choices is not None:
            return ", ".join(self.choices())
        if issubclass(self.kind, Enum):
            return ", ".join(m.value for m in self.kind)
        words = f", {' or '.join(self.words)}" if self.words else ""
        return (
            f"a number between {self.low:g} and {self.high:g}{words}" + " or none" * self.optional
        )

    def read(self, value: object) -> Any:
        """Returns `value` in the setting's type; text is read as on a command line.

        Raises:
            ConfigError: the setting does not take this value.
        """
        if self.optional and value in (None, "none"):
            return None
        if self.kind is bool:
            return value if isinstance(value, bool) else self._read_switch(value)
        if self.kind is str and self.choices is not None:
            return require_choice(self.name, str(value), list(self.choices()))
        if issubclass(self.kind, Enum):
            text = value.value if isinstance(value, Enum) else str(value)
            return self.kind(require_choice(self.name, text, [m.value for m in self.kind]))
        return self._read_number(value)

    def require_in_range(self, value: Any) -> None:
        """Raise ConfigError for a number outside the setting's range."""
        if value is not None and self.low is not None and self.high is not None:
            require_range(self.name, value, self.low, self.high)

    def _read_switch(self, value: object) -> bool:
        """Returns the value as a bool; raises ConfigError where it is no word for on or off."""
        if str(value).lower() not in SWITCH:
            raise ConfigError(f"setting {self.name} must be {self.range_text}, got {value!r}")
        return SWITCH[str(value).lower()]

    def _read_number(self, value: Any) -> float:
        """Returns the value as a float, or the number that its word stands for; raises ConfigError."""
        if isinstance(value, str) and value in self.words:
            return self.words[value]
        try:
            if isinstance(value, bool):
                raise TypeError
            return float(value)
        except (TypeError, ValueError):
            raise ConfigError(
                f"setting {self.name} must be {self.range_text}, got {value!r}"
            ) from None


class SettingsPart:
    """A part of the settings: a frozen dataclass whose fields are settings."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for name, one in describe_settings(type(self)).items():
            one.require_in_range(getattr(self, name))

    def to_plain(self) -> dict[str, Plain]:
        """Returns the values by name, as YAML holds them."""
        values = ((name, getattr(self, name)) for name in describe_settings(type(self)))
        return {name: v.value if isinstance(v, Enum) else v for name, v in values}


def describe_settings(part: type[SettingsPart]) -> dict[str, SettingField]:
    """Returns the settings of a part by name."""
    if part not in _described:
        hints = get_type_hints(part)
        found: Any = part  # a dataclass, as all parts are
        _described[part] = {f.name: _describe(f, hints[f.name]) for f in fields(found)}
    return _described[part]


_described: dict[type[SettingsPart], dict[str, SettingField]] = {}


def _describe(one: Field[Any], hint: Any) -> SettingField:
    """Returns the setting of a dataclass field, from its type hint and its metadata."""
    kinds = get_args(hint) or (hint,)
    kind = next(k for k in kinds if k is not type(None))
    return SettingField(name=one.name, kind=kind, optional=type(None) in kinds, **one.metadata)
