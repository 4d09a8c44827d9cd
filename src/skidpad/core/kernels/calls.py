"""Calls of kernels by address: what is joined is not compiled again.

A kernel that calls another one takes its machine code in and optimises all of it anew, which for a step of
the world takes as long as compiling it. `call` goes to the machine code that is there already.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.experimental.structref import StructRefProxy
from numba.extending import intrinsic

_FOUND: dict[tuple[object, ...], int] = {}  # numba takes 0.1 ms to find the types of arguments


def find_address(kernel: Any, *arguments: object) -> int:
    """Returns where the machine code of a kernel for arguments of these types is, compiled if need be."""
    key = (kernel, *map(describe_type, arguments))
    if key not in _FOUND:
        _FOUND[key] = _look_up(kernel, arguments)
    return _FOUND[key]


def describe_type(value: Any) -> object:
    """Returns what decides the type that numba gives a value."""
    if isinstance(value, np.ndarray):
        flags = value.flags
        return (
            value.dtype, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.writeable,
            flags.aligned,
        )  # fmt: skip
    if isinstance(value, tuple):
        return type(value), *map(describe_type, value)
    return value._numba_type_ if isinstance(value, StructRefProxy) else type(value)


def _look_up(kernel: Any, arguments: tuple[object, ...]) -> int:
    """Returns what `find_address` does, from numba."""
    kinds = tuple(kernel.typeof_pyval(value) for value in arguments)
    kernel.compile(kinds)
    compiled = kernel.overloads[kinds]
    address: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return address


@intrinsic  # type: ignore[untyped-decorator]
def call(typing: Any, address: Any, kernel: Any, arguments: Any) -> Any:
    """Calls the machine code at an address, which is that of `kernel` for arguments of these types.

    address: of `find_address`; arguments: as a tuple, each of the very type that the address was found for.
    """
    del address  # its value is known when the code runs
    signature = kernel.get_call_type(typing, tuple(arguments), {})
    if signature.args != tuple(arguments):
        raise TypeError(f"{kernel} is compiled for {signature.args}, got {arguments}")

    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        """Returns the result of the call as LLVM sees it."""
        convention = context.call_conv
        kind = convention.get_function_type(signature.return_type, signature.args)
        function = builder.inttoptr(values[0], ir.PointerType(kind))
        given = cgutils.unpack_tuple(builder, values[2])
        status, result = convention.call_function(
            builder, function, signature.return_type, signature.args, given
        )
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return result

    return signature.return_type(types.int64, kernel, arguments), generate
