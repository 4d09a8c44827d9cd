"""A graphics card: whether there is one, and what many values of one kind take of its memory.

Each array of a value is shared by all values, or state, room to work, or rows of a log. State goes to the
card and comes back, rows come back, and room to work stays there.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from math import prod
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import cuda
from numba.core import types
from numba.core.errors import NumbaPerformanceWarning
from numba.extending import intrinsic
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from skidpad.core.arrays import Flags
from skidpad.core.errors import ConfigError
from skidpad.core.kernels.batch import (
    COLUMNS,
    EACH,
    FLOATS,
    INTS,
    NUMBERS,
    OFFSET,
    SHAPE,
    STRIDES,
    Leaves,
)
from skidpad.core.kernels.jit import kernel

warnings.filterwarnings("ignore", "Grid size", NumbaPerformanceWarning)  # of copies of a few values
SIMULATED = bool(numba.config.ENABLE_CUDASIM)
THREADS = 1 if SIMULATED else 128  # of a block
BLOCKS = 1 if SIMULATED else 4096  # at most, of a copy


class Use(IntEnum):
    """What an array is on the card."""

    SHARED = 0
    STATE = 1
    WORK = 2
    ROWS = 3


def require_card() -> None:
    """Raises ConfigError where there is no card that numba can drive."""
    if not SIMULATED and (cuda.implementation != "NVIDIA" or not cuda.is_available()):
        raise ConfigError(
            "device='cuda' needs an NVIDIA card and its driver, and the packages of "
            "`pip install 'skidpad[gpu]'`: numba finds none here; drive with device='cpu'"
        )


def view_simulated(data: Any, shape: tuple[int, ...], strides: tuple[int, ...]) -> NDArray[Any]:
    """Returns what `reshape_unchecked` does, for arrays of numba's simulator."""
    return as_strided(data._item._ary, shape, strides)


def find_view() -> Any:
    """Returns the function by which kernels on the card see an array with other lengths and strides."""
    if SIMULATED:
        return view_simulated
    from numba.cuda.np.arrayobj import reshape_unchecked

    return reshape_unchecked


class Part(NamedTuple):
    """Where an array is on the card."""

    store: int
    use: Use
    at: int  # element of its region in a value, or of the store where it is shared
    size: int
    shape: tuple[int, ...]


@intrinsic  # type: ignore[untyped-decorator]
def point_at(typing: Any, address: Any) -> Any:
    """Gives the pointer that an address is."""
    del typing, address

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.uint8)(types.int64), generate  # type: ignore[attr-defined]


@kernel
def move_bytes(moves: NDArray[np.int64], bases: NDArray[np.int64], down: bool) -> None:
    """Copies arrays of a value from what the card takes or gives, or to there.

    moves: (n, 4) address, bytes, row of `bases`, bytes from there. down: from the card.
    """
    for k in range(len(moves)):
        own = numba.carray(point_at(moves[k, 0]), moves[k, 1], np.uint8)
        other = numba.carray(point_at(bases[moves[k, 2]] + moves[k, 3]), moves[k, 1], np.uint8)
        if down:
            own[:] = other
        else:
            other[:] = own


@cuda.jit  # type: ignore[untyped-decorator]
def copy_region(
    store: Any, kept: Any, worlds: Any, base: int, element: int, each: int, words: int, up: bool
) -> None:
    """Copies a region of a store, for some values, to `kept` (values, words) or from there.

    base, element, each: in elements, of the region, from one element to the next and from value to value.
    words: of an element.
    """
    total, columns = kept.size, kept.shape[1]
    for i in range(cuda.grid(1), total, cuda.gridsize(1)):
        j, e = i // columns, i % columns
        at = base + worlds[j] * each + (e // words) * element
        if up:
            store[at * words + e % words] = kept[j, e]
        else:
            kept[j, e] = store[at * words + e % words]


class Region(NamedTuple):
    """State or rows of all values in one store."""

    store: int
    base: int
    size: int  # elements of a value


class Stores:
    """The memory of many values on the card, whose arrays have the same types and lengths.

    leaves: of each value. logs: path of an array that is rows of a log, and its axis of rows; the card has
    `rows` of them. work: paths of arrays that hold nothing from one launch to the next.
    """

    def __init__(
        self,
        leaves: Sequence[Leaves],
        dtypes: Sequence[np.dtype[Any]],
        logs: Mapping[str, int],
        rows: int,
        work: frozenset[str],
        interleaved: bool,
    ) -> None:
        self.dtypes, self.count, self.logs, self.rows = dtypes, len(leaves), logs, rows
        first = leaves[0]
        shared = _find_shared(leaves)
        order = {dtype: k for k, dtype in enumerate(dtypes)}
        arrays: list[tuple[np.dtype[Any], tuple[int, ...], Use]] = [
            (FLOATS, (len(first.numbers),), Use.STATE),
            (INTS, (len(first.numbers),), Use.STATE),
        ]
        for k, (path, array) in enumerate(zip(first.paths, first.arrays, strict=True)):
            shape, use = array.shape, Use.SHARED if shared[k] else Use.STATE
            if path in logs:
                axis, use = logs[path], Use.ROWS
                shape = (*shape[:axis], rows, *shape[axis + 1 :])
            elif path in work:
                use = Use.WORK
            arrays.append((array.dtype, shape, use))
        sizes = np.zeros((len(dtypes), len(Use)), np.int64)
        self.parts: list[Part] = []
        for dtype, shape, use in arrays:
            store, size = order[dtype], prod(shape)
            self.parts.append(Part(store, use, int(sizes[store, use]), size, shape))
            sizes[store, use] += size
        self.sizes = sizes
        self._interleaved = interleaved
        self._shared = self._places(first)
        self.table = cuda.to_device(self._make_table())
        self.data = [self._make_store(k, first) for k in range(len(dtypes))]
        self.bytes = sum(d.nbytes for d in self.data)
        self.state = self._regions(Use.STATE)
        self.log = self._regions(Use.ROWS)

    def _places(self, leaves: Leaves) -> list[int]:
        """Returns where the arrays are that all values share."""
        own = zip(self.parts[NUMBERS:], leaves.arrays, strict=True)
        return [array.ctypes.data for part, array in own if part.use is Use.SHARED]

    def has_shared(self, leaves: Leaves) -> bool:
        """Tells whether a value, whose arrays may be others by now, still shares what all share."""
        return self._places(leaves) == self._shared

    def _steps(self, store: int) -> tuple[int, int]:
        """Returns elements from one element of a value to the next, and from value to value."""
        own = int(self.sizes[store, 1:].sum())
        return (self.count, 1) if self._interleaved else (1, own)

    def _start(self, store: int, use: Use) -> int:
        """Returns the element at which a region begins."""
        if use is Use.SHARED:
            return 0
        before = int(self.sizes[store, 1:use].sum())
        return int(self.sizes[store, Use.SHARED]) + before * self._steps(store)[0]

    def _make_table(self) -> NDArray[np.int64]:
        """Returns where each array is, as kernels read it."""
        table = np.zeros((len(self.parts), COLUMNS), np.int64)
        for row, part in zip(table, self.parts, strict=True):
            element, each = (1, 0) if part.use is Use.SHARED else self._steps(part.store)
            row[OFFSET] = self._start(part.store, part.use) + part.at * element
            row[EACH] = each
            step = element * self.dtypes[part.store].itemsize
            for axis in reversed(range(len(part.shape))):
                row[SHAPE + axis], row[STRIDES + axis] = part.shape[axis], step
                step *= part.shape[axis]
        return table

    def _make_store(self, store: int, first: Leaves) -> Any:
        """Returns a store on the card, with what all values share."""
        own = int(self.sizes[store, 1:].sum())
        shared = int(self.sizes[store, Use.SHARED])
        data = cuda.device_array(max(shared + own * self.count, 1), self.dtypes[store])
        if shared:
            content = np.zeros(shared, self.dtypes[store])
            for part, array in zip(self.parts[NUMBERS:], first.arrays, strict=True):
                if part.store == store and part.use is Use.SHARED:
                    content[part.at : part.at + part.size] = array.ravel()
            data[:shared].copy_to_device(content)
        return data

    def _regions(self, use: Use) -> list[Region]:
        """Returns the regions of this use in all stores that have one."""
        return [
            Region(k, self._start(k, use), int(self.sizes[k, use]))
            for k in range(len(self.dtypes))
            if self.sizes[k, use]
        ]

    def _copy(self, region: Region, worlds: Any, kept: Any, up: bool) -> None:
        """Copies a region of some values on the card."""
        element, each = self._steps(region.store)
        unit, words = split_words(self.dtypes[region.store])
        blocks = min(BLOCKS, -(-kept.size // THREADS))
        copy_region[blocks, THREADS](
            self.data[region.store].view(unit), kept, worlds, region.base, element, each, words, up
        )

    def send(self, worlds: NDArray[np.int64], states: Sequence[NDArray[Any]]) -> None:
        """Copies the state of some values to the card; states: words of each region."""
        which = cuda.to_device(worlds)
        for region, state in zip(self.state, states, strict=True):
            self._copy(region, which, cuda.to_device(state), True)

    def fetch(self, regions: Sequence[Region], worlds: NDArray[np.int64]) -> list[NDArray[Any]]:
        """Returns regions of some values, as words (values, words)."""
        which, found = cuda.to_device(worlds), []
        for region in regions:
            unit, words = split_words(self.dtypes[region.store])
            kept = cuda.device_array((len(worlds), region.size * words), unit)
            self._copy(region, which, kept, False)
            found.append(kept.copy_to_host())
        return found

    def make_states(self, count: int) -> list[NDArray[Any]]:
        """Returns room for the state of so many values, which `send` takes."""
        room = []
        for region in self.state:
            unit, words = split_words(self.dtypes[region.store])
            room.append(np.empty((count, region.size * words), unit))
        return room

    def list_moves(self, numbers: Sequence[NDArray[Any]], leaves: Leaves) -> NDArray[np.int64]:
        """Returns what `move_bytes` needs of a value; numbers: its floats and integers."""
        rows = {region.store: k for k, region in enumerate(self.state)}
        moves = []
        for part, array in zip(self.parts, (*numbers, *leaves.arrays), strict=True):
            if part.use is Use.STATE and part.size:
                size = self.dtypes[part.store].itemsize
                moves.append(
                    (array.ctypes.data, part.size * size, rows[part.store], part.at * size)
                )
        return np.array(moves, np.int64)

    def copy_rows(
        self, logs: Sequence[NDArray[Any]], j: int, leaves: Leaves, at: int, count: int
    ) -> None:
        """Copies rows that `fetch` gave of value j into the log's arrays, from row `at` on."""
        found = {region.store: k for k, region in enumerate(self.log)}
        for part, path, array in zip(
            self.parts[NUMBERS:], leaves.paths, leaves.arrays, strict=True
        ):
            if part.use is not Use.ROWS:
                continue
            words = logs[found[part.store]][j].view(self.dtypes[part.store])
            new = words[part.at : part.at + part.size].reshape(part.shape)
            if self.logs[path] == 0:
                array[at : at + count] = new[:count]
            else:
                array[:, at : at + count] = new[:, :count]


def split_words(dtype: np.dtype[Any]) -> tuple[np.dtype[Any], int]:
    """Returns the type of the words that an element is copied in, and how many they are."""
    for unit in (np.dtype(np.int64), np.dtype(np.int32)):
        if dtype.itemsize % unit.itemsize == 0:
            return unit, dtype.itemsize // unit.itemsize
    return np.dtype(np.uint8), dtype.itemsize


def _find_shared(leaves: Sequence[Leaves]) -> Flags:
    """Returns which arrays are the very same in all values; none where there is one value."""
    if len(leaves) == 1:
        return np.zeros(len(leaves[0].arrays), np.bool_)
    places = np.array([[a.ctypes.data for a in one.arrays] for one in leaves])
    return np.asarray((places == places[0]).all(axis=0))


def keep_apart(kernels: Iterable[Any]) -> None:
    """Has these kernels compiled for the card as functions of their own, which callers do not take in.

    All kernels of a tick as one function of 70 000 lines take the assembler more than five minutes.
    """
    if SIMULATED:
        return
    from numba.cuda.dispatcher import CUDADispatcher

    class Apart(CUDADispatcher):  # type: ignore[misc]
        """A function of the card that stays one."""

        def compile_device(self, args: Any, return_type: Any = None) -> Any:
            """Compiles it for arguments of these types."""
            new = args not in self.overloads
            compiled = super().compile_device(args, return_type)
            if new:
                for module in compiled.library.modules:
                    function = module.globals.get(compiled.fndesc.llvm_func_name)
                    if function is not None:
                        function.attributes.add("noinline")
            return compiled

    for one in kernels:
        options = {**one.targetoptions, "device": True, "debug": False, "opt": True}
        options.pop("forceinline", None)
        # where numba looks for what it has made of a CPU's kernel
        one._CUDATypingContext__dispatcher = Apart(one.py_func, options)
