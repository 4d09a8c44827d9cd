"""Elements of OpenDRIVE text and their attributes; every problem is a FileError that says where."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, sin
from typing import Any
from zlib import crc32

import numpy as np
from lxml import etree

from skidpad.core.errors import FileError
from skidpad.roads.opendrive.reference_line import Cubics

LARGEST = 1.0e15  # of any number in a file: its square and cube can be computed with
SIZE_MAX = 64 * 2**20  # bytes; the largest town that we know has 3.4 MB
NAMED = 2**30  # ids that are no numbers count from here, away from all usual numbers
Node = Any  # lxml's element


def id_number(text: str) -> int:
    """Returns the number of an id, which OpenDRIVE allows to be any text.

    What is no number of 32 bits gets one from NAMED on by its checksum, so two may meet.
    """
    try:
        number = int(text)
    except ValueError:
        number = 2**31
    return number if abs(number) < 2**31 else NAMED + crc32(text.encode()) % NAMED


@dataclass(frozen=True, slots=True)
class Shift:
    """The <offset> of a header: everything is moved, then turned about the origin."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    heading: float = 0.0

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """Returns the world's x and y in m of a point of the file."""
        c, s = cos(self.heading), sin(self.heading)
        x, y = x + self.x, y + self.y
        return x * c - y * s, x * s + y * c


class Reader:
    """Attribute access with errors that say where; `shift` is that of the file's header."""

    def __init__(self, file: str, shift: Shift = Shift()) -> None:
        self.file, self.shift = file, shift

    def fail(self, node: Node, problem: str) -> FileError:
        """Returns the FileError about a node, with file and line, for the caller to raise."""
        named = f" id={node.get('id')}" if node.get("id") is not None else ""
        return FileError(f"{self.file}, line {node.sourceline}: <{node.tag}{named}> {problem}")

    def number(self, node: Node, name: str, default: float | None = None) -> float:
        """Returns a number of a node.

        FileError when it is missing (without default) or not within LARGEST.
        """
        text = node.get(name)
        if text is None and default is not None:
            return default
        try:
            value = float(text)
        except (TypeError, ValueError):
            raise self.fail(node, f"needs a number {name}, got {text!r}") from None
        if not isfinite(value):
            raise self.fail(node, f"needs a finite {name}, got {text!r}")
        if abs(value) > LARGEST:
            raise self.fail(node, f"needs {name} up to {LARGEST:g}, got {text!r}")
        return value

    def integer(self, node: Node, name: str, default: int | None = None) -> int:
        """Returns a whole number that fits 32 bits.

        FileError for another, or when missing without default.
        """
        text = node.get(name)
        if text is None and default is not None:
            return default
        try:
            value = int(text)
        except (TypeError, ValueError):
            raise self.fail(node, f"needs a whole number {name}, got {text!r}") from None
        if abs(value) >= 2**31:
            raise self.fail(node, f"needs {name} below 2^31, got {text!r}")
        return value

    def id(self, node: Node, name: str = "id", default: str | None = None) -> int:
        """Returns an id as a number (`id_number`); FileError where it is missing without default."""
        text = node.get(name, default)
        if text is None:
            raise self.fail(node, f"needs {name}")
        return id_number(text)

    def cubics(self, nodes: list[Node], start: str = "s") -> Cubics:
        """Returns records with attributes a, b, c, d as one function; zero everywhere when there are none."""
        if not nodes:
            return Cubics.none()
        rows = sorted(
            [self.number(n, start), *(self.number(n, k, 0.0) for k in "abcd")] for n in nodes
        )
        table = np.array(rows)
        return Cubics(table[:, 0], table[:, 1:])

    def speed(self, node: Node) -> float | None:
        """Returns the m/s of a <speed>, m/s without a unit; None for "no limit" and "undefined".

        FileError for another unit.
        """
        if node.get("max") in ("no limit", "undefined"):
            return None
        factor = {"km/h": 1 / 3.6, "mph": 0.44704, "m/s": 1.0, None: 1.0}
        unit = node.get("unit")
        if unit not in factor:
            raise self.fail(node, f"has unknown unit {unit!r}; allowed: km/h, mph, m/s")
        return self.number(node, "max") * factor[unit]


def _without_namespace(root: Node) -> None:
    """Renames all elements in place as the standard has them, where a tool has put them into a namespace."""
    for element in root.iter("{*}*"):
        element.tag = etree.QName(element).localname


def parse_root(text: bytes, file: str) -> Node:
    """Returns the root of an OpenDRIVE file, read without entities, networks or huge trees.

    FileError for more than SIZE_MAX bytes, what is not XML or not OpenDRIVE, and a document type.
    """
    if len(text) > SIZE_MAX:
        raise FileError(f"{file}: {len(text)} bytes are more than the allowed {SIZE_MAX}")
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
    try:
        root = etree.fromstring(text, parser)
    except etree.XMLSyntaxError as error:
        raise FileError(f"{file}: not XML: {' '.join(str(error).split())}") from None
    if str(root.tag).endswith("}OpenDRIVE"):
        _without_namespace(root)
    if root.tag != "OpenDRIVE":
        raise FileError(f"{file}: not OpenDRIVE, its root element is <{root.tag}>")
    if root.getroottree().docinfo.internalDTD is not None:
        raise FileError(f"{file}: a document type declaration is not allowed")
    return root
