"""Small changes of a source text, one at a time: what mutation testing asks the tests to notice.

Left out: docstrings and other texts, annotations, imports, decorators, defaults of parameters, names
at the top of a module, blocks for the type checker, and compiled kernels.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

KERNEL = re.compile(r"@(inner_)?kernel\b")
COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
CALCULATED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult, ast.Pow: ast.Mult,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change: the characters `start` to `end` of a text (in UTF-8) become `new`."""

    line: int
    start: int
    end: int
    old: str
    new: str

    def apply(self, text: str) -> str:
        """Returns the text with this change."""
        raw = text.encode()
        return (raw[: self.start] + self.new.encode() + raw[self.end :]).decode()


def find_mutants(text: str) -> list[Mutant]:
    """Returns every change of a module's text, in the order of its places."""
    raw = text.encode()
    begins = [0]
    for line in raw.splitlines(keepends=True):
        begins.append(begins[-1] + len(line))
    found = []
    for function in _functions(ast.parse(text)):
        for node in _nodes(function):
            for new in _changes(node):
                start = begins[node.lineno - 1] + node.col_offset
                end = begins[node.end_lineno - 1] + node.end_col_offset  # type: ignore[operator]
                put = f"({new})" if isinstance(node, ast.expr) else new
                found.append(Mutant(node.lineno, start, end, raw[start:end].decode(), put))
    return sorted(found, key=lambda m: (m.start, m.end, m.new))


def _functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Yields functions of a module and of its classes, without compiled and overloaded ones."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            words = " ".join(f"@{ast.unparse(d)}" for d in node.decorator_list)
            if not KERNEL.search(words) and "overload" not in words:
                yield node
        elif isinstance(node, ast.ClassDef):
            yield from _functions(node)


def _nodes(function: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[ast.expr | ast.stmt]:
    """Yields what may be changed in a function's body."""
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            waiting += node.body
            continue
        if isinstance(node, ast.AnnAssign):
            waiting += [node.value] if node.value else []
            continue
        # places within f-strings are wrong before Python 3.12
        if isinstance(node, ast.Import | ast.ImportFrom | ast.JoinedStr):
            continue
        waiting += ast.iter_child_nodes(node)
        if isinstance(node, ast.expr | ast.stmt):
            yield node


def _changes(node: ast.expr | ast.stmt) -> Iterator[str]:
    """Yields the texts that may stand in place of a node."""
    match node:
        case ast.Compare(ops=[op], left=left, comparators=right) if type(op) in COMPARED:
            yield ast.unparse(ast.Compare(left, [COMPARED[type(op)]()], right))
        case ast.BinOp(op=op, left=a, right=b) if type(op) in CALCULATED and not _is_text(a, b):
            yield ast.unparse(ast.BinOp(a, CALCULATED[type(op)](), b))
        case ast.BoolOp(op=op, values=values):
            yield ast.unparse(
                ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
            )
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield ast.unparse(operand)
        case ast.IfExp(test=test, body=body, orelse=other):
            yield ast.unparse(ast.IfExp(test, other, body))
        case ast.Constant(value=bool() as value):
            yield str(not value)
        case ast.Constant(value=int() | float() as value):
            yield repr(value + 1)
        case ast.Return(value=value) if value is not None and not _is_none(value):
            yield "return None"
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Raise() | ast.Continue():
            yield "pass"
        case ast.Break():
            yield "continue"
        case _:
            return


def _is_text(*nodes: ast.expr) -> bool:
    """Returns whether one of the nodes is a text: `+` between texts has no `-`."""
    return any(
        isinstance(n, ast.JoinedStr) or (isinstance(n, ast.Constant) and isinstance(n.value, str))
        for n in nodes
    )


def _is_none(node: ast.expr) -> bool:
    """Returns whether a node is the constant None."""
    return isinstance(node, ast.Constant) and node.value is None
