"""A run's log on disk: ticks.parquet (one row per tick) and events.jsonl, and its content hash."""

from __future__ import annotations

from enum import IntEnum
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.core.errors import FileError
from skidpad.core.files.reading import UNUSABLE, decode_json, read_bytes, unusable
from skidpad.core.states import ActorTable, ContactEvent
from skidpad.core.vocabulary import DetectionStatus, LightSource, LightState, Supervision, Tier
from skidpad.recording.files import content_hash, read_parquet, write_bytes, write_parquet
from skidpad.recording.fingerprint import fingerprint
from skidpad.recording.run.events import Event, decode_events, encode_events
from skidpad.recording.run.log import (
    ActorSeries,
    CommandSeries,
    EgoSeries,
    LogHeader,
    ReportSeries,
    RunLog,
)

TICKS, EVENTS = "ticks.parquet", "events.jsonl"
SCHEMA_VERSION = "1"
EVENTS_MAX = 1024**3  # bytes
KEY, PLACE = "skidpad", "fingerprint"
BOOLEANS = {
    "applied_handbrake",
    "applied_reverse",
    "requested_handbrake",
    "requested_reverse",
    "stack_detected",
    "stack_light_stop",
}
INTEGERS = {
    "ego_gear",
    "stack_status",
    "stack_tier",
    "stack_radar_points",
    "stack_light_state",
    "stack_light_source",
    "stack_hsv",
}
GROUPS = (
    ("ego_", EgoSeries._fields),
    ("applied_", CommandSeries._fields),
    ("requested_", CommandSeries._fields),
    ("stack_", ReportSeries._fields),
)
S = TypeVar("S", EgoSeries, CommandSeries, ReportSeries)


def tick_table(log: RunLog) -> pl.DataFrame:
    """Returns one row per tick: scalars typed and null where absent, actors as arrays of n numbers."""
    columns: dict[str, Any] = {
        "tick": log.tick,
        "supervision": log.supervision.astype(np.uint8),
        "weather": log.weather.astype(np.uint8),
    }
    groups = (log.ego, log.applied, log.requested, log.report)
    for (prefix, names), series in zip(GROUPS, groups, strict=True):
        for field, values in zip(names, series, strict=True):
            columns[prefix + field] = _make_series(prefix + field, values)
    columns.update(zip(ActorSeries._fields, log.actors, strict=True))
    columns["present"] = log.present.astype(np.uint8)
    columns["mu"] = log.mu.reshape(len(log), 4 * len(log.table))
    return pl.DataFrame(columns)


def _make_series(name: str, values: NDArray[np.float64]) -> pl.Series:
    """Returns a column of a tick table with the type that its name has, nan as null."""
    column = pl.Series(name, np.ascontiguousarray(values), nan_to_null=True)
    return pl.Series(name, column.cast(_kind(name)))


def _kind(name: str) -> type[pl.Boolean | pl.Int32 | pl.Float64]:
    """Returns the type of a tick table's column of this name."""
    return pl.Boolean if name in BOOLEANS else pl.Int32 if name in INTEGERS else pl.Float64


def log_hash(log: RunLog) -> str:
    """Returns the content hash of a drive (decision X-1): equal for equal drives, wherever driven.

    Labels (`about`, weather slugs) are left out, so that cells which weather cannot touch are
    recognised by equal hashes (decision M-1).
    """
    return _hash(log, tick_table(log))


def _hash(log: RunLog, table: pl.DataFrame) -> str:
    """Returns the content hash of a log: its ticks, drive and events."""
    head = _describe_log(log)
    header = head.pop("header")
    drive = {**head, "weathers": len(log.weathers), "map": header.map_hash, "dt": header.dt}
    text = msgspec.json.encode(drive, order="deterministic")
    return content_hash([table], text + encode_events(log.events))


def write_log(folder: Path, log: RunLog) -> str:
    """Writes ticks.parquet and events.jsonl into `folder`, each atomically; returns the hash."""
    head = msgspec.json.encode(_describe_log(log), order="deterministic")
    table = tick_table(log)
    write_bytes(folder / EVENTS, encode_events(log.events))
    write_parquet(folder / TICKS, table, {KEY: head.decode(), PLACE: fingerprint().short})
    return _hash(log, table)


def driven_on(folder: Path) -> str | None:
    """Returns the fingerprint of the process that wrote the log in `folder`; None: it is not known."""
    return read_parquet(folder / TICKS)[1].get(PLACE)


class _Actors(msgspec.Struct, frozen=True):
    """The table of actors in the head of a log."""

    names: tuple[str, ...]
    types: tuple[str, ...]
    kind: list[int]
    length: list[float]
    width: list[float]
    height: list[float]
    rgb: list[tuple[int, int, int]]


class _Kept(msgspec.Struct, frozen=True):
    """The head of a log."""

    schema: str
    header: LogHeader
    weathers: tuple[str, ...]
    actors: _Actors


def read_log(folder: Path) -> RunLog:
    """Returns the log in `folder`; FileError names what is missing or not a log."""
    table, metadata = read_parquet(folder / TICKS)
    where = str(folder / TICKS)
    if KEY not in metadata:
        raise FileError(f"{where} is a Parquet file, but not a tick log")
    plain = decode_json(metadata[KEY], f"the head of {where}", dict[str, Any])
    if plain.get("schema") != SCHEMA_VERSION:
        raise FileError(
            f"{where} has schema {plain.get('schema')!r:.50}, this version reads {SCHEMA_VERSION}"
        )
    text = read_bytes(folder / EVENTS, "events", EVENTS_MAX)
    events = decode_events(text, str(folder / EVENTS))
    try:
        log = _log(table, msgspec.convert(plain, _Kept), events)
        require_sound(log)
    except (*UNUSABLE, pl.exceptions.PolarsError) as error:
        raise unusable(where, "a tick log", error) from None
    return log


def _log(table: pl.DataFrame, head: _Kept, events: tuple[Event, ...]) -> RunLog:
    """Returns the log of a tick table, its head and its events; raises ValueError if wrong."""
    actors = _table_from(head.actors)
    n = len(actors)
    return RunLog(
        header=head.header,
        table=actors,
        tick=_whole(table, "tick", pl.Int64),
        actors=ActorSeries(*(_matrix(table, f, n, pl.Float32) for f in ActorSeries._fields)),
        present=_matrix(table, "present", n, pl.UInt8).astype(np.bool_),
        mu=_matrix(table, "mu", 4 * n, pl.Float32).reshape(-1, n, 4),
        ego=_series(table, "ego_", EgoSeries),
        applied=_series(table, "applied_", CommandSeries),
        requested=_series(table, "requested_", CommandSeries),
        report=_series(table, "stack_", ReportSeries),
        supervision=_whole(table, "supervision"),
        weather=_whole(table, "weather"),
        weathers=head.weathers,
        events=events,
    )


def _whole(
    table: pl.DataFrame, name: str, kind: type[pl.Int64 | pl.UInt8] = pl.UInt8
) -> NDArray[np.int64]:
    """Returns (n,) a column of whole numbers; raises ValueError for another type or gaps."""
    if table.schema.get(name) != kind or table[name].null_count():
        raise ValueError(f"column {name} must hold whole numbers ({kind}) and none absent")
    values: NDArray[np.int64] = table[name].cast(pl.Int64).to_numpy()
    return values


def _matrix(
    table: pl.DataFrame, name: str, width: int, kind: type[pl.Float32 | pl.UInt8]
) -> NDArray[Any]:
    """Returns (n, width) a column of arrays; raises ValueError for another type."""
    if table.schema.get(name) != pl.Array(kind, width):
        raise ValueError(f"column {name} must hold {width} numbers ({kind}) per tick")
    values: NDArray[Any] = table[name].to_numpy()
    return values


def _series(table: pl.DataFrame, prefix: str, kind: type[S]) -> S:
    """Returns the columns with the prefix as a series, nulls as nan; raises ValueError if wrong."""
    names = [prefix + name for name in kind._fields]
    for name in names:
        if (found := table.schema.get(name)) != _kind(name):
            raise ValueError(f"column {name} must hold {_kind(name)}, not {found}")
    numbers = table.select(pl.col(names).cast(pl.Float64).fill_null(float("nan")))
    return kind(*(numbers[name].to_numpy() for name in names))


def _describe_log(log: RunLog) -> dict[str, Any]:
    """Returns the head of a log as plain data: schema, header, weathers and actors."""
    columns = {name: getattr(log.table, name) for name in _Actors.__struct_fields__}
    return {
        "schema": SCHEMA_VERSION,
        "header": log.header,
        "weathers": log.weathers,
        "actors": {
            name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in columns.items()
        },
    }


def _table_from(head: _Actors) -> ActorTable:
    """Returns the table of actors of a head; raises ValueError for columns of unlike length."""
    if len({len(getattr(head, name)) for name in head.__struct_fields__}) != 1:
        raise ValueError("the columns of actors differ in length")
    return ActorTable(
        names=head.names,
        types=head.types,
        kind=np.array(head.kind, dtype=np.uint8),
        length=np.array(head.length, dtype=np.float64),
        width=np.array(head.width, dtype=np.float64),
        height=np.array(head.height, dtype=np.float64),
        rgb=np.array(head.rgb, dtype=np.uint8).reshape(-1, 3),
    )


# --- what a stored log must be before it is computed with: parts that fit, numbers that are some
WORDS: dict[str, type[IntEnum]] = {  # fields of the stack's report that are numbers of words
    "status": DetectionStatus,
    "tier": Tier,
    "light_state": LightState,
    "light_source": LightSource,
    "hsv": LightState,
}


def require_sound(log: RunLog) -> None:
    """Raises ValueError that says what of a log cannot be."""
    _require_indices(log)
    _require_numbers(log)
    _require_words(log)


def _require_indices(log: RunLog) -> None:
    """Raises ValueError unless ticks rise and all indices point to something."""
    n = len(log.table)
    if (np.diff(log.tick) <= 0).any() or (log.tick < 0).any():
        raise ValueError("ticks must rise")
    if len(log) and (int(log.weather.min()) < 0 or int(log.weather.max()) >= len(log.weathers)):
        raise ValueError("weather is none of its weathers")
    if not set(log.supervision.tolist()) <= set(Supervision):
        raise ValueError("supervision is no phase")
    if not n or not 0.0 < log.header.dt < 10.0:
        raise ValueError("there must be an ego and a time step")
    if any(not -1 <= e.actor < n for e in log.events if isinstance(e, ContactEvent)):
        raise ValueError("a contact with an actor that is not there")


def _require_numbers(log: RunLog) -> None:
    """Raises ValueError unless the ego and all present actors have finite places."""
    here = log.present.copy()
    here[:, 0] = True
    if not all(np.isfinite(values[here]).all() for values in log.actors):
        raise ValueError("whoever is present needs a place and a motion in numbers")
    if not all(np.isfinite(values).all() for values in log.ego):
        raise ValueError("what the ego says of itself must be numbers")


def _require_words(log: RunLog) -> None:
    """Raises ValueError for a number of the stack's report that stands for no word."""
    for name, words in WORDS.items():
        values = getattr(log.report, name)
        if not np.isin(values[~np.isnan(values)], list(words)).all():
            raise ValueError(f"{name} of the stack is none of its words")
