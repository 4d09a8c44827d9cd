"""Holds kernels of the world's step to what one source for CPU and GPU needs (decision R-4).

A kernel allocates nothing (scratch room is a field of the state), uses no NumPy reductions and no
scalar ufuncs (`math` has them): of NumPy it may name constants and types only, and of an array's
methods none but `fill`.

No kernel of any package puts another value behind the pointer of a `Held`: machine code without counted
references would free what is still read.

    python tools/kernel_lint.py            lists every violation; exit status 1 when there is one
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "src" / "skidpad"
HOUSES = ("physics", "roads", "simulation")
NUMPY = frozenset(
    [
        "inf",
        "nan",
        "pi",
        "bool_",
        "float32",
        "float64",
        "int8",
        "int16",
        "int32",
        "int64",
        "uint8",
        "uint16",
        "uint32",
        "uint64",
    ]
)
METHODS = frozenset(
    [
        "all",
        "any",
        "argmax",
        "argmin",
        "argsort",
        "astype",
        "copy",
        "cumsum",
        "dot",
        "flatten",
        "max",
        "mean",
        "min",
        "nonzero",
        "prod",
        "ravel",
        "repeat",
        "round",
        "sort",
        "std",
        "sum",
        "take",
        "tolist",
        "transpose",
        "var",
    ]
)
DISPLAYS = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp, ast.GeneratorExp)


def is_kernel(node: ast.AST) -> bool:
    """Whether a function is compiled."""
    return isinstance(node, ast.FunctionDef) and any(
        isinstance(d, ast.Name) and d.id in ("kernel", "inner_kernel") for d in node.decorator_list
    )


def violations(text: str) -> Iterator[tuple[int, str]]:
    """Line and reason of all that a kernel in this source text may not do."""
    for function in filter(is_kernel, ast.walk(ast.parse(text))):
        assert isinstance(function, ast.FunctionDef)
        for statement in function.body:
            for node in ast.walk(statement):
                reason = _reason(node)
                if reason:
                    yield node.lineno, f"{function.name}: {reason}"  # type: ignore[attr-defined]


def _reason(node: ast.AST) -> str | None:
    if isinstance(node, DISPLAYS):
        return f"{type(node).__name__} allocates"
    if not isinstance(node, ast.Attribute):
        return None
    if isinstance(node.value, ast.Name) and node.value.id == "np":
        return None if node.attr in NUMPY else f"np.{node.attr}"
    return f".{node.attr}" if node.attr in METHODS else None


def writes_held(text: str) -> Iterator[tuple[int, str]]:
    """Line and reason wherever a kernel in this source text replaces the value of a `Held`."""
    for function in filter(is_kernel, ast.walk(ast.parse(text))):
        assert isinstance(function, ast.FunctionDef)
        for node in ast.walk(function):
            written = isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
            if written and node.attr == "value":  # type: ignore[attr-defined]
                yield node.lineno, f"{function.name}: .value is replaced"  # type: ignore[attr-defined]


def main() -> int:
    """Print what violates the rules."""
    files = [path for house in HOUSES for path in sorted((SOURCE / house).rglob("*.py"))]
    found = [
        f"src/skidpad/{path.relative_to(SOURCE).as_posix()}:{line}: {reason}"
        for path in files
        for line, reason in violations(path.read_text(encoding="utf-8"))
    ]
    found += [
        f"src/skidpad/{path.relative_to(SOURCE).as_posix()}:{line}: {reason}"
        for path in sorted(SOURCE.rglob("*.py"))
        for line, reason in writes_held(path.read_text(encoding="utf-8"))
    ]
    print(*found, sep="\n", end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
