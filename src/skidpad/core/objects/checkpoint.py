"""A copy of everything that may change in a graph of objects, put back into the same objects.

`Checkpoint` follows attributes, items and closures from a root. Of each object that may change it
keeps the object and a flat copy of its contents: the numbers of an array, the items of a list or
dict, the attributes of an instance, the state of a random generator. `restore` writes the copies
back. Objects stay the ones that they were, so kernels that hold arrays by address go on as before.
What cannot change (numbers, texts, frozen values, `fixed` types) is shared. A class names in
`UNSAVED` the attributes that are constant, or that every tick fills anew before it reads them.

It cannot leave its process, and it raises where something holds state that Python does not show.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from copy import deepcopy
from enum import Enum
from functools import cache, partial
from pathlib import PurePath
from types import (
    BuiltinFunctionType,
    CellType,
    FunctionType,
    MappingProxyType,
    MethodType,
    ModuleType,
)
from typing import Any, Generic, Protocol, runtime_checkable

import msgspec
import numpy as np

from skidpad.core.errors import CheckpointError
from skidpad.core.kernels.jit import Held

UNCHANGING = (
    int, float, complex, str, bytes, type(None), Enum, type, ModuleType, BuiltinFunctionType,
    np.generic, np.dtype, PurePath, range, slice, Held,
)  # fmt: skip
PLAIN_BASES = frozenset({object, Generic, Protocol, Exception, BaseException, ValueError})
HEAP_TYPE = 1 << 9  # flag of CPython: the class was made by a class statement
LARGEST_NAME = 200  # characters of a place in an error


@runtime_checkable
class KeepsHistory(Protocol):
    """An object that gives and takes its state itself, as it knows which part can still change."""

    def copy_state(self) -> object:
        """Returns a copy of the state."""
        ...

    def restore_state(self, state: Any) -> None:
        """Takes back a state that `copy_state` gave."""
        ...


class Checkpoint:
    """The state of all objects that can be reached from a root.

    Args:
        root: where the search begins.
        fixed: types of objects that do not change and are not searched.

    Raises:
        CheckpointError: an object holds state that cannot be copied: a file, an iterator, ...
    """

    def __init__(self, root: object, fixed: tuple[type, ...] = ()) -> None:
        self._restoring: list[tuple[Callable[..., None], Any, Any]] = []
        self.nbytes = 0  # of arrays
        copiers = copiers_of(fixed)
        seen: dict[int, object] = {}
        waiting: list[object] = [(root,)]
        while waiting:
            found = waiting.pop()
            put_back, state, parts = copiers[type(found)](found)  # type: ignore[misc]
            if put_back is not None:
                self._restoring.append((put_back, found, state))
                if put_back is put_array:
                    self.nbytes += state.nbytes
            for part in parts:
                if copiers[type(part)] is not None and id(part) not in seen:
                    seen[id(part)] = part
                    waiting.append(part)

    def __len__(self) -> int:
        return len(self._restoring)

    def restore(self) -> None:
        """Puts everything back; the checkpoint stays as it is and can be restored again."""
        for put_back, found, state in self._restoring:
            put_back(found, state)


Copied = tuple[Callable[..., None] | None, Any, Iterable[object]]
Copier = Callable[[Any], Copied]


class Copiers(dict[type, "Copier | None"]):
    """What copies objects of each type, found as types are met; None: its objects do not change."""

    def __init__(self, fixed: tuple[type, ...]) -> None:
        super().__init__({tuple: _copy_tuple})
        self.fixed = fixed

    def __missing__(self, kind: type) -> Copier | None:
        self[kind] = found = _copier(kind, self.fixed)
        return found


@cache
def copiers_of(fixed: tuple[type, ...]) -> Copiers:
    """Returns what copies objects of each type where these types are fixed."""
    return Copiers(fixed)


def _copier(kind: Any, fixed: tuple[type, ...]) -> Copier | None:
    """Returns what copies objects of a type; None for a type whose objects do not change."""
    if issubclass(kind, (*UNCHANGING, *fixed)) or _is_kernel(kind):
        return None
    for base, copy in COPIERS.items():
        if issubclass(kind, base):
            return copy
    if issubclass(kind, msgspec.Struct):
        return (
            None if kind.__struct_config__.frozen else partial(_copy_object, kind.__struct_fields__)
        )
    if hasattr(kind, "copy_state") and hasattr(kind, "restore_state"):
        return _copy_by_itself
    frozen = getattr(kind, "__dataclass_params__", None)
    if frozen is not None and frozen.frozen:
        return partial(_copy_frozen, slots_of(kind))
    if "__setstate__" in vars(kind):
        return _copy_by_protocol
    for base in kind.__mro__:
        if base not in PLAIN_BASES and not base.__flags__ & HEAP_TYPE:
            raise CheckpointError(
                f"a {kind.__module__}.{kind.__qualname__} cannot be saved, as Python does not show "
                "its state; a class of yours may have __getstate__ and __setstate__"
            )
    return partial(_copy_object, slots_of(kind))


def _is_kernel(kind: type) -> bool:
    """Tells whether a type is one of compiled functions, or of functions that remember results."""
    return kind.__module__.partition(".")[0] == "numba" or kind.__qualname__ == "_lru_cache_wrapper"


@cache
def slots_of(kind: Any) -> tuple[str, ...]:
    """Returns the names of all slots of a class."""
    found: list[str] = []
    for base in kind.__mro__:
        slots = vars(base).get("__slots__", ())
        found += [slots] if isinstance(slots, str) else slots
    return tuple(s for s in found if s not in ("__dict__", "__weakref__"))


def _copy_array(array: np.ndarray) -> Copied:
    if array.dtype.hasobject:
        return put_array, array.copy(), array.tolist()
    return (put_array, array.copy(), ()) if array.flags.writeable else (None, None, ())


def put_array(array: np.ndarray, state: np.ndarray) -> None:
    """Writes the numbers of an array back."""
    array[...] = state


def _copy_list(items: list[Any]) -> Copied:
    return put_list, items.copy(), items


def put_list(items: list[Any], state: list[Any]) -> None:
    """Puts the items of a list back."""
    items[:] = state


def _copy_items(items: Any) -> Copied:
    parts = (*items, *items.values()) if isinstance(items, dict) else tuple(items)
    return put_items, items.copy(), parts


def put_items(items: Any, state: Any) -> None:
    """Puts the items of a dict, set, deque or bytearray back."""
    items.clear()
    items.extend(state) if isinstance(items, (deque, bytearray)) else items.update(state)


def _copy_generator(generator: np.random.Generator) -> Copied:
    return put_generator, generator.bit_generator.state, ()


def put_generator(generator: np.random.Generator, state: Any) -> None:
    """Puts a random generator back to its state."""
    generator.bit_generator.state = state


def _copy_tuple(items: Iterable[object]) -> Copied:
    return None, None, tuple(items)


def _copy_view(view: MappingProxyType[Any, Any]) -> Copied:
    return None, None, (*view, *view.values())


def _copy_method(method: MethodType) -> Copied:
    return None, None, (method.__self__, method.__func__)


def _copy_partial(call: partial[Any]) -> Copied:
    return None, None, (call.func, *call.args, *call.keywords.values())


def _copy_function(function: FunctionType) -> Copied:
    return None, None, function.__closure__ or ()


def _copy_cell(cell: CellType) -> Copied:
    try:
        return put_cell, cell.cell_contents, (cell.cell_contents,)
    except ValueError:  # it is empty so far
        return None, None, ()


def put_cell(cell: CellType, state: object) -> None:
    """Puts the content of a closure's cell back."""
    cell.cell_contents = state


def _copy_by_itself(found: KeepsHistory) -> Copied:
    return put_by_itself, found.copy_state(), ()


def put_by_itself(found: KeepsHistory, state: object) -> None:
    """Lets an object take back the state that it gave."""
    found.restore_state(state)


def _copy_by_protocol(found: Any) -> Copied:
    return put_by_protocol, deepcopy(found.__getstate__()), ()


def put_by_protocol(found: Any, state: object) -> None:
    """Lets an object take back the state that its __getstate__ gave."""
    found.__setstate__(deepcopy(state))


def _copy_frozen(slots: tuple[str, ...], found: Any) -> Copied:
    parts = [getattr(found, name) for name in slots if hasattr(found, name)]
    return None, None, (*parts, *getattr(found, "__dict__", {}).values())


def _copy_object(slots: tuple[str, ...], found: Any) -> Copied:
    held = {name: getattr(found, name) for name in slots if hasattr(found, name)}
    own = getattr(found, "__dict__", {}).copy()
    unsaved = getattr(found, "UNSAVED", ())
    parts = [part for name, part in (held | own).items() if name not in unsaved]
    return put_object, (slots, held, own), parts


def put_object(found: Any, state: tuple[tuple[str, ...], dict[str, Any], dict[str, Any]]) -> None:
    """Puts the attributes of an object back."""
    slots, held, own = state
    for name in slots:
        if name in held:
            setattr(found, name, held[name])
        elif hasattr(found, name):
            delattr(found, name)
    if own or hasattr(found, "__dict__"):
        found.__dict__.clear()
        found.__dict__.update(own)


COPIERS: dict[type, Copier] = {
    np.ndarray: _copy_array,
    list: _copy_list,
    dict: _copy_items,
    set: _copy_items,
    deque: _copy_items,
    bytearray: _copy_items,
    tuple: _copy_tuple,
    frozenset: _copy_tuple,
    np.random.Generator: _copy_generator,
    MappingProxyType: _copy_view,
    MethodType: _copy_method,
    partial: _copy_partial,
    FunctionType: _copy_function,
    CellType: _copy_cell,
}
SHARING = (_copy_tuple, _copy_view, _copy_method, _copy_partial, _copy_function, _copy_frozen)


def may_change(copier: Copier) -> bool:
    """Returns whether objects of a copier have contents to put back."""
    return getattr(copier, "func", copier) not in SHARING


def slots_copied(copier: Copier) -> tuple[str, ...] | None:
    """Returns the slots that a copier of attributes keeps beside `__dict__`; None: it is no such copier."""
    if isinstance(copier, partial) and copier.func is _copy_object:
        slots: tuple[str, ...] = copier.args[0]
        return slots
    return None
