"""The vehicle's spool: what is to be sent lies on disk until the fleet has acknowledged it (C-151).

SPOOL/waiting/<key>.batch    one file per batch: a line of JSON, then the body as it is sent
SPOOL/acknowledged.jsonl     key and ids of what was taken in
The key is the digest of the batch, so that doing a step twice (a kill between two) changes nothing.
"""

from __future__ import annotations

import gzip
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from skidpad.core.errors import FileError, OutputError
from skidpad.core.text.told import on_a_line
from skidpad.fleet.identity import digest
from skidpad.fleet.words import Kind
from skidpad.recording.files import write_bytes

SPOOL_MAX = 16 * 1024**3  # bytes that may wait


@dataclass(frozen=True, slots=True)
class Waiting:
    """A batch that is to be sent."""

    key: str
    kind: Kind
    drive: str
    body: bytes  # gzip


class Spool:
    """A folder that holds what was not acknowledged."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.waiting = folder, folder / "waiting"
        try:
            self.waiting.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be written ({error.strerror})") from error

    def add_batch(self, kind: Kind, content: bytes, drive: str = "") -> str:
        """Keeps a batch until it is acknowledged and returns its key; the same batch again adds nothing.

        Raises OutputError when more than SPOOL_MAX bytes would wait.
        """
        key = digest(b"\n".join((kind.value.encode(), drive.encode(), content)))[:48]
        if key in self.read_receipts():
            return key
        head = json.dumps({"kind": kind.value, "drive": drive}).encode()
        body = gzip.compress(content, compresslevel=6, mtime=0)
        if self.size() + len(body) > SPOOL_MAX:
            raise OutputError(f"{self.folder}: more than {SPOOL_MAX} bytes wait to be sent")
        write_bytes(self.waiting / f"{key}.batch", head + b"\n" + body)
        return key

    def batches(self) -> Iterator[Waiting]:
        """Yields what waits, oldest first; damaged files are renamed to .damaged and left out."""
        paths = [(p.stat().st_mtime_ns, p.name, p) for p in self.waiting.glob("*.batch")]
        for _, _, path in sorted(paths):
            try:
                yield _read(path)
            except FileError:
                path.rename(path.with_suffix(".damaged"))

    def acknowledge(self, key: str, receipt: dict[str, Any]) -> None:
        """Appends the receipt durably, then deletes the batch."""
        with (self.folder / "acknowledged.jsonl").open("ab") as file:
            file.write(json.dumps({"key": key, **receipt}).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        (self.waiting / f"{key}.batch").unlink(missing_ok=True)

    def refuse(self, key: str) -> None:
        """Renames a batch that the fleet will never take to .refused."""
        path = self.waiting / f"{key}.batch"
        path.rename(path.with_suffix(".refused"))

    def read_receipts(self) -> dict[str, dict[str, Any]]:
        """Returns the receipts by key; a line cut off by a kill is left out, its batch still waits."""
        path = self.folder / "acknowledged.jsonl"
        found = {}
        for line in path.read_bytes().splitlines() if path.exists() else []:
            try:
                row = json.loads(line)
                found[str(row["key"])] = row
            except (ValueError, KeyError, TypeError):
                continue
        return found

    def size(self) -> int:
        """Returns the bytes of all batches that wait."""
        return sum(path.stat().st_size for path in self.waiting.glob("*.batch"))

    def count(self) -> int:
        """Returns the number of batches that wait."""
        return sum(1 for _ in self.waiting.glob("*.batch"))


def _read(path: Path) -> Waiting:
    """Returns the batch that waits in a file; raises FileError where it is none."""
    content = path.read_bytes()
    line, _, body = content.partition(b"\n")
    try:
        head = json.loads(line)
        return Waiting(path.stem, Kind(head["kind"]), str(head["drive"]), body)
    except (ValueError, KeyError, TypeError) as error:
        raise FileError(f"{path}: is not a batch ({on_a_line(error)})") from error
