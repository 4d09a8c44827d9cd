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
NOTHING = "None"  # a value that some generators write for one that they do not have
OFFSET = "targetLaneOffset"  # of a lane change, which may be absent


def fill_in(root: Node) -> Iterator[Finding]:
    """Adds what is missing to the tree, and yields a warning for each; only as far as it is iterated."""
    yield from _without_offsets(root)
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


def _without_offsets(root: Node) -> Iterator[Finding]:
    """Takes away offsets of lane changes that are `None`, and the parameters that are nothing else."""
    declared = root.element.findall("ParameterDeclarations/ParameterDeclaration")
    nothing = {
        f"${d.get('name', '').lstrip('$')}": d for d in declared if d.get("value") == NOTHING
    }
    for element in root.element.iter("LaneChangeAction"):
        if element.get(OFFSET) in (NOTHING, *nothing):
            del element.attrib[OFFSET]
            node = Node(element, root.file, root.values)
            yield node.finding(f"{OFFSET} is {NOTHING}: read as no offset", Kind.SCHEMA)
    others = [e for e in root.element.iter("*") if e not in declared]
    used = {str(value) for element in others for value in element.attrib.values()}
    for name, declaration in nothing.items():
        above = declaration.getparent()
        if above is not None and not any(name in value for value in used):
            above.remove(declaration)
