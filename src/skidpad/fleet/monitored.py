"""A monitor's output folder as batches: hazards, the drive, indicators by minute."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import polars as pl

from skidpad.core.errors import FileError
from skidpad.fleet.identity import digest
from skidpad.fleet.spool import Spool
from skidpad.fleet.words import Kind
from skidpad.recording.channels import indicators, monitored
from skidpad.recording.hazards.records import TEXT_FILE
from skidpad.recording.hazards.text import HEADER

RECORDS = 100  # of a batch
BYTES = 4 * 1024 * 1024  # of a batch of hazards before it is packed
MINUTE = 60.0  # s


def spool_folder(
    spool: Spool, folder: Path, release: str = "", judged: tuple[int, int] | None = None
) -> list[str]:
    """Spools what `skidpad monitor` wrote into `folder`; returns the keys of its batches.

    release: the update under which the vehicle drove, "" for what it came with. judged: errors in
    the drive under it, and under what the vehicle had before.
    """
    summary = monitored.read_summary(folder) | {"release": release}
    if judged is not None:
        summary["judged"] = {"errors": judged[0], "before": judged[1]}
    content = json.dumps(summary, sort_keys=True).encode()
    drive = digest(content)[:32]
    keys = [spool.add_batch(Kind.HAZARDS, batch, drive) for batch in hazard_batches(folder)]
    keys.append(spool.add_batch(Kind.DRIVE, content, drive))
    if (folder / indicators.FILE).exists():
        rows = indicator_rows(indicators.read_indicators(folder))
        if rows:
            keys.append(spool.add_batch(Kind.INDICATORS, rows, drive))
    return keys


class Lookout:
    """Watches folders that a monitor writes drives into; adds each drive once, when it is complete."""

    def __init__(self, folders: Sequence[Path], release: str = "") -> None:
        self.folders, self.release = folders, release
        self._known: set[Path] = set()

    def spool(self, spool: Spool) -> int:
        """Adds the drives that were completed since the last call; returns how many."""
        inside = [path for folder in self.folders for path in (folder, *sorted(folder.glob("*")))]
        new = [p for p in inside if p not in self._known and (p / monitored.SUMMARY).exists()]
        for path in new:
            spool_folder(spool, path, self.release)
        self._known.update(new)
        return len(new)


def hazard_batches(folder: Path) -> Iterator[bytes]:
    """Yields the records of a folder in batches of RECORDS or BYTES at most; a cut-off one is left out.

    Raises FileError where the folder holds no records of a monitor.
    """
    path = folder / TEXT_FILE
    try:
        text = path.read_bytes()
    except OSError as error:
        raise FileError(
            f"{path}: cannot be read ({error.strerror}); `skidpad monitor` writes it"
        ) from error
    head, _, rest = text.partition(b"\n")
    if head != HEADER.encode():
        raise FileError(f"{path}: its first line must be {HEADER!r}")
    batch: list[bytes] = []
    for record in rest.split(b"\nZ\n")[:-1]:
        if batch and (len(batch) == RECORDS or sum(map(len, batch)) + len(record) > BYTES):
            yield _join_batch(batch)
            batch = []
        batch.append(record + b"\nZ\n")
    if batch:
        yield _join_batch(batch)


def _join_batch(batch: list[bytes]) -> bytes:
    """Returns the bytes of a batch: the header line, then the records."""
    return HEADER.encode() + b"\n" + b"".join(batch)


def indicator_rows(table: pl.DataFrame) -> bytes:
    """Returns finite values of a drive by minute, subject and indicator: one JSON row per line."""
    found = (
        table.filter(pl.col("value").is_finite())
        .with_columns(minute=(pl.col("t") / MINUTE).floor().cast(pl.Int64))
        .group_by("minute", "subject", "indicator", maintain_order=True)
        .agg(
            n=pl.len().cast(pl.Int64),
            violated=pl.col("violated").sum().cast(pl.Int64),
            mean=pl.col("value").mean(),
            least=pl.col("value").min(),
            greatest=pl.col("value").max(),
        )
    )
    return b"".join(json.dumps(row).encode() + b"\n" for row in found.iter_rows(named=True))
