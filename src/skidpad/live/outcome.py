"""What became of a link, beside what the monitor wrote."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from skidpad.core.files.reading import decode_json, read_bytes
from skidpad.live.settings import Flow
from skidpad.recording.files import write_json

LINK = "link.json"


class LinkOutcome(msgspec.Struct, frozen=True, kw_only=True):
    """What became of a link."""

    flow: Flow
    cycles: int  # of the drive
    missing: list[int]  # numbers of the cycles that the monitor was not given
    ended: str  # "complete", or one sentence
    isolation: dict[str, Any] = {}  # what C-231 asks for and this system allowed

    @property
    def sentence(self) -> str:
        """Returns the outcome as one line of text."""
        lost = f", {len(self.missing)} of them missing" if self.missing else ""
        return f"{self.cycles} cycles{lost}; {self.ended}"


def write_outcome(folder: Path, outcome: LinkOutcome) -> None:
    """Writes the outcome as link.json into the monitor's folder."""
    write_json(folder / LINK, outcome, indent=1)


def read_outcome(folder: Path) -> LinkOutcome:
    """Returns the outcome in a monitor's folder; FileError where there is none."""
    path = folder / LINK
    outcome: LinkOutcome = decode_json(read_bytes(path, "outcome"), str(path), LinkOutcome)
    return outcome
