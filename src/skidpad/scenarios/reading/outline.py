"""An element of a scenario file in one line, for people."""

from __future__ import annotations

from itertools import islice

from skidpad.scenarios.reading.document import Node

PARTS_MAX = 8  # elements inside that are shown, such as vertices of a trajectory


def describe_element(node: Node) -> str:
    """Returns the name and attributes of an element, then in brackets those of what is inside."""
    while not node.element.attrib and len(node.element) == 1:
        (inside,) = node.children()
        if not inside.tag.endswith(("Action", "Condition")):
            break
        node = inside
    below = node.element.iterdescendants("*")
    named = (Node(e, node.file, node.values) for e in below if e.attrib or not len(e))
    parts = [_describe_alone(part) for part in islice(named, PARTS_MAX + 1)]
    if len(parts) > PARTS_MAX:
        parts[PARTS_MAX] = "..."
    return _describe_alone(node) + (f" [{'; '.join(parts)}]" if parts else "")


def _describe_alone(node: Node) -> str:
    """Returns an element's name with its attributes, parameters filled in."""
    return " ".join(
        [
            node.tag,
            *(f"{name}={node.format_attribute(name)}" for name in map(str, node.element.attrib)),
        ]
    )
