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
    """Whether machine code of a kernel, wrappers aside, still counts, for any types of its arguments."""
    assert isinstance(compiled, Dispatcher)
    assert compiled.overloads
    texts = [str(o.library._get_module_for_linking()) for o in compiled.overloads.values()]
    kernels = (f[0] for text in texts for f in FUNCTION.finditer(text) if not is_wrapper(f[0]))
    return any(COUNTING.search(f) for f in kernels if not is_runtime(f))
