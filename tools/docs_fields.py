"""Reads the columns of files from the classes and dicts that declare them, for the reference page.

The meaning of a column is the comment on the line that declares it, the `meaning` of a metric, or its
line under "Attributes:" in the docstring of its class.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cache
from types import ModuleType
from typing import Any

from skidpad.core import vocabulary

ENDINGS = {
    "_kmh": "km/h", "_km": "km", "_pct": "%", "_mps2": "m/s^2", "_m2": "m^2", "_m": "m", "_ms": "ms",
    "_deg_s": "deg/s", "_deg": "deg", "_s": "s", "_per_100_km": "1/(100 km)",
}  # fmt: skip
UNIT = re.compile(r"^(m/s\^2|m/s|rad/s|rad|deg C|deg|1/m|km/h|km|m|ms|s|N s)\b(?:[,;:] |$| (?=\w))")
SHAPE = re.compile(r"^\([^)]*\) ?")
ID = re.compile(r" \((?:[a-z ]*\b[A-Z]{1,2}-\d+(?:, | to )?)+\)")
PLAIN = {"float": "Float64", "int": "Int64", "str": "String", "bool": "Boolean"}


@dataclass(frozen=True, slots=True)
class Field:
    """One column of a table, or one key of a line of JSON."""

    name: str
    dtype: str
    meaning: str

    @property
    def unit(self) -> str:
        """Returns the unit that the name ends in, or the meaning begins with; "" where it has none."""
        for ending, unit in ENDINGS.items():
            if self.name.endswith(ending):
                return unit
        return self._split[0]

    @property
    def sentence(self) -> str:
        """Returns the meaning without the unit that it begins with."""
        return self._split[1]

    @property
    def _split(self) -> tuple[str, str]:
        """Returns the unit that the meaning begins with, and the rest."""
        found = UNIT.match(self.meaning)
        return ("", self.meaning) if found is None else (found[1], self.meaning[found.end() :])


@cache
def comments_of(source: str) -> Mapping[int, str]:
    """Returns the comment at the end of each line that has one, by line number from 1."""
    lines = enumerate(source.splitlines(), start=1)
    return {n: text.partition("  # ")[2] for n, text in lines if "  # " in text}


def class_fields(kind: type[Any], prefix: str = "") -> list[Field]:
    """Returns the annotated fields of a class and of those that it extends, each with its meaning."""
    found: dict[str, Field] = {}
    for one in reversed(kind.__mro__):
        if one.__module__.startswith("skidpad."):
            source = textwrap.dedent(inspect.getsource(one))
            tree = ast.parse(source).body[0]
            assert isinstance(tree, ast.ClassDef)
            notes = comments_of(source)
            said = attributes_of(one.__doc__ or "")
            given = metadata_of(one)
            for node in tree.body:
                if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                    name, type_ = node.target.id, ast.unparse(node.annotation)
                    note = next((notes[n] for n in lines_of(node) if n in notes), "")
                    meaning = given.get(name) or note or said.get(name, "")
                    plain = PLAIN.get(type_.removesuffix(" | None"), type_)
                    found[name] = Field(prefix + name, plain, clean(meaning) + words_of(type_))
    return list(found.values())


def lines_of(node: ast.AnnAssign) -> range:
    """Returns the lines of a declaration."""
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def clean(text: str) -> str:
    """Returns a meaning without the shape of an array, and without ids of decisions."""
    return ID.sub("", SHAPE.sub("", text)).strip().removesuffix(".")


def words_of(type_: str) -> str:
    """Returns what the numbers of an enum stand for; "" for a type of another kind."""
    kind = getattr(vocabulary, type_.removesuffix(" | None"), None)
    if not (isinstance(kind, type) and issubclass(kind, IntEnum)):
        return ""
    return ": " + ", ".join(f"{e.value} {e.name.lower().replace('_', ' ')}" for e in kind)


def metadata_of(kind: type[Any]) -> dict[str, str]:
    """Returns the meanings that the fields of a dataclass carry themselves."""
    if not hasattr(kind, "__dataclass_fields__"):
        return {}
    return {f.name: f.metadata["meaning"] for f in fields(kind) if "meaning" in f.metadata}


def attributes_of(text: str) -> dict[str, str]:
    """Returns the meanings by name of the section "Attributes:" of a docstring."""
    _, _, section = inspect.cleandoc(text).partition("Attributes:\n")
    found: dict[str, str] = {}
    names: list[str] = []
    for line in section.splitlines():
        head = re.match(r"^ {4}(\w+(?:, \w+)*): (.*)", line)
        if head:
            names = head[1].split(", ")
            found |= dict.fromkeys(names, head[2])
        elif line.startswith("        "):
            found |= {name: f"{found[name]} {line.strip()}" for name in names}
        elif line.strip():
            break
    return found


def dict_fields(module: ModuleType, name: str, more: Mapping[str, Any]) -> list[Field]:
    """Returns columns whose types a module declares in a dict; their meanings are comments beside them."""
    source = inspect.getsource(module)
    notes = comments_of(source)
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.AnnAssign | ast.Assign):
            target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
            if isinstance(target, ast.Name) and target.id == name and node.value is not None:
                keys = [k for d in ast.walk(node.value) if isinstance(d, ast.Dict) for k in d.keys]
                for key in keys:
                    assert isinstance(key, ast.Constant)
                    word = str(key.value)
                    found.append(Field(word, str(more[word]), notes.get(key.lineno, "")))
    return found


def said_fields(meanings: Mapping[str, str], types: Mapping[str, Any] | str) -> list[Field]:
    """Returns columns from a dict of meanings; types: by column, or one for all."""
    return [
        Field(name, types if isinstance(types, str) else str(types[name]), meaning)
        for name, meaning in meanings.items()
    ]
