"""What a page is told about the run that it shows, before the first picture."""

from __future__ import annotations

from typing import Any, NamedTuple


class About(NamedTuple):
    """What a page is of."""

    kind: str  # drive or replay
    timeline: dict[str, Any] | None = None  # of a replay
    vehicles: int = 0  # in the background, as a drive began
    pauses: bool = False  # when its last tab is closed
