"""Files that appear whole or not at all, and the hash that says whether two of them are equal."""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np
import polars as pl

from skidpad.core.errors import FileError, OutputError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # disk, quota, limit on the size of a file


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it over `path`.

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
    """Write `content` to `path` atomically."""
    write_atomically(path, lambda temporary: _fill(temporary, content))


def _fill(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def write_parquet(path: Path, table: pl.DataFrame, metadata: dict[str, str] | None = None) -> None:
    """Write `table` as zstd Parquet, atomically, with `metadata` in its footer."""
    write_atomically(
        path, lambda part: table.write_parquet(part, compression="zstd", metadata=metadata or {})
    )


def read_parquet(path: Path) -> tuple[pl.DataFrame, dict[str, str]]:
    """The table at `path` and the metadata in its footer; FileError when it is not Parquet."""
    try:
        return pl.read_parquet(path), dict(pl.read_parquet_metadata(path))
    except FileNotFoundError as error:
        raise FileError(f"there is no file {path}") from error
    except (pl.exceptions.PolarsError, OSError) as error:
        raise FileError(f"{path} is not a readable Parquet file: {error}") from error


def output_error(path: Path, error: Exception) -> OutputError:
    """One sentence for a person; a full disk is named as such."""
    number = getattr(error, "errno", None)
    full = number in FULL or any(os.strerror(n) in str(error) for n in FULL)
    if full:
        return OutputError(f"the disk is full: {path} was not written, everything before it was")
    return OutputError(f"cannot write {path}: {getattr(error, 'strerror', None) or error}")


def content_hash(tables: Iterable[pl.DataFrame], text: bytes = b"") -> str:
    """SHA-256 over schemas, canonical column values and `text` (decision X-1).

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
    if isinstance(column.dtype, pl.Array):
        column = column.reshape((-1,)) if len(column) else column
        values = column.to_numpy()
    elif column.dtype == pl.String:
        lengths = column.str.len_bytes().fill_null(2**32 - 1).to_numpy()
        digest.update(np.ascontiguousarray(lengths, dtype=np.uint32).data)
        digest.update("".join(column.drop_nulls()).encode())
        return
    else:
        absent = column.is_null()
        if column.dtype.is_float():
            absent = absent | column.is_nan().fill_null(value=True)
        digest.update(np.packbits(absent.to_numpy()).data)
        filler = 0.0 if column.dtype.is_float() else 0
        if column.dtype == pl.Boolean:
            column = column.cast(pl.UInt8)
        values = column.fill_null(filler).to_numpy()
    if values.dtype.kind == "f":
        values = np.where(np.isnan(values), values.dtype.type(0.0), values) + values.dtype.type(0.0)
    digest.update(np.ascontiguousarray(values).data)
