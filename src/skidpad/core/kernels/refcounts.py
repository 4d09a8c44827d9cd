"""Machine code without the counting of references, where nothing is allocated.

Numba counts a reference whenever a kernel takes an array out of a named tuple or a row out of an
array, with an atomic operation each: half of the time of a step of the world. A kernel that allocates
nothing and returns no array leaves every count as it found it, and its caller holds all that it
reads. So the counting is taken out of such kernels; in all others it stays.
"""

from __future__ import annotations

import re
from typing import Any

from llvmlite import binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

COUNTING = re.compile(r"^\s*(?:tail )?call void @NRT_(?:inc|dec)ref\(.*$\n", re.MULTILINE)
RUNTIME = re.compile(r"@NRT_(\w+)")  # numba's runtime: counting, and everything that allocates
HARMLESS = frozenset({"incref", "decref", "MemInfo_data_fast"})
FUNCTION = re.compile(r"^define .*?^}$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r'@"?([^"(]+)')
WRAPPERS = ("_ZN7cpython", "cfunc.")  # they count what Python hands over and takes back
SHARED = re.compile(r"^define linkonce_odr ")


class LeanLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Holds the machine code of one kernel and of all that it calls."""

    state: Any  # of the compiler: what the kernel is and returns
    _final_module: Any

    def _optimize_final_module(self) -> None:
        """Removes the reference counts of a module that allocates nothing, and then optimises it."""
        text = str(self._final_module)
        if not self._returns_references() and not allocates(text):
            module = binding.parse_assembly(without_counting(text))
            module.name = self._final_module.name
            self._final_module = module
        self.state = None  # all that the compiler knew; libraries live as long as the process
        super()._optimize_final_module()

    def _returns_references(self) -> bool:
        """Returns whether the compiled function's result holds reference-counted memory."""
        models = self.state.targetctx.data_model_manager
        return bool(models[self.state.return_type].contains_nrt_meminfo())


class LeanCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler, with a library that can leave out the counting."""

    def compile_extra(self, func: Any) -> Any:
        """Compiles a function with a library of this kind."""
        library = LeanLibrary(self.state.targetctx.codegen(), func.__qualname__)
        library.enable_object_caching()
        library.state, self.state.library = self.state, library
        return super().compile_extra(func)


def is_wrapper(function: str) -> bool:
    """Tells whether a function of a module, as text, stands between Python and a kernel."""
    found = NAME.search(function)
    return found is not None and found[1].startswith(WRAPPERS)


def allocates(text: str) -> bool:
    """Tells whether a kernel of this module, as text, asks numba's runtime for more than counting."""
    kernels = (f[0] for f in FUNCTION.finditer(text) if not is_wrapper(f[0]))
    return any(
        name not in HARMLESS and not is_runtime(body)
        for body in kernels
        for name in RUNTIME.findall(body)
    )


def is_runtime(function: str) -> bool:
    """Tells whether a function of a module is one of the runtime itself."""
    found = NAME.search(function)
    return found is not None and found[1].startswith("NRT_")


def without_counting(text: str) -> str:
    """Returns the text of the module without counting in its kernels.

    Callees become private: another module must not take them for its own, which count.
    """

    def leaner(found: re.Match[str]) -> str:
        function = found[0]
        if is_wrapper(function) or is_runtime(function):
            return function
        return SHARED.sub("define internal ", COUNTING.sub("", function))

    return FUNCTION.sub(leaner, text)
