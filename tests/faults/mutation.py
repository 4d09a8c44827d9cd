"""Seeded mutations of files: bytes of any kind, and the values inside XML, .npz, Parquet and MCAP."""

from __future__ import annotations

import io
import random
import re

import numpy as np
import polars as pl
from lxml import etree

WORDS = (
    b"", b"nan", b"inf", b"-inf", b"-1", b"0", b"-0.0", b"1e308", b"1e999", b"1e-320", b"3.5",
    b"2147483648", b"9" * 30, b"9" * 5000, b"\xc2\xb2", b"\xd9\xa3", b"null", b"true", b"[]", b"{}",
    b"[1, 2]", b"\x00", b"\xff\xfe", b"../../x", b"x" * 5000, b"\xed\xa0\x80", b"!!binary", b"*a", b"&a",
    b"'", b'"', b"2001-99-99", b"$x", b"${1/0}", b"$" + b"-" * 3000 + b"1", b"completed",
)  # fmt: skip
TEXTS = tuple(word.decode("utf-8", "ignore").replace("\x00", "") for word in WORDS)
TOKEN = re.compile(rb"[-+]?\d[\w.+-]*|\w+")
NUMBERS = (
    0.0, -1.0, 1.0, 0.5, np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 1e9, -1e9, 1e18, 7.0,
)  # fmt: skip


def mutated(rng: random.Random, data: bytes) -> bytes:
    """One to three mutations of bytes, by what the content looks like or blindly."""
    for _ in range(rng.randint(1, 3)):
        data = rng.choice(OPERATIONS)(rng, data)
    return data


def _flip(rng: random.Random, data: bytes) -> bytes:
    if not data:
        return b"\x00"
    i = rng.randrange(len(data))
    return data[:i] + bytes([data[i] ^ rng.randrange(1, 256)]) + data[i + 1 :]


def _span(rng: random.Random, data: bytes) -> tuple[int, int]:
    i = rng.randrange(len(data) + 1)
    return i, min(len(data), i + rng.choice((1, 4, 30, 1000)))


def _cut(rng: random.Random, data: bytes) -> bytes:
    i, j = _span(rng, data)
    return data[:i] + data[j:]


def _twice(rng: random.Random, data: bytes) -> bytes:
    i, j = _span(rng, data)
    return data[:j] + data[i:j] * rng.choice((1, 1, 50)) + data[j:]


def _shorten(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _insert(rng: random.Random, data: bytes) -> bytes:
    i = rng.randrange(len(data) + 1)
    return data[:i] + rng.choice(WORDS) + data[i:]


def _replace(rng: random.Random, data: bytes) -> bytes:
    found = list(TOKEN.finditer(data[:200_000]))
    if not found:
        return _flip(rng, data)
    token = rng.choice(found)
    other = rng.choice(found)[0] if rng.random() < 0.3 else rng.choice(WORDS)
    return data[: token.start()] + other + data[token.end() :]


def _nest(rng: random.Random, data: bytes) -> bytes:
    i = rng.randrange(len(data) + 1)
    left, right = rng.choice(((b"[", b"]"), (b'{"a":', b"}"), (b"(", b")"), (b"- ", b"")))
    n = rng.choice((3, 100, 3000))
    return data[:i] + left * n + right * n + data[i:]


OPERATIONS = (_flip, _flip, _cut, _twice, _shorten, _insert, _replace, _replace, _replace, _nest)


def mutated_xml(rng: random.Random, data: bytes) -> bytes:
    """Elements removed, repeated or moved, and attributes with other values."""
    root = etree.fromstring(data)
    for _ in range(rng.randint(1, 3)):
        nodes = [n for n in root.iter() if isinstance(n.tag, str)]
        node, what = rng.choice(nodes), rng.randrange(6)
        if what == 0 and node.getparent() is not None:
            node.getparent().remove(node)
        elif what == 1 and node.getparent() is not None:
            node.getparent().append(etree.fromstring(etree.tostring(node)))
        elif what == 2 and len(node):
            node.append(etree.fromstring(etree.tostring(rng.choice(nodes[1:] or nodes))))
        elif node.attrib:
            name = rng.choice(sorted(node.attrib))
            if what == 3:
                del node.attrib[name]
            else:
                other = rng.choice(nodes)
                texts = [*TEXTS, *map(str, other.attrib.values())]
                node.set(name, "".join(c for c in rng.choice(texts) if c >= " "))
    return etree.tostring(root)


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


def mutated_npz(rng: random.Random, data: bytes) -> bytes:
    """Arrays that are missing, of other shapes, types or values; names as text that is mutated."""
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        arrays = dict(stored)
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


def mutated_parquet(rng: random.Random, data: bytes) -> bytes:
    """Columns that are missing, of other types or values; metadata that is mutated; fewer rows."""
    table = pl.read_parquet(io.BytesIO(data))
    about = dict(pl.read_parquet_metadata(io.BytesIO(data)))
    about.pop("ARROW:schema", None)
    for _ in range(rng.randint(1, 3)):
        what = rng.randrange(6)
        name = rng.choice(table.columns) if table.columns else ""
        if what == 0 and about:
            key = rng.choice(sorted(about))
            about[key] = mutated(rng, about[key].encode()).decode("utf-8", "ignore")
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
    table.write_parquet(out, metadata=about)
    return out.getvalue()


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
