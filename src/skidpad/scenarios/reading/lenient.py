"""`--lenient`: what the schema refuses but whose meaning is clear is filled in, with a warning."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping

from lxml import etree

from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Finding, Kind

ZERO: Mapping[str, tuple[str, ...]] = {  # attributes whose absence can only mean 0
    "RelativeWorldPosition": ("dx", "dy"),
    "RelativeObjectPosition": ("dx", "dy"),
    "RelativeLanePosition": ("dLane",),
    "RelativeRoadPosition": ("ds", "dt"),
}
NOTHING = "None"  # a value that some generators write for one that they do not have
OFFSET = "targetLaneOffset"  # of a lane change, which may be absent


def fill_in(root: Node, given: Collection[str]) -> Iterator[Finding]:
    """Adds what is missing to the tree, and yields a warning for each; only as far as it is iterated.

    given: parameters that have a value from outside, whatever the file says.
    """
    yield from _without_offsets(root, given)
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


def _without_offsets(root: Node, given: Collection[str]) -> Iterator[Finding]:
    """Takes away offsets of lane changes that are `None`, and the parameters that are nothing else."""
    declared = root.element.findall("ParameterDeclarations/ParameterDeclaration")
    nothing = {
        d.get("name", "").removeprefix("$"): d for d in declared if d.get("value") == NOTHING
    }
    nothing = {name: d for name, d in nothing.items() if name not in given}
    for element in root.element.iter("LaneChangeAction"):
        if element.get(OFFSET) in (NOTHING, *(f"${name}" for name in nothing)):
            del element.attrib[OFFSET]
            node = Node(element, root.file, root.values)
            yield node.finding(f"{OFFSET} is {NOTHING}: read as no offset", Kind.SCHEMA)
    others = [e for e in root.element.iter("*") if e not in declared]
    values = {str(value) for element in others for value in element.attrib.values()}
    used = {name for value in values if value.startswith("$") for name in re.findall(r"\w+", value)}
    for name, declaration in nothing.items():
        above = declaration.getparent()
        if above is not None and name not in used:
            above.remove(declaration)
