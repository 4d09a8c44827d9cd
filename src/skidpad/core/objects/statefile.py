"""The state of a graph of objects as plain data, and back into the same graph of another process.

`Ground` numbers everything that can be reached from a root when a run has just begun, in an order that
is the same in every process. Later the state is written against it: what was there already is named by
its number, and what came since (a track, an event, a vehicle's plan) by its class and its contents.
So nothing of the map, of kernels or of functions is written. `restore` takes the same run, begun in
this process, and puts the contents into it.

It reads data only: numbers, texts, arrays, and attributes of classes of this package, or of classes that
the run itself has brought. No file can name a function, import a module or run code.
"""

from __future__ import annotations

import hashlib
import sys
from collections import deque
from enum import Enum
from functools import partial
from pathlib import Path, PurePath
from types import CellType, FunctionType, MethodType
from typing import Any, Protocol, runtime_checkable

import msgspec
import numpy as np
from numpy.lib.format import dtype_to_descr

from skidpad.core.errors import CheckpointError
from skidpad.core.objects.array_data import (
    Plain,
    describe_array,
    find_dtype,
    make_array,
    pack_numbers,
    put_numbers,
)
from skidpad.core.objects.checkpoint import (
    Copier,
    Copiers,
    copiers_of,
    may_change,
    put_cell,
    put_items,
    put_list,
    put_object,
    slots_copied,
    slots_of,
)

PACKAGE = __name__.partition(".")[0]
SCALARS = (bool, float, str, bytes, type(None))
VALUES = (int, *SCALARS, Enum, np.generic)  # that are not numbered
WRITTEN_AS_THEY_ARE = frozenset(SCALARS)
CONTAINERS = {"list": list, "set": set, "dict": dict, "bytearray": bytearray}
INT_BITS = 63


@runtime_checkable
class KeepsPlace(Protocol):
    """An object whose history is written elsewhere: a file holds its place in it alone."""

    def copy_place(self) -> object:
        """Returns a state for `restore_state` that goes on from here, without what was before."""
        ...


class Ground:
    """All objects of a run that has just begun, numbered.

    Args:
        root: where the search begins; it is one list in the process that writes and in one that reads.
        fixed: types of objects that do not change and are not searched.

    Attributes:
        digest: of the classes of all objects in their order; equal for equal runs.
    """

    def __init__(self, root: list[Any], fixed: tuple[type, ...]) -> None:
        self.root, self.copiers = root, copiers_of(fixed)
        self.objects: list[object] = []
        self.number: dict[int, int] = {}
        digest = hashlib.sha256()
        for found in _walk(root, self.copiers):
            self.number[id(found)] = len(self.objects)
            self.objects.append(found)
            digest.update(f"{name_class(type(found))}\n".encode())
        self.digest = digest.hexdigest()[:16]
        self.changing = [
            (number, found, copier)
            for number, found in enumerate(self.objects)
            if (copier := self.copiers[type(found)]) is not None and may_change(copier)
        ]
        self.classes = {name_class(type(found)): type(found) for found in self.objects}

    def write(self) -> Plain:
        """Returns the state of everything that the root reaches now, as plain data.

        Raises:
            CheckpointError: something came up during the run that is no data, such as a function.
        """
        return _Writer(self).write()

    def restore(self, plain: Plain) -> None:
        """Puts a state that `write` gave into the objects of this run.

        Raises:
            CheckpointError: the data are none of this run.
        """
        try:
            _Reader(self).restore(plain)
        except (TypeError, ValueError, KeyError, IndexError, AttributeError) as error:
            raise CheckpointError(f"the state is none of this run ({error})") from error

    def find_class(self, name: str) -> type:
        """Returns the class of a name; CheckpointError for one that is neither ours nor the run's."""
        if name in self.classes:
            return self.classes[name]
        module, _, path = name.partition(":")
        found: object = sys.modules.get(module) if module.partition(".")[0] == PACKAGE else None
        for part in path.split("."):
            found = getattr(found, part, None)
        if not isinstance(found, type) or found.__module__ != module:
            raise CheckpointError(f"a {name} cannot be a part of a state in a file")
        return found


def name_class(kind: type) -> str:
    """Returns the name by which a file knows a class."""
    return f"{kind.__module__}:{kind.__qualname__}"


def _walk(root: object, copiers: Copiers) -> list[object]:
    """Returns everything that is reached from a root but plain values, in a reproducible order."""
    seen: dict[int, object] = {id(root): root}
    waiting: deque[object] = deque([root])
    while waiting:
        found = waiting.popleft()
        copier = copiers[type(found)]
        parts = () if copier is None else copier(found)[2]
        if isinstance(found, (set, frozenset)):
            parts = sorted(parts, key=repr)
        for part in parts:
            if not isinstance(part, VALUES) and id(part) not in seen:
                seen[id(part)] = part
                waiting.append(part)
    return list(seen.values())


class _Writer:
    """Writes one state: the contents of what was there, and all that came since."""

    def __init__(self, ground: Ground) -> None:
        self.ground = ground
        self.new: list[object] = []  # objects that came since
        self.at: dict[int, int] = {}  # where each stands in `new`

    def write(self) -> Plain:
        """Returns the state as plain data."""
        there: list[Plain] = []
        for number, found, copier in self.ground.changing:
            contents = self._contents_of(found, copier)
            if contents is not None:
                there.append([number, contents])
        came: list[Plain] = []
        while len(came) < len(self.new):  # it grows meanwhile
            came.append(self._describe(self.new[len(came)]))
        return {"there": there, "came": came}

    def _contents_of(self, found: Any, copier: Copier) -> Plain | None:
        """Returns the contents of an object as a checkpoint keeps them; None where they cannot change."""
        if isinstance(found, np.ndarray):
            fixed = not (found.flags.writeable or found.dtype.hasobject)
            return None if fixed else pack_numbers(found)
        if isinstance(found, dict):
            return [[self.value(key), self.value(value)] for key, value in found.items()]
        if isinstance(found, (list, set, deque, bytearray)):
            return [self.value(item) for item in found]
        if hasattr(type(found), "copy_place"):  # its copy would hold its whole history
            return self._write_copy(found.copy_place())
        if (slots := slots_copied(copier)) is not None:
            held = {name: getattr(found, name) for name in slots if hasattr(found, name)}
            return self._attributes(found, held | getattr(found, "__dict__", {}))
        put_back, state, _ = copier(found)
        if put_back is None:
            return None
        return self.value(state) if put_back is put_cell else self._write_copy(state)

    def _attributes(self, found: Any, named: dict[str, Any]) -> Plain:
        """Returns attributes of an object without those that its class leaves out."""
        unsaved = getattr(found, "UNSAVED", ())
        return [[name, self.value(value)] for name, value in named.items() if name not in unsaved]

    def _write_copy(self, state: Any) -> Plain:
        """Returns a state that an object gave of itself: its containers are copies, not objects."""
        if type(state) is dict:
            return ["dict", [[self._write_copy(k), self._write_copy(v)] for k, v in state.items()]]
        if type(state) in (list, tuple):
            return [type(state).__name__, [self._write_copy(item) for item in state]]
        if type(state) is np.ndarray:
            return ["array", *describe_array(state), pack_numbers(state)]
        return self.value(state)

    def value(self, value: Any) -> Plain:
        """Returns a value: itself, or where the object stands that it is."""
        kind = type(value)
        if kind in WRITTEN_AS_THEY_ARE:
            return value
        if kind is int:
            return value if value.bit_length() <= INT_BITS else ["int", str(value)]
        number = self.ground.number.get(id(value))
        if number is not None:
            return ["there", number]
        if isinstance(value, Enum):
            return ["enum", name_class(kind), value.name]
        if isinstance(value, np.generic):
            return ["number", dtype_to_descr(value.dtype), value.tobytes()]
        if isinstance(value, PurePath):
            return ["path", str(value)]
        if type(value) is tuple:
            return ["tuple", [self.value(v) for v in value]]
        if isinstance(value, frozenset):
            return ["frozenset", [self.value(v) for v in value]]
        if isinstance(value, tuple):
            return ["named", self._class(value), [self.value(v) for v in value]]
        if isinstance(value, msgspec.Struct):
            fields = [[k, self.value(getattr(value, k))] for k in value.__struct_fields__]
            return ["struct", self._class(value), fields]
        if id(value) not in self.at:
            self.at[id(value)] = len(self.new)
            self.new.append(value)
        return ["came", self.at[id(value)]]

    def _describe(self, found: Any) -> Plain:
        """Returns an object that came since the begin: what it is, and its contents."""
        kind, copier = type(found), self.ground.copiers[type(found)]
        if copier is None or issubclass(kind, (FunctionType, MethodType, CellType, partial)):
            raise CheckpointError(f"a {name_class(kind)} cannot be written, as it is no data")
        if kind in CONTAINERS.values():
            about: Plain = [kind.__name__]
        elif kind is deque:
            about = ["deque", found.maxlen]
        elif kind is np.ndarray:
            return [self._place_of(found), pack_numbers(found)]
        elif kind is np.random.Generator:
            about = ["generator"]
        else:
            about = ["object", self._class(found)]
            if not may_change(copier):  # it is frozen
                return [about, self._attributes(found, attributes_of(found))]
        return [about, self._contents_of(found, copier)]

    def _place_of(self, array: np.ndarray) -> Plain:
        """Returns an array's type and shape, and where it lies if it is a part of another one."""
        base = array
        while isinstance(base.base, np.ndarray):
            base = base.base
        if base is array or id(base) not in self.ground.number:
            return ["array", *describe_array(array)]
        first, begin = (a.__array_interface__["data"][0] for a in (array, base))
        where = [self.ground.number[id(base)], first - begin, list(array.strides)]
        return ["view", dtype_to_descr(array.dtype), list(array.shape), *where]

    def _class(self, found: object) -> str:
        """Returns the name of an object's class, which a reader must find by it."""
        name = name_class(type(found))
        if self.ground.find_class(name) is not type(found):
            raise CheckpointError(f"a {name} cannot be written: another class has its name")
        return name


class _Reader:
    """Reads one state into the objects of a run."""

    def __init__(self, ground: Ground) -> None:
        self.ground = ground
        self.new: list[Any] = []

    def restore(self, plain: Plain) -> None:
        """Makes what came since the begin, then puts all contents in place: keys before what has keys."""
        self.new = [self._make(*about) for about, _ in plain["came"]]
        contents = list(zip(self.new, (state for _, state in plain["came"]), strict=True))
        contents += [(self.ground.objects[number], state) for number, state in plain["there"]]
        for found, state in sorted(contents, key=lambda one: isinstance(one[0], (set, dict))):
            self._fill(found, state)

    def _make(self, kind: str, *about: Any) -> Any:
        """Returns an object of a kind, without contents."""
        if kind in CONTAINERS:
            return CONTAINERS[kind]()
        if kind == "deque":
            return deque(maxlen=about[0])
        if kind == "generator":
            return np.random.Generator(np.random.PCG64())
        if kind == "array":
            return make_array(*about)
        if kind == "view":
            descr, shape, number, offset, strides = about
            base: Any = self.ground.objects[number]
            return np.ndarray(tuple(shape), find_dtype(descr), base, offset, tuple(strides))
        found: Any = self.ground.find_class(about[0])
        if kind != "object" or found.__new__ is not object.__new__:
            raise ValueError(f"unknown kind {kind} {about}")
        return found.__new__(found)

    def _fill(self, found: Any, state: Plain) -> None:
        """Puts contents into an object."""
        copier = self.ground.copiers[type(found)]
        assert copier is not None
        put_back = copier(found)[0]
        if isinstance(found, np.ndarray):
            put_numbers(found, state)
        elif put_back is put_list or (put_back is put_items and not isinstance(found, dict)):
            put_back(found, [self.value(item) for item in state])
        elif put_back is put_items:
            put_back(found, {self.value(key): self.value(value) for key, value in state})
        elif put_back is put_object or put_back is None:
            self._set_attributes(found, {name: self.value(value) for name, value in state})
        else:
            put_back(found, self.value(state))

    def _set_attributes(self, found: object, state: dict[str, Any]) -> None:
        """Sets the attributes of an object, and removes those that it no longer has."""
        for name in attributes_of(found).keys() - state.keys() - {*getattr(found, "UNSAVED", ())}:
            object.__delattr__(found, name)
        for name, value in state.items():
            object.__setattr__(found, name, value)

    def value(self, plain: Plain) -> Any:
        """Returns the value that plain data stand for."""
        if not isinstance(plain, list):
            return plain
        kind, *about = plain
        return getattr(self, f"_read_{kind}")(*about)

    def _read_there(self, number: int) -> object:
        return self.ground.objects[number]

    def _read_came(self, number: int) -> object:
        return self.new[number]

    def _read_int(self, text: str) -> int:
        return int(text)

    def _read_enum(self, name: str, member: str) -> object:
        return self._class(name, Enum)[member]

    def _read_number(self, descr: Plain, data: bytes) -> object:
        return np.frombuffer(data, find_dtype(descr))[0]

    def _read_path(self, text: str) -> PurePath:
        return Path(text)

    def _read_tuple(self, items: list[Plain]) -> tuple[object, ...]:
        return tuple(map(self.value, items))

    def _read_list(self, items: list[Plain]) -> list[object]:
        return list(map(self.value, items))

    def _read_frozenset(self, items: list[Plain]) -> frozenset[object]:
        return frozenset(map(self.value, items))

    def _read_dict(self, pairs: list[list[Plain]]) -> dict[object, object]:
        return {self.value(key): self.value(value) for key, value in pairs}

    def _read_array(self, descr: Plain, shape: list[int], how: str, data: bytes) -> np.ndarray:
        found = make_array(descr, shape, how)
        put_numbers(found, data)
        return found

    def _read_named(self, name: str, items: list[Plain]) -> object:
        return tuple.__new__(self._class(name, tuple), map(self.value, items))

    def _read_struct(self, name: str, fields: list[list[Plain]]) -> object:
        return self._class(name, msgspec.Struct)(**{key: self.value(v) for key, v in fields})

    def _class(self, name: str, base: type) -> Any:
        """Returns the class of a name; ValueError for one that is not derived from `base`."""
        found = self.ground.find_class(name)
        if not issubclass(found, base):
            raise ValueError(f"{name} is no {base.__name__}")
        return found


def attributes_of(found: Any) -> dict[str, Any]:
    """Returns all attributes that an instance has, in slots or not."""
    kind: Any = type(found)
    slots = {name: getattr(found, name) for name in slots_of(kind) if hasattr(found, name)}
    return slots | getattr(found, "__dict__", {})
