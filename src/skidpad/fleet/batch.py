"""What a vehicle's batch says, checked before anything of it is kept.

Of a hazard record only the head is read here; its worlds are read when somebody asks for them, by a
reader that takes nothing on trust (`recording.hazards.text_reader`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec

from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.fleet.identity import digest
from skidpad.fleet.words import Limits, Refused, decode_sent
from skidpad.recording.hazards.records import HazardHead
from skidpad.recording.hazards.text import HEADER

END = b"\nZ\n"
NUMBER_MAX = 1.0e9  # m or s, of any number in a head
WORDS_MAX = 64


class Head(HazardHead, frozen=True, kw_only=True):
    """The index row of a record (`recording.hazards.records.index_row`)."""

    cycles: int


@dataclass(frozen=True, slots=True)
class Found:
    """One record of a batch."""

    head: Head
    text: str  # the head as it was understood, JSON: what nobody asked for is in the body alone
    digest: str
    start: int  # byte of the unpacked batch
    size: int
    x: float  # m, where the object was, or where the record begins
    y: float


Count = Annotated[int, msgspec.Meta(ge=0, le=1_000_000)]


class ErrorCounts(msgspec.Struct, frozen=True):
    """Errors of the monitor in a drive: under the update, and under what the vehicle had before."""

    errors: Count
    before: Count


class BatchDrive(msgspec.Struct, frozen=True):
    """What is read of a drive's summary (`evidence.channels.summary.watched`)."""

    seconds: float
    cycles: int
    context: dict[str, str]
    release: str = ""
    judged: ErrorCounts | None = None


class IndicatorRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An indicator of a channel or pair over one minute of a drive."""

    minute: int
    subject: str
    indicator: Indicator
    n: int  # cycles in which it had a value
    violated: int
    mean: float
    least: float
    greatest: float


_HEADS = msgspec.json.Decoder(Head)
_DRIVES = msgspec.json.Decoder(BatchDrive)
_ROWS = msgspec.json.Decoder(IndicatorRow)


def hazards_of(content: bytes, limits: Limits) -> list[Found]:
    """Returns the records of an unpacked batch of hazards; Refused (413, 422) if any is not one."""
    first, newline, _ = content.partition(b"\n")
    if not newline or first != HEADER.encode() or not content.isascii():
        raise Refused(422, f"hazards must be ASCII text whose first line is {HEADER!r}")
    return list(_records(content, len(first) + 1, limits))


def _records(content: bytes, start: int, limits: Limits) -> Iterator[Found]:
    """Yields the records of a batch from byte `start`; refuses one without end, too long or too many."""
    number = 0
    while start < len(content):
        end = content.find(END, start)
        if end < 0:
            raise Refused(422, "the last record has no end")
        end += len(END)
        number += 1
        if number > limits.records:
            raise Refused(413, f"a batch may hold {limits.records} records")
        if end - start > limits.record:
            raise Refused(413, f"a record may have {limits.record} bytes, number {number} has more")
        yield _record(content[start:end], start, number)
        start = end


def _record(text: bytes, start: int, number: int) -> Found:
    """Returns the record in `text`, the batch's `number`th, at byte `start`; refuses a wrong head."""
    line = text[: text.find(b"\n")]
    if not line.startswith(b"H "):
        raise Refused(422, f"record {number} does not begin with a head")
    head = decode_sent(_HEADS.decode, line[2:], f"record {number} has an unreadable head")
    _check(head, number)
    x, y = _place(head, text)
    return Found(head, msgspec.json.encode(head).decode(), digest(text), start, len(text), x, y)


def _check(head: Head, number: int) -> None:
    """Refuses a head with numbers or words beyond the limits."""
    numbers = [head.t_start, head.t_end, head.t_worst, *head.extremes.values()]
    numbers += [v for o in head.objects for v in (o.x, o.y)]
    if not all(abs(v) <= NUMBER_MAX for v in numbers):
        raise Refused(422, f"record {number}: its numbers must lie within {NUMBER_MAX:g}")
    words = [head.id, *head.channels, *head.context, *head.context.values(), *head.extremes]
    most = max(len(head.context), len(head.extremes), len(head.channels), len(head.objects))
    if most > WORDS_MAX or not _are_words(words):
        raise Refused(422, f"record {number}: at most {WORDS_MAX} words of 200 characters each")


def _are_words(words: Iterable[str]) -> bool:
    """Returns True when each word has at most 200 characters and no NUL, so that a column keeps it."""
    return all(len(word) <= 200 and "\0" not in word for word in words)


def _place(head: Head, text: bytes) -> tuple[float, float]:
    """Returns x, y in m of the first object, or of the first ego in the record; (0, 0) if unreadable."""
    if head.objects:
        return head.objects[0].x, head.objects[0].y
    start = text.find(b"\nF ")
    fields = text[start + 3 : text.find(b"\n", start + 3)].split(b" ") if start >= 0 else []
    try:
        x, y = float(fields[2]) / 100.0, float(fields[3]) / 100.0  # cm
    except (ValueError, IndexError):
        return 0.0, 0.0
    return (x, y) if abs(x) <= NUMBER_MAX and abs(y) <= NUMBER_MAX else (0.0, 0.0)


def drive_of(content: bytes) -> BatchDrive:
    """Returns what is read of a drive's summary; Refused (422) when it is none or out of range."""
    drive = decode_sent(_DRIVES.decode, content, "the drive has an unreadable summary")
    if not 0.0 <= drive.seconds <= 1.0e6 or len(drive.context) > WORDS_MAX:
        raise Refused(422, f"a drive lasts 0 to 1e6 s, this one {drive.seconds:g}")
    if not _are_words((drive.release, *drive.context, *drive.context.values())):
        raise Refused(422, "a drive's words have at most 200 characters")
    return drive


def rows_of(content: bytes, limits: Limits) -> list[IndicatorRow]:
    """Returns the rows of a batch of indicators; Refused (413, 422) if one is wrong or they are too many."""
    rows = decode_sent(
        lambda text: [_ROWS.decode(line) for line in text.splitlines() if line],
        content,
        "a row of indicators cannot be read",
    )
    if len(rows) > 100 * limits.records:
        raise Refused(413, f"a batch may hold {100 * limits.records} rows of indicators")
    for row in rows:
        numbers = (row.mean, row.least, row.greatest)
        if not all(math.isfinite(v) for v in numbers) or not 0 <= row.minute < 10**7:
            raise Refused(422, "a row of indicators holds a number out of range")
        if not 0 <= row.violated <= row.n <= 10**5 or len(row.subject) > 200:
            raise Refused(422, "a row of indicators counts more than it saw")
    return rows


def weather_class(words: dict[str, str]) -> str:
    """Returns light and rain of a record's context in words, such as "low sun, dry"."""
    return f"{_light(words)}, {_wet(words)}"


def _light(words: dict[str, str]) -> str:
    """Returns night below 0 deg of the sun's altitude, low sun below 10, day, or "light unknown"."""
    sun = _number(words, "sun_altitude_deg")
    if sun is None:
        return "light unknown"
    return "night" if sun < 0.0 else "low sun" if sun < 10.0 else "day"


def _wet(words: dict[str, str]) -> str:
    """Returns dry at 0 % precipitation, rain below 60 %, heavy rain, or "rain unknown"."""
    rain = _number(words, "precipitation")
    if rain is None:
        return "rain unknown"
    return "dry" if rain <= 0.0 else "rain" if rain < 60.0 else "heavy rain"


def _number(words: dict[str, Any], name: str) -> float | None:
    """Returns the number under a name; None where it is absent, no number or not finite."""
    try:
        value = float(words[name])
    except (KeyError, ValueError):
        return None
    return value if math.isfinite(value) else None
