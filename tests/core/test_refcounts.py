"""Kernels that allocate nothing count no references; all others do, and nobody loses an array."""

from __future__ import annotations

import gc
import sys
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import Held, hold, inner_kernel, kernel
from skidpad.core.kernels.refcounts import (
    allocates,
    without_counting,
)
from support.refcounts import counts_references

Floats = NDArray[np.float64]


class Pair(NamedTuple):
    one: Floats
    table: Floats


@inner_kernel
def swap(pair: Pair) -> Pair:
    """Returns references, so it counts where it stands alone."""
    return Pair(pair.table[0], pair.table)


@inner_kernel
def pick_row(pair: Pair, k: int) -> float:
    row = pair.table[k]
    return row[0] + swap(pair).one[0]


@kernel
def add_rows(held: Held[Pair]) -> float:
    """Lean, although what it calls returns arrays."""
    total = 0.0
    for k in range(len(held.value.table)):
        total += pick_row(held.value, k) + swap(held.value).one[1]
    return total


@kernel
def first_row(held: Held[Pair]) -> Floats:
    """Returns a view."""
    return swap(held.value).one


@kernel
def double(held: Held[Pair]) -> float:
    """Allocates."""
    twice = swap(held.value).one * 2.0
    return float(twice[0]) + pick_row(held.value, 0)


def pair() -> Pair:
    return Pair(np.ones(3), np.arange(12.0).reshape(4, 3))


def test_a_kernel_that_allocates_nothing_and_returns_no_array_counts_nothing() -> None:
    held = hold(pair())
    assert add_rows(held) == 18.0 + 4 * 0.0 + 4 * 1.0
    assert not counts_references(add_rows)


def test_kernels_that_return_an_array_or_allocate_one_count() -> None:
    held = hold(pair())
    assert first_row(held).tolist() == [0.0, 1.0, 2.0]
    assert double(held) == 0.0
    assert counts_references(first_row)
    assert counts_references(double)


def test_no_array_is_lost_or_kept_however_kernels_are_mixed() -> None:
    """A hundred thousand calls leave every count as it was, and a view outlives what it was cut from."""
    arrays = pair()
    held = hold(arrays)
    for compiled in (add_rows, first_row, double):
        compiled(held)
    gc.collect()
    before = [sys.getrefcount(a) for a in arrays]
    for _ in range(100_000 // 3):
        add_rows(held)
        first_row(held)
        double(held)
    assert [sys.getrefcount(a) for a in arrays] == before
    row = first_row(held)
    del held, arrays
    gc.collect()
    assert row.tolist() == [0.0, 1.0, 2.0]


MODULE = """
define i32 @kernel({ i8* } %p) {
  call void @NRT_incref(i8* %a)
  tail call void @NRT_decref(i8* %a)
  ret i32 0
}

define linkonce_odr i32 @callee(i8* %a) {
  call void @NRT_decref(i8* %a)
  ret i32 0
}

define i8* @_ZN7cpython6kernel(i8* %a) {
  call void @NRT_incref(i8* %a)
  %b = call i8* @NRT_adapt_ndarray_from_python(i8* %a)
  ret i8* %b
}
"""


def test_callees_become_private_and_wrappers_stay_as_they_are() -> None:
    """A callee that does not count must not be found by a module whose kernels do."""
    text = without_counting(MODULE)
    assert "define internal i32 @callee" in text
    assert text.count("NRT_") == 2
    assert not allocates(MODULE)
    assert allocates(MODULE.replace("call void @NRT_incref", "call i8* @NRT_MemInfo_alloc", 1))
