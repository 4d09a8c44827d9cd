"""Arrays as plain data: type, shape and order in memory, and the numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.lib.format import descr_to_dtype, dtype_to_descr

from skidpad.core.errors import CheckpointError

Plain = Any  # what msgpack holds: None, numbers, texts, bytes, lists of them


def describe_array(array: np.ndarray) -> list[Plain]:
    """Returns an array's type, shape, and how it lies in memory: kernels know types of arrays by it."""
    order = "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"
    if array.dtype.hasobject:
        raise CheckpointError("an array of objects cannot be written, as it is no data")
    return [dtype_to_descr(array.dtype), list(array.shape), order]


def make_array(descr: Plain, shape: list[int], order: Any) -> np.ndarray:
    """Returns an array of zeros."""
    return np.zeros(tuple(shape), find_dtype(descr), order)


def pack_numbers(array: np.ndarray) -> bytes:
    """Returns the numbers of an array."""
    if array.dtype.hasobject:
        raise CheckpointError("an array of objects cannot be written, as it is no data")
    return array.tobytes()


def put_numbers(array: np.ndarray, data: bytes) -> None:
    """Puts numbers into an array."""
    array[...] = np.frombuffer(data, array.dtype).reshape(array.shape)


def find_dtype(descr: Plain) -> np.dtype[Any]:
    """Returns the type of an array's items."""
    if isinstance(descr, str):
        return np.dtype(descr)
    return descr_to_dtype(
        [(name, _descr(kind), *map(tuple, shape)) for name, kind, *shape in descr]
    )


def _descr(kind: Plain) -> Any:
    """Returns a field's type with tuples where msgpack has lists."""
    return kind if isinstance(kind, str) else [(n, _descr(k), *map(tuple, s)) for n, k, *s in kind]
