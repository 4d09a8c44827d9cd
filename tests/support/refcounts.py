"""Whether compiled code counts references."""

from __future__ import annotations

from typing import Any

from numba.core.dispatcher import Dispatcher

from skidpad.core.kernels.refcounts import (
    COUNTING,
    FUNCTION,
    is_runtime,
    is_wrapper,
)


def counts_references(compiled: Any) -> bool:
    """Whether machine code of a kernel, wrappers aside, still counts."""
    assert isinstance(compiled, Dispatcher)
    (result,) = compiled.overloads.values()
    text = str(result.library._get_module_for_linking())
    kernels = (f[0] for f in FUNCTION.finditer(text) if not is_wrapper(f[0]))
    return any(COUNTING.search(f) for f in kernels if not is_runtime(f))
