"""Exposure models from YAML: how an encounter varies, how often it happens, and where that was read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.files.reading import decode_yaml, read_bytes
from skidpad.core.maths.space import Variable
from skidpad.core.text.told import describe_value
from skidpad.recording.campaign.risks import Rate
from skidpad.search.space import parse_variable

KEYS = ("variables", "per_hour", "per_100km")


@dataclass(frozen=True, slots=True)
class Exposure:
    """Variables of an encounter, and how often it happens; None where that is not said."""

    variables: tuple[Variable, ...]
    per_hour: Rate | None
    per_100km: Rate | None


NO_EXPOSURE = Exposure((), None, None)


def read_exposure(path: Path) -> Exposure:
    """Return the exposure model of a YAML file.

        variables:
          LeadS: {law: "normal(128,6,100:160)", source: "author, year, table"}
          weather: {law: "clear-noon|rain-noon"}
        per_hour: {value: 0.4, source: "..."}      # encounters per hour; per_100km likewise

    Raises:
        ConfigError: a key is unknown, a law cannot be read, or a rate is not above 0.
        FileError: the file is missing or no YAML.
    """
    plain = decode_yaml(read_bytes(path, str(path)), str(path))
    where = _mapping(plain, str(path), KEYS)
    variables = _mapping(where.get("variables", {}), f"{path}: variables", None)
    return Exposure(
        tuple(_variable(name, of, f"{path}: variables.{name}") for name, of in variables.items()),
        _rate(where.get("per_hour"), f"{path}: per_hour"),
        _rate(where.get("per_100km"), f"{path}: per_100km"),
    )


def _mapping(value: Any, where: str, keys: tuple[str, ...] | None) -> dict[str, Any]:
    """Returns a mapping with text keys; raises ConfigError for another type or an unknown key."""
    if not isinstance(value, dict):
        raise ConfigError(f"{where} must be a mapping, got {describe_value(value, 100)}")
    unknown = [str(k) for k in value if keys is not None and k not in keys]
    if unknown and keys is not None:
        raise ConfigError(f"{where}: unknown key {unknown[0]!r}; known are {', '.join(keys)}")
    return {str(k): v for k, v in value.items()}


def _variable(name: str, value: Any, where: str) -> Variable:
    """Returns the variable of an exposure file: name, law and source."""
    fields = _mapping(value, where, ("law", "source"))
    if not isinstance(fields.get("law"), str):
        raise ConfigError(f'{where}: law must be a text such as "normal(3,1,0:8)"')
    try:
        found = parse_variable(f"{name}={fields['law']}")
    except ConfigError as error:
        raise ConfigError(f"{where}: {str(error).removeprefix('--vary ')}") from None
    return Variable(found.name, found.law, str(fields.get("source", "")))


def _rate(value: Any, where: str) -> Rate | None:
    """Returns a rate above 0 with its source; None for a value of None."""
    if value is None:
        return None
    fields = _mapping(value, where, ("value", "source"))
    number = fields.get("value")
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not 0.0 < number < 1e9:
        raise ConfigError(
            f"{where}.value must be a number above 0, got {describe_value(number, 100)}"
        )
    return Rate(float(number), str(fields.get("source", "")))
