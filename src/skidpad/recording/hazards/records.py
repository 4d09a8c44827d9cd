"""Hazard records: what was found, and the worlds around it as the channels saw them (C-150).

`hazards.txt` is the record, `hazards.jsonl` its index; one writer makes both (decision C-13).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import msgspec

from skidpad.core.channels import Cycle
from skidpad.core.errors import FileError, OutputError
from skidpad.core.files.reading import UNUSABLE, decode_json, read_bytes, unusable
from skidpad.core.text.told import on_a_line
from skidpad.core.vocabulary import HazardType
from skidpad.recording.hazards.text import HEADER, encode_worlds
from skidpad.recording.hazards.text_reader import decode_worlds

TEXT_FILE = "hazards.txt"
INDEX_FILE = "hazards.jsonl"
RECORD_LIMIT = 32 * 1024 * 1024  # bytes of one record
LATEST = 1e11  # s, since 1970 the year 5138
FILE_LIMIT = 1024 * 1024 * 1024
INDEX_LIMIT = 256 * 1024 * 1024


class InvolvedObject(msgspec.Struct, frozen=True):
    """An object that a channel reported and that the hazard is about."""

    channel: str
    id: int | None  # the channel's own identity of it
    x: float  # m, world, when the hazard was worst
    y: float


class HazardHead(msgspec.Struct, frozen=True, kw_only=True):
    """What a record says of its hazard, without the worlds around it."""

    id: str  # h and its number, as h0001
    type: HazardType  # which hazard
    profile: str  # name of the profile of rules
    forms: str  # forms of the formulas
    t_start: float  # s, first cycle in which the rule fired
    t_end: float  # s, last one
    t_worst: float  # s, when it was worst
    count: int  # cycles in which it fired
    extremes: dict[str, float]  # signals when the hazard was worst
    channels: tuple[str, ...]  # all channels, in the order of the worlds
    driving: str | None  # name of the channel that drove; null: none
    involved: tuple[str, ...]  # names of the channels that it is about
    objects: tuple[InvolvedObject, ...]  # that it is about, m in the world frame
    flags: tuple[str, ...]  # "assumed": OLSS without a pair; "cut": the world ends early
    context: dict[str, str]  # map and weather of the drive


class HazardRecord(HazardHead, frozen=True, kw_only=True):
    """Record of one hazardous scene, with the worlds around it."""

    objects: tuple[InvolvedObject, ...] = ()  # that it is about, m in the world frame
    flags: tuple[str, ...] = ()  # "assumed": OLSS without a pair; "cut": the world ends early
    worlds: tuple[Cycle, ...] = ()  # from 5 s before to 5 s after


class HazardWriter(AbstractContextManager["HazardWriter"]):
    """Writes records as they close, text and index together."""

    def __init__(self, folder: Path) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._text = (folder / TEXT_FILE).open("w", encoding="ascii", newline="\n")
            self._index = (folder / INDEX_FILE).open("w", encoding="utf-8", newline="\n")
        except OSError as error:
            raise OutputError(f"{folder}: cannot be written ({error.strerror})") from error
        self._text.write(HEADER + "\n")

    def write(self, record: HazardRecord) -> None:
        """Appends a record to the text and its row to the index."""
        text = encode_record(record)
        offset = self._text.tell()
        self._text.write(text)
        self._text.flush()
        row = index_row(record) | {"offset": offset, "bytes": len(text)}
        self._index.write(json.dumps(row, allow_nan=False) + "\n")
        self._index.flush()

    def close(self) -> None:
        """Finishes both files; safe to call twice."""
        self._text.close()
        self._index.close()

    def __exit__(self, *error: object) -> None:
        self.close()


def index_row(record: HazardRecord) -> dict[str, Any]:
    """Returns the record without its worlds, for JSON."""
    return _plain(record) | {"cycles": len(record.worlds)}


def _plain(head: HazardHead) -> dict[str, Any]:
    """Returns what a record says of its hazard as plain values."""
    said = {name: getattr(head, name) for name in HazardHead.__struct_fields__}
    plain: dict[str, Any] = msgspec.to_builtins(said, enc_hook=lambda v: v.item())  # of NumPy
    return plain


def encode_record(record: HazardRecord) -> str:
    """Returns the record as lines of text: its index, its worlds, and an end mark."""
    head = json.dumps(index_row(record), allow_nan=False)
    lines = ["H " + head, *encode_worlds(record.worlds, len(record.channels)), "Z"]
    return "\n".join(lines) + "\n"


def decode_record(text: str) -> HazardRecord:
    """Returns the record of a text of `encode_record`, to 1 cm, 1 mrad and 1 ms; FileError for others."""
    lines = text.split("\n")
    if len(lines) < 3 or not lines[0].startswith("H ") or lines[-2:] != ["Z", ""]:
        raise FileError("a hazard record must run from a line H to a line Z")
    try:
        row = json.loads(lines[0][2:])
        head, expected = _head(row), int(row["cycles"])
    except UNUSABLE as error:
        raise FileError(f"a hazard record has an unreadable head ({on_a_line(error)})") from error
    worlds = decode_worlds(lines[1:-2], len(head.channels))
    if len(worlds) != expected:
        raise FileError(f"hazard {head.id}: {len(worlds)} cycles, its head says {expected}")
    return HazardRecord(**msgspec.structs.asdict(head), worlds=worlds)


def _head(row: dict[str, Any]) -> HazardHead:
    """Returns the head of a decoded row; raises an error where a field does not fit."""
    head = msgspec.convert(row, HazardHead)
    for name in ("t_start", "t_end", "t_worst"):
        if not 0.0 <= (t := getattr(head, name)) <= LATEST:
            raise FileError(f"{name} must be between 0 and {LATEST:g} s, got {t:g}")
    return head


def read_hazards(folder: Path) -> Iterator[HazardRecord]:
    """Yields the records of a monitor's output folder; a record cut off at the end is left out.

    FileError when there is no record file, or when it is damaged before its end.
    """
    path = folder / TEXT_FILE
    try:
        if path.stat().st_size > FILE_LIMIT:
            raise FileError(f"{path}: is larger than {FILE_LIMIT} bytes")
        stream = path.open(encoding="ascii", errors="strict", newline="\n")
    except OSError as error:
        raise FileError(
            f"{path}: cannot be read ({error.strerror}); `skidpad monitor` writes it"
        ) from error
    with stream:
        try:
            yield from _records(stream)
        except UnicodeDecodeError as error:
            raise FileError(f"{path}: is not a text of hazards ({error.reason})") from error
        except FileError as error:
            raise FileError(f"{path}: {error}") from error


def _records(stream: Iterator[str]) -> Iterator[HazardRecord]:
    """Yields the records of a text; raises FileError for a wrong first line or one too long."""
    if next(stream, "").rstrip("\n") != HEADER:
        raise FileError(f"its first line must be {HEADER!r}")
    lines: list[str] = []
    size = 0
    for line in stream:
        size += len(line)
        if size > RECORD_LIMIT:
            raise FileError(f"a record is longer than {RECORD_LIMIT} bytes")
        lines.append(line)
        if line == "Z\n":
            yield decode_record("".join(lines))
            lines, size = [], 0


def read_index(folder: Path) -> list[dict[str, Any]]:
    """Returns the rows of the index file; FileError names a line that is damaged."""
    path = folder / INDEX_FILE
    lines = read_bytes(path, "`skidpad monitor` writes the index", INDEX_LIMIT).splitlines()
    rows = []
    for number, line in enumerate(lines, start=1):
        where = f"{path}, line {number}"
        row = decode_json(line, where, dict[str, Any])
        try:
            rows.append(row | _plain(_head(row)) | {"cycles": int(row["cycles"])})
        except UNUSABLE as error:
            raise unusable(where, "a hazard of an index", error) from None
    return rows
