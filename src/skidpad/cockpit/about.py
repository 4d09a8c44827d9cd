"""What a page is told about the run that it shows, before the first picture."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple


class About(NamedTuple):
    """Describes what a page shows: a drive or a replay, with its timeline and choices."""

    kind: str  # drive or replay
    timeline: dict[str, Any] | None = None  # of a replay
    vehicles: int = 0  # in the background, as a drive began
    pauses: bool = False  # when its last tab is closed
    again: Mapping[str, str] = MappingProxyType(
        {}
    )  # changes with which a replay can be driven again
    parts: tuple[tuple[str, str], ...] = ()  # what the run is made of: kind and name
