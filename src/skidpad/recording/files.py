"""Files that appear whole or not at all, and the hash that says whether two of them are equal."""

from __future__ import annotations

import csv
import errno
import hashlib
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from io import BytesIO, StringIO
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import polars as pl

from skidpad.core.errors import FileError, OutputError
from skidpad.core.files.reading import (
    TEXT_MAX,
    UNUSABLE,
    decode_json,
    is_file,
    read_bytes,
    unusable,
)

T = TypeVar("T")

SUM, NO_SUM = "skidpad.sum", "0" * 64  # of a file's bytes, with zeros in place of itself
PARQUET_MAX = 4 * 1024**3  # bytes of a file
VALUES_MAX = 1_000_000_000  # of a Parquet file
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # disk, quota, limit on the size of a file


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Lets `write` fill a temporary file beside `path`, then renames it over `path`.

    A reader sees the old file or the new one, never a part. OutputError when the disk is full or
    the folder cannot be written; what was there before is untouched.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        with open(temporary, "rb") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise output_error(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_bytes(path: Path, content: bytes) -> None:
    """Writes `content` to `path` atomically; makes its folder."""
    write_atomically(path, lambda temporary: temporary.write_bytes(content))


def write_json(path: Path, value: Any, indent: int = 2) -> None:
    """Writes a value as JSON for people, atomically."""
    write_bytes(path, msgspec.json.format(msgspec.json.encode(value), indent=indent))


def read_json(path: Path, kind: type[T], limit: int = TEXT_MAX) -> T | None:
    """Returns the value of a JSON file; None where there is no file, FileError where it is damaged."""
    if not path.is_file():
        return None
    found: T = decode_json(read_bytes(path, "file", limit), str(path), kind)
    return found


def require_free(folder: Path) -> Path:
    """Returns `folder` if nothing is in it yet; OutputError where something is, or a file."""
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise OutputError(f"{folder} exists already and is not empty; choose another --out")
    return folder


def next_free(folder: Path) -> Path:
    """Returns `folder`, or the first of folder-2, folder-3, ... where nothing is yet."""
    names = (folder if n == 1 else folder.with_name(f"{folder.name}-{n}") for n in count(1))
    return next(path for path in names if not path.exists())


def write_secret(path: Path, content: bytes) -> None:
    """Writes a file as `write_bytes` does, and at no moment may another user read it."""
    write_atomically(path, lambda temporary: _fill_secret(temporary, content))


def _fill_secret(path: Path, content: bytes) -> None:
    """Writes the bytes to a new file that its owner alone may read."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)


def write_parquet(path: Path, table: pl.DataFrame, metadata: dict[str, str] | None = None) -> None:
    """Writes `table` as zstd Parquet, atomically, with `metadata` in its footer."""
    buffer = BytesIO()  # polars takes no path that is not UTF-8
    table.write_parquet(buffer, compression="zstd", metadata=(metadata or {}) | {SUM: NO_SUM})
    content = buffer.getvalue()
    at = content.rindex(NO_SUM.encode())
    digest = hashlib.sha256(content).hexdigest().encode()
    write_bytes(path, content[:at] + digest + content[at + len(digest) :])


def _require_sum(content: bytes, path: Path) -> None:
    """Raises FileError for a table of ours that is not what was written.

    Polars can end the whole process over a damaged page, so damage is found before it reads. Files
    of versions before this one have no checksum and are read as they are.
    """
    found = content.rfind(SUM.encode())
    if found < 0:
        return
    at = found + len(SUM) + 2  # Thrift's compact protocol: a byte for the type, one for the length
    plain = content[:at] + NO_SUM.encode() + content[at + len(NO_SUM) :]
    if hashlib.sha256(plain).hexdigest().encode() != content[at : at + len(NO_SUM)]:
        raise FileError(f"{path} is not a readable Parquet file: its checksum is another")


def write_csv(path: Path, table: pl.DataFrame) -> None:
    """Writes `table` as CSV, atomically."""
    write_bytes(path, table.write_csv().encode())


def csv_text(columns: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Returns rows as CSV below the names of their columns; lines end in a line feed."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue()


def read_rows(file: Path, make: Callable[[dict[str, str]], T]) -> list[T]:
    """Returns what `make` makes of each row of a CSV file that `csv_text` wrote; nothing where there is none.

    FileError where the file or a row is not as this version writes it.
    """
    if not file.is_file():
        return []
    try:
        with file.open(encoding="utf-8", newline="") as lines:
            return [make(row) for row in csv.DictReader(lines)]
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise FileError(f"{file}: not as this version writes it: {error}") from None


def read_parquet(path: Path) -> tuple[pl.DataFrame, dict[str, str]]:
    """Returns the table at `path` and the metadata in its footer.

    FileError when it is missing, damaged, too large or no Parquet.
    """
    if not is_file(path):
        raise FileError(f"there is no file {path}")
    content = read_bytes(path, "table", PARQUET_MAX)
    _require_sum(content, path)
    try:
        rows = pl.scan_parquet(BytesIO(content)).select(pl.len()).collect().item()
        if rows * max(len(pl.read_parquet_schema(BytesIO(content))), 1) > VALUES_MAX:
            raise FileError(f"{path} holds more than {VALUES_MAX} values")
        about = dict(pl.read_parquet_metadata(BytesIO(content)))
        return pl.read_parquet(BytesIO(content)), about
    except FileError:
        raise
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, *UNUSABLE) as error:
        raise unusable(str(path), "a readable Parquet file", error) from error


def require_columns(table: pl.DataFrame, wanted: Mapping[str, Any], path: Path) -> pl.DataFrame:
    """Returns the table with these columns in these types; FileError where one is missing or another."""
    for name, kind in wanted.items():
        if name not in table.columns:
            raise FileError(f"{path} has no column {name!r}: it is another kind of table")
        if table.schema[name] not in (kind, pl.Null):
            raise FileError(f"{path}: column {name!r} holds {table.schema[name]}, not {kind}")
    return table.with_columns(pl.col(name).cast(kind) for name, kind in wanted.items())


def output_error(path: Path, error: Exception) -> OutputError:
    """Returns the OutputError for a failure to write, one sentence; a full disk is named as such."""
    number = getattr(error, "errno", None)
    full = number in FULL or any(os.strerror(n) in str(error) for n in FULL)
    if full:
        return OutputError(f"the disk is full: {path} was not written, everything before it was")
    return OutputError(f"cannot write {path}: {getattr(error, 'strerror', None) or error}")


def content_hash(tables: Iterable[pl.DataFrame], text: bytes = b"") -> str:
    """Returns SHA-256 over schemas, canonical column values and `text` (decision X-1).

    Absent values are equal however they are stored: a null and a NaN hash alike, and so do -0.0
    and 0.0. The caller leaves out columns of wall clock, host, process and path, and sorts rows.
    """
    digest = hashlib.sha256(text)
    for table in tables:
        digest.update(f"{len(table)} rows;".encode())
        for name in table.columns:
            column = table[name]
            digest.update(f"{name}:{column.dtype};".encode())
            _update(digest, column)
    return digest.hexdigest()


def _update(digest: hashlib._Hash, column: pl.Series) -> None:
    """Adds a column's values and gaps to the digest, so that nan and null count alike in floats."""
    if isinstance(column.dtype, pl.Array):
        column = column.reshape((-1,)) if len(column) else column
        values = column.to_numpy()
    elif column.dtype == pl.String:
        lengths = column.str.len_bytes().fill_null(2**32 - 1).to_numpy()
        digest.update(np.ascontiguousarray(lengths, dtype=np.uint32).data)
        digest.update("".join(column.drop_nulls()).encode())
        return
    elif column.dtype.is_float():
        values = column.to_numpy()  # a null is a NaN here
        digest.update(np.packbits(np.isnan(values)).data)
    else:
        gaps = column.null_count() > 0 or column.dtype == pl.Null
        absent = column.is_null().to_numpy() if gaps else np.zeros(len(column), np.bool_)
        digest.update(np.packbits(absent).data)
        if column.dtype == pl.Boolean:
            column = column.cast(pl.UInt8)
        values = (column.fill_null(0) if gaps else column).to_numpy()
    if values.dtype.kind == "f":
        values = np.where(np.isnan(values), values.dtype.type(0.0), values) + values.dtype.type(0.0)
    digest.update(np.ascontiguousarray(values).data)
