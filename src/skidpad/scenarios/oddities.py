"""What a file says that can be read, but is hardly meant: one note each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import LOCK_MAX
from skidpad.scenarios.reading.findings import Fault, Finding, Kind

V_MAX = 150.0  # m/s, 540 km/h: faster is no road vehicle


def oddities(root: Node) -> Iterator[Finding]:
    """Yields a note for every absurd speed, count of zero and negative time or distance."""
    for element in root.element.iter(*LOOKS):
        node = Node(element, root.file, root.values)
        try:
            what = LOOKS[node.tag](node)
        except Fault:
            continue  # is reported where it is compiled, or depends on a nested parameter
        if what:
            yield node.finding(what, Kind.NOTE)


def _speed(node: Node) -> str:
    """Returns a remark on a speed above `V_MAX` in m/s; empty where there is none."""
    name = "speed" if node.tag == "SpeedProfileEntry" else "value"
    v = node.number(name) if node.has(name) else 0.0
    return f"{name}: {v:g} m/s is faster than any road vehicle" if abs(v) > V_MAX else ""


def _count(node: Node) -> str:
    """Returns a remark on a maximumExecutionCount of 0 or less; empty where there is none."""
    if node.whole("maximumExecutionCount", 1) > 0:
        return ""
    how = "it never begins" if node.tag == "Event" else "it is carried out once all the same"
    return f"maximumExecutionCount is {node.text('maximumExecutionCount')}: {how}"


def _dynamics(node: Node) -> str:
    """Returns a remark on a negative time or distance of a transition; empty where there is none."""
    if not node.has("value") or node.text("dynamicsShape", "") == "step":
        return ""
    value, dimension = node.number("value"), node.text("dynamicsDimension", "")
    if dimension == "rate" or value >= 0.0:
        return ""
    return f"value: a {dimension} of {value:g} is read as a step"


def _front_axle(node: Node) -> str:
    """Returns a remark on a maxSteering angle in rad out of range; empty where there is none."""
    angle = node.number("maxSteering", 0.0)
    if 0.0 <= angle < LOCK_MAX:
        return ""
    what = f"maxSteering: {angle:g} must be between 0 and {LOCK_MAX:g} rad"
    return f"{what}; that of the usual vehicle is taken"


LOOKS: Mapping[str, Callable[[Node], str]] = {
    "AbsoluteTargetSpeed": _speed,
    "AbsoluteSpeed": _speed,
    "SpeedProfileEntry": _speed,
    "Event": _count,
    "ManeuverGroup": _count,
    "FrontAxle": _front_axle,
    "SpeedActionDynamics": _dynamics,
    "LaneChangeActionDynamics": _dynamics,
}
