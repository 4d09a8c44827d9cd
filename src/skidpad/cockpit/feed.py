"""The latest picture in shared memory: the writer never waits, the reader takes the newest.

Three slots in turn. A reader copies the slot that was finished last; the writer is then in another
one, and needs two more pictures to come round, which the reader notices and tries again.
"""

from __future__ import annotations

from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

SLOTS = 3
SLOT_BYTES = 6_000_000  # two views of 800x600 in four bytes per pixel, and the small ones
HEAD = 64  # bytes: LAST, TAKEN, then a length per slot
LAST, TAKEN, FIRST_LENGTH = 0, 1, 2  # of int64

Array = NDArray[Any]


class Plane(msgspec.Struct, frozen=True):
    """Where an array lies in a packet."""

    name: str
    kind: str  # numpy's name of the type
    shape: tuple[int, ...]


class Head(msgspec.Struct, frozen=True):
    """What a packet begins with."""

    number: int
    told: msgspec.Raw  # the heads-up display, JSON
    planes: tuple[Plane, ...]


class Packet(NamedTuple):
    """One picture of all views, and what is said beside it."""

    number: int
    told: bytes  # JSON
    views: dict[str, Array]


class Feed:
    """Passes pictures between two processes through shared memory; the end that creates it removes it."""

    def __init__(self, name: str | None = None) -> None:
        """name: of a feed that another process created; None: a new one."""
        self.owner = name is None
        size = HEAD + SLOTS * SLOT_BYTES
        self._memory = SharedMemory(name=name, create=self.owner, size=size if self.owner else 0)
        self._state = np.ndarray(HEAD // 8, dtype=np.int64, buffer=self._memory.buf)
        if self.owner:
            self._state[:] = 0

    @property
    def name(self) -> str:
        """Returns the name by which another process finds the feed."""
        return self._memory.name

    @property
    def last(self) -> int:
        """Returns the number of the picture that was written last; 0: none yet."""
        return int(self._state[LAST])

    @property
    def last_read(self) -> int:
        """Returns the number of the picture that was read last; 0: none yet."""
        return int(self._state[TAKEN])

    def write_picture(self, told: bytes, views: dict[str, Array]) -> int:
        """Writes the next picture and returns its number; ValueError when it is larger than a slot.

        told: JSON beside it; views: images by name.
        """
        number = self.last + 1
        planes = tuple(Plane(n, a.dtype.name, a.shape) for n, a in views.items())
        head = msgspec.json.encode(Head(number, msgspec.Raw(told), planes))
        data, at = self._slot(number), _align_size(len(head))
        if at + sum(_align_size(a.nbytes) for a in views.values()) > SLOT_BYTES:
            raise ValueError("the views do not fit into a slot")
        data[: len(head)] = np.frombuffer(head, dtype=np.uint8)
        for array in views.values():
            room = data[at : at + array.nbytes].view(array.dtype)
            room.reshape(array.shape)[...] = array
            at += _align_size(array.nbytes)
        self._state[FIRST_LENGTH + number % SLOTS] = len(head)
        self._state[LAST] = number
        return number

    def take(self) -> Packet | None:
        """Returns a copy of the newest picture, taken before or not, and marks it as read; None: none yet."""
        while (number := self.last) > 0:
            data = self._slot(number)
            copy = data.copy()
            length = int(self._state[FIRST_LENGTH + number % SLOTS])
            if self.last - number < SLOTS - 1:
                self._state[TAKEN] = number
                return _unpack(copy, length)
        return None

    def close(self) -> None:
        """Releases the memory and, as its creator, removes it; safe to call twice."""
        if self._state.size:
            self._state = np.empty(0, dtype=np.int64)
            self._memory.close()
            if self.owner:
                self._memory.unlink()

    def _slot(self, number: int) -> NDArray[np.uint8]:
        """Returns the memory of a slot, numbers wrapping around."""
        first = HEAD + number % SLOTS * SLOT_BYTES
        slot: NDArray[np.uint8] = np.ndarray(
            SLOT_BYTES, dtype=np.uint8, buffer=self._memory.buf, offset=first
        )
        return slot


def _align_size(size: int) -> int:
    """Returns `size` rounded up to whole HEAD bytes, so that the next array is aligned for any type."""
    return -(-size // HEAD) * HEAD


def _unpack(data: NDArray[np.uint8], length: int) -> Packet:
    """Returns the packet in a slot; its planes are views of the memory, not copies."""
    head = msgspec.json.decode(data[:length].tobytes(), type=Head)
    views, at = {}, _align_size(length)
    for plane in head.planes:
        kind = np.dtype(plane.kind)
        size = int(np.prod(plane.shape)) * kind.itemsize
        views[plane.name] = data[at : at + size].view(kind).reshape(plane.shape)
        at += _align_size(size)
    return Packet(head.number, bytes(head.told), views)
