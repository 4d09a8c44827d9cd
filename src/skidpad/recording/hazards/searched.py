"""What searches around the hazards of a drive came to: `searches.json` in a monitor's folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from skidpad.recording.files import read_json, write_json

SEARCHES = "searches.json"
Searches = dict[str, tuple[str, ...]]  # sentences by the hazard's id


def read_searches(folder: Path) -> Searches:
    """Returns the sentences on each hazard that was searched, by its id; {} where none was.

    Raises:
        FileError: the file is damaged.
    """
    return read_json(folder / SEARCHES, Searches) or {}


def add_search(folder: Path, id: str, sentences: Sequence[str]) -> None:
    """Writes what a search around a hazard came to into the folder's file; it replaces an earlier one."""
    write_json(folder / SEARCHES, read_searches(folder) | {id: tuple(sentences)})
