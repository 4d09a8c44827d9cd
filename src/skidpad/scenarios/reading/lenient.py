"""`--lenient`: what the schema refuses but whose meaning is clear is filled in, with a warning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from lxml import etree

from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Finding, Kind

ZERO: Mapping[str, tuple[str, ...]] = {  # attributes whose absence can only mean 0
    "RelativeWorldPosition": ("dx", "dy"),
    "RelativeObjectPosition": ("dx", "dy"),
    "RelativeLanePosition": ("dLane",),
    "RelativeRoadPosition": ("ds", "dt"),
}


def fill_in(root: Node) -> Iterator[Finding]:
    """Adds what is missing to the tree, and yields a warning for each; only as far as it is iterated."""
    for element in root.element.iter("ManeuverGroup", *ZERO):
        node = Node(element, root.file, root.values)
        if node.tag == "ManeuverGroup":
            if node.find("Actors") is None:
                actors = etree.Element("Actors", selectTriggeringEntities="false")
                element.insert(0, actors)
                yield node.finding("has no <Actors>: only actions of the world happen", Kind.SCHEMA)
            continue
        for name in ZERO[node.tag]:
            if not node.has(name):
                element.set(name, "0")
                yield node.finding(f"has no attribute {name}: read as 0", Kind.SCHEMA)
