"""OpenSCENARIO XML as elements with parameters filled in; what is wrong is named by line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar

from lxml import etree

from skidpad.core.errors import FileError
from skidpad.scenarios.reading.expressions import ExpressionError, evaluate
from skidpad.scenarios.reading.findings import Fault, Finding, Kind
from skidpad.scenarios.reading.older import renew

SIZE_MAX = 64_000_000  # bytes
TRUE, FALSE = ("true", "1"), ("false", "0")
Choice = TypeVar("Choice", bound=Enum)
Made = TypeVar("Made")


@dataclass(frozen=True, slots=True)
class Node:
    """One element; attributes are read through it, with `$parameters` and expressions filled in."""

    element: etree._Element
    file: Path
    values: Mapping[str, str]  # parameters in scope, by name

    @property
    def tag(self) -> str:
        """Returns the name of the XML element."""
        return str(self.element.tag)

    @property
    def line(self) -> int:
        """Returns the line in the file, from 1."""
        line: Any = self.element.sourceline
        return int(line or 0)

    def finding(self, what: str, kind: Kind = Kind.ERROR) -> Finding:
        """Returns a finding about this element."""
        return Finding(self.file.name, self.line, self.tag, what, kind)

    def error(self, what: str) -> Fault:
        """Returns the fault to raise about something wrong in this element."""
        return Fault(self.finding(what))

    def unsupported_fault(self, what: str = "") -> Fault:
        """Returns the fault to raise about an element that is sound, but unknown here."""
        text = what or f"<{self.tag}> is not supported"
        return Fault(self.finding(text, Kind.UNSUPPORTED))

    def choose(self, table: Mapping[str, Made]) -> Made:
        """Returns what a table has for this element's name; raises a Fault "not supported" for others."""
        if self.tag not in table:
            raise self.unsupported_fault()
        return table[self.tag]

    def with_parameters(self, values: Mapping[str, str]) -> Node:
        """Returns the same element with other parameters in scope."""
        return replace(self, values=values)

    def children(self, *tags: str) -> Iterator[Node]:
        """Yields the child elements, all or those with one of these names."""
        for child in self.element.iterchildren(*(tags or ("*",))):
            yield Node(child, self.file, self.values)

    def find(self, *path: str) -> Node | None:
        """Returns the first descendant along a path of names; None where there is none."""
        found: etree._Element | None = self.element
        for tag in path:
            found = None if found is None else found.find(tag)
        return None if found is None else Node(found, self.file, self.values)

    def child(self, *path: str) -> Node:
        """Returns the first descendant along a path of names; raises a Fault where there is none."""
        found = self.find(*path)
        if found is None:
            raise self.error(f"needs <{'/'.join(path)}>")
        return found

    def only(self) -> Node:
        """Returns the single child of a choice such as <Position>; raises a Fault for none or more."""
        children = list(self.children())
        if len(children) != 1:
            raise self.error(f"needs exactly one child element, has {len(children)}")
        return children[0]

    def has(self, name: str) -> bool:
        """Returns whether the node has that attribute."""
        return self.element.get(name) is not None

    def label(self) -> str:
        """Returns the attribute `name` as it is shown to people."""
        return self.format_attribute("name")

    def format_attribute(self, name: str) -> str:
        """Returns an attribute as it is shown to people; what cannot be worked out stays as it is."""
        raw = self.element.get(name, "")
        try:
            return self.text(name, "")
        except Fault:
            return raw

    def plain(self, name: str) -> str:
        """Returns an attribute that names a parameter, without its `$`; a Fault where it is missing."""
        value = self.element.get(name)
        if value is None:
            raise self.error(f"needs the attribute {name}")
        return value.removeprefix("$")

    def text(self, name: str, default: str | None = None) -> str:
        """Returns an attribute, its parameter or expression filled in.

        A Fault when it is missing and there is no default.
        """
        value = self.element.get(name)
        if value is None:
            if default is None:
                raise self.error(f"needs the attribute {name}")
            return default
        return self.fill_parameters(value, name) if "$" in value else value

    def fill_parameters(self, value: str, name: str) -> str:
        """Returns a text with its parameter or expression replaced; name: of the attribute, for faults."""
        if value.startswith("${") and value.endswith("}"):
            try:
                return evaluate(value[2:-1], self.values)
            except ExpressionError as error:
                raise self.error(f"{name}: {value}: {error}") from None
        if not value.startswith("$"):
            return value
        if value[1:] in self.values:
            return self.values[value[1:]]
        if value[1:].isidentifier():
            raise self.error(f"{name}: parameter {value!r} is not declared")
        return value  # no reference by the pattern of the schema, such as `$a,$b,255`

    def number(self, name: str, default: float | None = None) -> float:
        """Returns an attribute as a finite number; raises a Fault for anything else."""
        value = self.limit(name, default)
        if not isfinite(value):
            raise self.error(f"{name} must be finite, got {value!r}")
        return value

    def limit(self, name: str, default: float | None = None) -> float:
        """Returns an attribute as a number that may be infinite; raises a Fault for any other text."""
        text = self.text(name, None if default is None else repr(default))
        try:
            value = float(text)
        except ValueError:
            raise self.error(f"{name} must be a number, got {text!r}") from None
        if value != value:
            raise self.error(f"{name} must be a number, got {text!r}")
        return value

    def whole(self, name: str, default: int | None = None) -> int:
        """Returns an attribute as a whole number; raises a Fault for anything else."""
        value = self.number(name, None if default is None else float(default))
        if value != int(value):
            raise self.error(f"{name} must be a whole number, got {value:g}")
        return int(value)

    def choice(self, name: str, allowed: type[Choice], default: Choice | None = None) -> Choice:
        """Returns an attribute as one of the values that are known; a Fault "not supported" for others."""
        text = self.text(name, None if default is None else default.value)
        try:
            return allowed(text)
        except ValueError:
            known = ", ".join(str(c.value) for c in allowed)
            raise self.unsupported_fault(
                f"{name}={text!r} is not supported, only {known}"
            ) from None

    def flag(self, name: str, default: bool) -> bool:
        """Returns an attribute that is `true` or `false`, or 1 or 0; raises a Fault for anything else."""
        value = self.text(name, "true" if default else "false").lower()
        if value not in TRUE + FALSE:
            raise self.error(f"{name} must be true or false, got {value!r}")
        return value in TRUE


def _plain(info: Any) -> bool:
    """Returns whether a document type holds nothing but short texts, which name no others."""
    if info.public_id or info.system_url or info.internalDTD is None:
        return False
    texts = [e.content for e in info.internalDTD.iterentities()]
    return all(t is not None and len(t) <= 200 and not set("&%") & set(t) for t in texts)


def parse(path: Path) -> Node:
    """Returns the root element of a file, without parameters; FileError when it is no OpenSCENARIO XML.

    A file of 0.9 gets the names of 1.0.
    """
    if path.suffix == ".osc":
        raise FileError(
            f"scenario {path}: OpenSCENARIO DSL (2.x, .osc) is not supported; "
            "Skidpad plays OpenSCENARIO XML (.xosc)"
        )
    try:
        text = path.read_bytes()
    except OSError as error:
        raise FileError(f"scenario {path}: cannot be read: {error.strerror}") from None
    if len(text) > SIZE_MAX:
        raise FileError(f"scenario {path}: {len(text)} bytes are more than {SIZE_MAX}")
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True,
        remove_pis=True,
    )  # fmt: skip
    try:
        root = etree.fromstring(text, parser)
    except etree.XMLSyntaxError as error:
        raise FileError(f"scenario {path}: not XML: {error.msg}") from None
    info: Any = root.getroottree().docinfo
    if info.doctype and not _plain(info):
        raise FileError(f"scenario {path}: a document type that names other files or entities")
    if root.tag != "OpenSCENARIO":
        raise FileError(f"scenario {path}: the root is <{root.tag}>, not <OpenSCENARIO>")
    header = root.find("FileHeader")
    if header is not None and header.get("revMajor") == "0":
        renew(root)
    return Node(root, path, {})


def holds(file: Path, tag: str) -> bool:
    """Returns whether a file has this element under its root; False for what cannot be read."""
    try:
        return parse(file).find(tag) is not None
    except FileError:
        return False
