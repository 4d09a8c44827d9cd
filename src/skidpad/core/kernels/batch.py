"""Many values of one kind side by side: the arrays of named tuples, stacked, and how a kernel takes one out.

A value is a named tuple of numbers, arrays and further tuples, as kernels take them. Its arrays become parts
of one array for each dtype; arrays that several values share are there once. The function that builds value
b from there is generated from the first value, as numba has no loop over fields of different types.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numba.core import types
from numba.experimental.structref import StructRefProxy
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel

OFFSET, EACH, SHAPE, STRIDES = 0, 1, 2, 5  # columns of a table: elements, elements, lengths, bytes
COLUMNS: Final = 8
FLOATS, INTS = np.dtype(np.float64), np.dtype(np.int64)
NUMBERS = 2  # rows of a table before those of arrays: the numbers as floats, and as integers


class Inside(NamedTuple):
    """What `Held` is within a kernel of a batch: a plain tuple."""

    value: Any


@kernel
def read_held(held: Any) -> Any:
    """Returns the named tuple that is held."""
    return held.value


class Leaves(NamedTuple):
    """What a value consists of.

    source: of the expression that builds it anew; paths: of each array; classes: of the named tuples by
    their names in the source.
    """

    source: str
    paths: tuple[str, ...]
    arrays: tuple[NDArray[Any], ...]
    numbers: tuple[float | int | bool, ...]
    classes: dict[str, type]

    def number_arrays(self) -> tuple[Floats, NDArray[np.int64]]:
        """Returns the numbers as floats and as integers, each 0 where the other tells it."""
        floats, ints = np.zeros(len(self.numbers)), np.zeros(len(self.numbers), np.int64)
        for k, number in enumerate(self.numbers):
            if isinstance(number, (float, np.floating)):
                floats[k] = number
            else:
                ints[k] = np.uint64(number).astype(np.int64) if number >= 0 else number
        return floats, ints


class _Walk:
    """Finds arrays and numbers of a value in their order."""

    def __init__(self) -> None:
        self.paths: list[str] = []
        self.arrays: list[NDArray[Any]] = []
        self.numbers: list[float | int | bool] = []
        self.classes: dict[str, type] = {"Inside": Inside}
        self._known: dict[tuple[object, ...], int] = {}

    def visit(self, value: Any, path: str, typed: Any = None) -> str:
        """Returns the expression that builds `value` anew.

        typed: its type for kernels, where it was held: an unsigned number comes out of there as Python's int.
        """
        if isinstance(value, StructRefProxy):
            inner = value._numba_type_.field_dict["value"]
            return f"Inside({self.visit(read_held(value), path, inner)})"
        if isinstance(value, tuple):
            kind = type(value)
            names = getattr(kind, "_fields", range(len(value)))
            inside = [None] * len(value) if typed is None else typed.types
            parts = [
                self.visit(v, f"{path}.{f}", t)
                for f, v, t in zip(names, value, inside, strict=True)
            ]
            if kind is tuple:
                return f"({', '.join(parts)},)"
            name = f"{kind.__module__}_{kind.__qualname__}".replace(".", "_")
            self.classes[name] = kind
            return f"{name}({', '.join(parts)})"
        if isinstance(value, np.ndarray):
            if not value.flags.c_contiguous:
                raise ValueError(
                    f"{path.removeprefix('.')} must be C-contiguous, got strides {value.strides}"
                )
            key = value.ctypes.data, value.shape, value.dtype
            if key not in self._known or not value.size:
                self._known[key] = len(self.arrays)
                self.arrays.append(value)
                self.paths.append(path.removeprefix("."))
            return f"a{self._known[key]}"
        if value is None:
            return "None"
        self.numbers.append(value)
        store = "f" if isinstance(value, (float, np.floating)) else "i"
        kept = f"{store}[{len(self.numbers) - 1}]"
        if isinstance(value, np.uint64) or typed == types.uint64:
            return f"uint64({kept})"
        return f"({kept} != 0)" if isinstance(value, (bool, np.bool_)) else kept


def find_leaves(value: Any) -> Leaves:
    """Returns what a value consists of; raises ValueError where an array is not C-contiguous."""
    walk = _Walk()
    source = walk.visit(value, "")
    return Leaves(
        source, tuple(walk.paths), tuple(walk.arrays), tuple(walk.numbers), walk.classes
    )  # fmt: skip


def write_taker(leaves: Leaves, dtypes: Sequence[np.dtype[Any]]) -> str:
    """Returns the text of the function `take(table, b, *stores)` that builds value b, for kernels.

    It finds the classes of `leaves` by their names; `view`, which gives an array of these lengths and
    strides in bytes that begins where another does; and `uint64`. dtypes: of the stores; rows 0 and 1 of the
    table are the numbers, as floats and integers, further ones the arrays.
    """
    order = {dtype: k for k, dtype in enumerate(dtypes)}
    lines = [f"def take(t, b, {name_stores(dtypes)}):"]
    rows = [("f", FLOATS, 1), ("i", INTS, 1)]
    rows += [(f"a{k}", a.dtype, a.ndim) for k, a in enumerate(leaves.arrays)]
    for k, (name, dtype, ndim) in enumerate(rows):
        data = f"d{order[dtype]}[t[{k}, {OFFSET}] + b * t[{k}, {EACH}] :]"
        shape = "".join(f"t[{k}, {SHAPE + axis}], " for axis in range(ndim))
        strides = "".join(f"t[{k}, {STRIDES + axis}], " for axis in range(ndim))
        lines.append(f"    {name} = view({data}, ({shape}), ({strides}))")
    return "\n".join([*lines, f"    return {leaves.source}", ""])


def name_stores(dtypes: Sequence[np.dtype[Any]]) -> str:
    """Returns the names of the stores in generated functions, parted by commas."""
    return ", ".join(f"d{k}" for k in range(len(dtypes)))


def call_directly(kernel: Any, compiled: Callable[[Any], Any]) -> Any:
    """Returns a kernel in which each `call(address, kernel, arguments)` is a plain call, compiled.

    So are those that it calls of its own file.
    """
    own = kernel.py_func.__globals__
    space: dict[str, Any] = dict(own)
    for name, one in own.items():
        function = getattr(one, "py_func", None)
        if function is None or function.__globals__ is not own:
            continue
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        body = tree.body[0]
        assert isinstance(body, ast.FunctionDef)
        body.decorator_list, body.returns = [], None
        for argument in body.args.args:
            argument.annotation = None
        tree = ast.fix_missing_locations(_Direct().visit(tree))
        exec(compile(tree, inspect.getfile(function), "exec"), space)
        space[name] = compiled(space[name])
    return space[kernel.py_func.__name__]


class _Direct(ast.NodeTransformer):
    """Writes calls by address as calls by name."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Returns the call, changed if it is one by address."""
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id == "call":
            _, kernel, arguments = node.args
            assert isinstance(arguments, ast.Tuple)
            return ast.copy_location(ast.Call(kernel, arguments.elts, []), node)
        return node
