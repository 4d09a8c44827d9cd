"""Reads an OpenSCENARIO XML file; whatever is wrong with it is named by file, element and line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from lxml import etree

from skidpad.core.errors import FileError

SIZE_MAX = 64_000_000  # bytes
VERSIONS = ("0", "1", "2", "3")  # of OpenSCENARIO XML 1
TRUE, FALSE = ("true", "1"), ("false", "0")


class Unsupported(FileError):
    """The file is sound, but this player does not know the element or value."""

    def __init__(self, node: Node, what: str = "") -> None:
        self.line, self.element = node.line, node.tag
        self.what = what or f"<{node.tag}> is not supported"
        super().__init__(f"{node.where}: {self.what}")


@dataclass(frozen=True)
class Node:
    """One element; attributes are read through it, with `$parameters` filled in."""

    element: etree._Element
    file: str
    values: Mapping[str, str]

    @property
    def tag(self) -> str:
        """Name of the element."""
        return str(self.element.tag)

    @property
    def line(self) -> int:
        """In the file, from 1."""
        line: Any = self.element.sourceline
        return int(line or 0)

    @property
    def where(self) -> str:
        """For messages."""
        return f"{self.file}, line {self.line}, <{self.tag}>"

    def error(self, what: str) -> FileError:
        """Something in this element is wrong."""
        return FileError(f"{self.where}: {what}")

    def children(self, tag: str | None = None) -> Iterator[Node]:
        """Child elements, all or those with this name."""
        for child in self.element.iterchildren(tag or "*"):
            yield Node(child, self.file, self.values)

    def find(self, *path: str) -> Node | None:
        """The first descendant along a path of names."""
        node: Node | None = self
        for tag in path:
            node = None if node is None else next(node.children(tag), None)
        return node

    def child(self, *path: str) -> Node:
        """The same; FileError when it is missing."""
        found = self.find(*path)
        if found is None:
            raise self.error(f"needs <{'/'.join(path)}>")
        return found

    def only(self) -> Node:
        """The single child of a choice such as <Position>."""
        children = list(self.children())
        if len(children) != 1:
            raise self.error(f"needs exactly one child element, has {len(children)}")
        return children[0]

    def text(self, name: str, default: str | None = None) -> str:
        """An attribute; FileError when it is missing and there is no default."""
        value = self.element.get(name)
        if value is None:
            if default is None:
                raise self.error(f"needs the attribute {name}")
            return default
        return self._filled(name, value)

    def _filled(self, name: str, value: str) -> str:
        if value.startswith("${"):
            raise Unsupported(self, f"{name}: expressions such as {value!r} are not supported")
        if not value.startswith("$"):
            return value
        if value[1:] not in self.values:
            raise self.error(f"{name}: parameter {value!r} is not declared")
        return self.values[value[1:]]

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number."""
        text = self.text(name, None if default is None else repr(default))
        try:
            value = float(text)
        except ValueError:
            raise self.error(f"{name} must be a number, got {text!r}") from None
        if not isfinite(value):
            raise self.error(f"{name} must be finite, got {text!r}")
        return value

    def choice(self, name: str, allowed: tuple[str, ...], default: str | None = None) -> str:
        """One of the values that this player knows."""
        value = self.text(name, default)
        if value not in allowed:
            raise Unsupported(self, f"{name}={value!r} is not supported, only {', '.join(allowed)}")
        return value

    def flag(self, name: str, default: bool) -> bool:
        """`true` or `false`."""
        value = self.text(name, "true" if default else "false")
        if value not in TRUE + FALSE:
            raise self.error(f"{name} must be true or false, got {value!r}")
        return value in TRUE


def read(path: Path, parameters: Mapping[str, float | str] | None = None) -> Node:
    """The root element, with the file's parameters, some of them overridden."""
    try:
        text = path.read_bytes()
    except OSError as error:
        raise FileError(f"scenario {path}: cannot be read: {error.strerror}") from None
    if len(text) > SIZE_MAX:
        raise FileError(f"scenario {path}: {len(text)} bytes are more than {SIZE_MAX}")
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.fromstring(text, parser)
    except etree.XMLSyntaxError as error:
        raise FileError(f"scenario {path}: not XML: {error.msg}") from None
    info: Any = root.getroottree().docinfo
    if info.doctype:
        raise FileError(f"scenario {path}: a document type is not allowed")
    if root.tag != "OpenSCENARIO":
        raise FileError(f"scenario {path}: the root is <{root.tag}>, not <OpenSCENARIO>")
    plain = Node(root, path.name, {})
    header = plain.child("FileHeader")
    header.choice("revMajor", ("1",))
    header.choice("revMinor", VERSIONS)
    return Node(root, path.name, _parameters(plain, parameters or {}))


def _parameters(root: Node, given: Mapping[str, float | str]) -> dict[str, str]:
    declared = root.find("ParameterDeclarations")
    values = {}
    for node in declared.children("ParameterDeclaration") if declared else ():
        values[node.text("name")] = node.text("value")
    for name, value in given.items():
        if name not in values:
            known = ", ".join(values) or "none"
            raise FileError(f"{root.file} declares no parameter {name!r}; it has {known}")
        values[name] = value if isinstance(value, str) else repr(float(value))
    return values
