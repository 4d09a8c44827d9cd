"""What runs of one process share: within `share_setups` a scenario file is read and compiled once.

Maps and machine code are shared by every run anyway. A compiled file does not change while it is played,
so runs that differ in seed, weather, driver or draws may play the same one. Files that name code (a driver,
a hook, a registered class) are compiled for each run, as such code may remember what it did.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")
MOST = 64  # compiled files that are kept; the oldest goes first
_KEPT: ContextVar[dict[object, object] | None] = ContextVar("shared setups", default=None)


@contextmanager
def share_setups() -> Iterator[None]:
    """Lets the runs within it share what `find_shared` makes; inside another one nothing changes."""
    if _KEPT.get() is not None:
        yield
        return
    token = _KEPT.set({})
    try:
        yield
    finally:
        _KEPT.reset(token)


def find_shared(key: object, make: Callable[[], tuple[T, bool]]) -> T:
    """Returns what was made under this key before, else makes it.

    make: returns the thing, and whether other runs may have it.
    """
    kept = _KEPT.get()
    if kept is not None and key in kept:
        return kept[key]  # type: ignore[return-value]
    made, may_share = make()
    if kept is not None and may_share:
        if len(kept) >= MOST:
            del kept[next(iter(kept))]
        kept[key] = made
    return made
