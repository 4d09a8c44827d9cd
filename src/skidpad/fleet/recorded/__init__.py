"""A small fleet that was really driven and recorded, to look at without driving one.

`tools/fleet_recording.py` makes `fleet.tar.gz` and `provenance.json`; the archive holds the data folder of a
fleet without any key.
"""

from __future__ import annotations

import json
import tarfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from skidpad.core.errors import FileError

FOLDER = Path(__file__).parent
ARCHIVE, PROVENANCE = FOLDER / "fleet.tar.gz", FOLDER / "provenance.json"


@dataclass(frozen=True, slots=True)
class Provenance:
    """How the recorded fleet came to be."""

    date: str
    commit: str
    command: str
    vehicles: int
    drives: int
    hazards: int
    first_seed: int

    def describe(self) -> str:
        """Returns the provenance as one line of text."""
        return (
            f"recorded {self.date} at commit {self.commit} by `{self.command}`: {self.vehicles} vehicles,"
            f" {self.drives} drives (seeds from {self.first_seed}), {self.hazards} hazards"
        )


def unpack_recorded(data: Path) -> Provenance:
    """Unpacks the recorded fleet into a new data folder and returns its provenance.

    Raises:
        FileError: the archive is missing or damaged, or the folder is there already.
    """
    try:
        found = Provenance(**json.loads(PROVENANCE.read_text(encoding="utf-8")))
        with tarfile.open(ARCHIVE) as archive:
            data.mkdir(parents=True)
            safely: Any = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
            archive.extractall(data, **safely)
    except (OSError, ValueError, TypeError, tarfile.TarError) as error:
        raise FileError(f"{ARCHIVE}: the recorded fleet cannot be unpacked ({error})") from error
    return found
