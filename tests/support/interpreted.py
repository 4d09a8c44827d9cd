"""The kernels of our stack as plain Python, so that a changed constant is seen when it is read."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from skidpad.core.kernels.jit import Held, hold
from skidpad.stack import memory
from support import stack_parts, stackfakes

HOUSES = (
    "skidpad.stack.", "skidpad.roads.kernels", "skidpad.roads.along", stack_parts.__name__,
    stackfakes.__name__,
)  # fmt: skip
COMPILED = (
    "skidpad.stack.perception.corridor",
    "skidpad.stack.perception.hsv",
)  # loops over pixels


def interpret(patch: pytest.MonkeyPatch, others: Iterable[ModuleType] = ()) -> None:
    """Puts the text of each kernel of the stack in its place, here and in `others`, until `patch` ends."""
    loaded = [m for name, m in list(sys.modules.items()) if name.startswith(HOUSES)]
    for module in (*loaded, *others):
        for name, value in list(vars(module).items()):
            if value is hold or value is Held:
                patch.setattr(module, name, _keep)
            elif isinstance(value, Dispatcher) and value.py_func.__module__ not in COMPILED:
                patch.setattr(module, name, value.py_func)
    patch.setattr(memory, "MEMORY", np.dtype((np.record, memory.MEMORY)))


def _keep(value: object) -> SimpleNamespace:
    return SimpleNamespace(value=value)
