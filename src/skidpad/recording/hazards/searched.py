"""What searches around the hazards of a drive came to: `searches.json` in a monitor's folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from skidpad.core.files.reading import decode_json, read_bytes
from skidpad.recording.files import write_bytes

SEARCHES = "searches.json"
Searches = dict[str, tuple[str, ...]]  # sentences by the hazard's id


def read_searches(folder: Path) -> Searches:
    """Returns the sentences on each hazard that was searched, by its id; {} where none was.

    Raises:
        FileError: the file is damaged.
    """
    path = folder / SEARCHES
    if not path.is_file():
        return {}
    found: Searches = decode_json(read_bytes(path, SEARCHES), str(path), Searches)
    return found


def add_search(folder: Path, id: str, sentences: Sequence[str]) -> None:
    """Writes what a search around a hazard came to into the folder's file; it replaces an earlier one."""
    found = read_searches(folder) | {id: tuple(sentences)}
    write_bytes(folder / SEARCHES, msgspec.json.format(msgspec.json.encode(found)))
