"""Seeded mutations of the values inside .npz and Parquet files; what is read stays well formed."""

from __future__ import annotations

import io
import random
from functools import cache

import numpy as np
import polars as pl

from skidpad.recording.files import SUM
from support.faults.mutation import NUMBERS, TEXTS, mutated
from support.faults.plain_mutation import mutated_json


def _other_array(rng: random.Random, array: np.ndarray) -> np.ndarray:
    what = rng.randrange(7)
    if what == 0:
        return array[: rng.randrange(len(array) + 1)] if array.ndim else array
    if what == 1:
        return np.concatenate([array, array]) if array.ndim else array
    if what == 2:
        kind = rng.choice(("f8", "i4", "u1", "i8", "U3", "f4", "c16", "?", "M8[s]"))
        with np.errstate(all="ignore"):
            return array.astype(kind) if array.dtype.kind in "fiub" else np.zeros(3, kind)
    if what == 3:
        return rng.choice((array.reshape(-1, 1), array.reshape(-1), array[None], np.zeros(())))
    array = np.array(array)
    if array.size and array.dtype.kind in "fiu":
        for _ in range(rng.choice((1, 1, array.size))):
            with np.errstate(all="ignore"):
                array.flat[rng.randrange(array.size)] = np.float64(rng.choice(NUMBERS)).astype(
                    array.dtype
                )
    return array


@cache
def stored_arrays(data: bytes) -> dict[str, np.ndarray]:
    """What an .npz file holds."""
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        return dict(stored)


def mutated_npz(rng: random.Random, data: bytes) -> bytes:
    """Arrays that are missing, of other shapes, types or values; names as text that is mutated."""
    arrays = dict(stored_arrays(data))
    for _ in range(rng.randint(1, 3)):
        name = rng.choice(sorted(arrays)) if arrays else ""
        if not name:
            break
        array = arrays[name]
        if rng.random() < 0.1:
            del arrays[name]
        elif array.dtype.kind == "U":
            text = mutated(rng, str(array).encode()).decode("utf-8", "ignore").replace("\x00", "")
            arrays[name] = np.array(text)
        else:
            try:
                arrays[name] = _other_array(rng, array)
            except (ValueError, TypeError):  # no such array can be made
                continue
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


@cache
def stored_table(data: bytes) -> tuple[pl.DataFrame, dict[str, str]]:
    """A Parquet file and what is said of it."""
    about = dict(pl.read_parquet_metadata(io.BytesIO(data)))
    said = {key: text for key, text in about.items() if key not in ("ARROW:schema", SUM)}
    return pl.read_parquet(io.BytesIO(data)), said


def mutated_parquet(rng: random.Random, data: bytes) -> bytes:
    """Columns that are missing, of other types or values; metadata that is mutated; fewer rows.

    It has no checksum, as files of the first versions: with one, nothing but the checksum is read.
    """
    table, about = stored_table(data)
    about = dict(about)
    for _ in range(rng.randint(1, 3)):
        what = rng.randrange(6)
        name = rng.choice(table.columns) if table.columns else ""
        if what == 0 and about:
            key = rng.choice(sorted(about))
            about[key] = _other_text(rng, about[key])
        elif what == 1 and name:
            table = table.drop(name)
        elif what == 2:
            table = table.head(rng.randrange(len(table) + 1))
        elif what == 3 and name:
            kind = rng.choice(
                (pl.Int64, pl.Float64, pl.String, pl.Boolean, pl.Int8, pl.List(pl.Int8))
            )
            table = table.with_columns(pl.lit(None).cast(kind).alias(name))
        elif name:
            with_values = _other_column(rng, table[name])
            table = table.with_columns(with_values.alias(name))
    out = io.BytesIO()
    table.write_parquet(out, metadata=about, compression="uncompressed", statistics=False)
    return out.getvalue()


def _other_text(rng: random.Random, text: str) -> str:
    try:
        how = rng.choice((mutated, mutated_json, mutated_json))
        return how(rng, text.encode()).decode("utf-8", "ignore")
    except (ValueError, RecursionError):  # no JSON, or none any more
        return mutated(rng, text.encode()).decode("utf-8", "ignore")


def _other_column(rng: random.Random, column: pl.Series) -> pl.Series:
    values = column.to_list()
    if values:
        i = rng.randrange(len(values))
        if column.dtype.is_float():
            values[i] = float(rng.choice(NUMBERS))
        elif column.dtype.is_integer():
            values[i] = rng.choice((0, 1, 3, 77, None))
        elif column.dtype == pl.String:
            values[i] = rng.choice(TEXTS)
        else:
            values[i] = None
    return pl.Series(values, dtype=column.dtype, strict=False)
