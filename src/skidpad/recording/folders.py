"""Folders of results: which kind of result one holds, and a result of several files that appears whole."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path

from skidpad.core.errors import OutputError
from skidpad.recording.files import output_error


class ResultKind(Enum):
    """What a folder may hold, by the words for it."""

    CAMPAIGN = "a campaign"
    RUN = "a run"
    MONITORED = "a monitored drive"
    EVALUATION = "an evaluation of channels"


MARKS = {
    ResultKind.CAMPAIGN: ("campaign.json", "ledger.jsonl", "results.parquet"),
    ResultKind.RUN: ("ticks.parquet", "events.jsonl"),
    ResultKind.MONITORED: ("monitor.json", "hazards.txt"),
    ResultKind.EVALUATION: ("evaluation.json",),
}


def require_kind(folder: Path, *allowed: ResultKind) -> None:
    """Raises OutputError when `folder` is none, or holds a result of another kind than these.

    A folder that does not exist passes.
    """
    try:
        names = {entry.name for entry in folder.iterdir()}
    except FileNotFoundError:
        return
    except OSError as error:
        raise OutputError(f"{folder} cannot hold results: {error.strerror}") from error
    for kind, marks in MARKS.items():
        if kind not in allowed and names.intersection(marks):
            raise OutputError(f"{folder} holds {kind.value}; choose another --out")


@contextmanager
def prepare_files(folder: Path, names: Sequence[str]) -> Iterator[Path]:
    """Yields a folder for the files of a result; they replace those in `folder` when all are complete.

    names: all files that such a result may have, the one that marks it last. What an earlier
    result has and this one has not goes with it. An error leaves `folder` as it was.
    """
    fresh = not folder.exists()
    part = folder / f".{os.getpid()}.part"
    try:
        part.mkdir(parents=True, exist_ok=True)
        yield part
        for name in names:
            if (part / name).exists():
                os.replace(part / name, folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise output_error(folder, error) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
        if fresh:
            with suppress(OSError):
                folder.rmdir()  # only when nothing came of it
