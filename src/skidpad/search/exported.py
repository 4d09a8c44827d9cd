"""The XML of an exported hazard: one channel's world of it, and parameters in place of what was recorded."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, hypot, inf, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from skidpad.core.errors import FileError
from skidpad.core.maths.space import Uniform, Variable
from skidpad.scenarios.reading.entities import GHOST

Element = ElementTree.Element
SPEED, AHEAD, PACE, CRUISE = "EgoSpeed", "EgoAhead", "OthersPace", "CruiseSpeed"
SPEED_SHARE = 0.2  # of the recorded speed to either side; assumption
AHEAD_MOST = 10.0  # m to either side, at most half of the way to the nearest other; assumption
PACE_SHARE = 0.2  # of the recorded pace to either side; assumption
SLOWEST = 1.0  # m/s, an ego below it is standing: its speed does not vary
Way = list[tuple[float, float, float, float]]  # t, x, y, heading


class ExportedHazard:
    """The XML of an exported hazard."""

    def __init__(self, root: Element, source: Path) -> None:
        self.root, self.source = root, source
        egos = [e for e in self._objects() if _property(e, "type") == "ego_vehicle"]
        if not egos:
            raise FileError(f"{source}: has no ego; is it a .xosc of `skidpad hazards export`?")
        self.ego = egos[0].attrib["name"]
        self.channel = _property(egos[0], "channel")
        header = root.find("FileHeader")
        if header is None or int(header.get("revMinor", "0")) < 1:
            raise FileError(
                f"{source}: is OpenSCENARIO 1.0, a search needs --osc 1.2 of the export"
            )

    def _objects(self) -> list[Element]:
        """Returns the elements of all scenario objects of the file."""
        return self.root.findall("Entities/ScenarioObject")

    def keep_one_world(self) -> None:
        """Takes out, in place, what other channels saw, and other egos; FileError where no other is left."""
        for thing in self._objects():
            name = thing.attrib["name"]
            is_other_ego = _property(thing, "type") == "ego_vehicle" and name != self.ego
            is_ghost = _property(thing, GHOST) == "true"
            if not (is_other_ego or is_ghost or _property(thing, "channel") != self.channel):
                continue
            self._take_out(name)
            entities = self.root.find("Entities")
            assert entities is not None
            entities.remove(thing)
        if len(self._objects()) < 2:
            raise FileError(f"{self.source}: has no other road user that could be met")

    def _take_out(self, name: str) -> None:
        """Removes the Init actions and the manoeuvre groups of an entity."""
        actions = self.root.find("Storyboard/Init/Actions")
        assert actions is not None
        for part in list(actions):
            if part.get("entityRef") == name or part.find(f".//*[@entityRef='{name}']") is not None:
                actions.remove(part)
        for act in self.root.iter("Act"):
            for group in act.findall("ManeuverGroup"):
                if group.find(f"Actors/EntityRef[@entityRef='{name}']") is not None:
                    act.remove(group)

    def _group(self, name: str) -> Element | None:
        """Returns the manoeuvre group of an entity; None where it has none."""
        path = f".//ManeuverGroup/Actors/EntityRef[@entityRef='{name}']/../.."
        return self.root.find(path)

    def ego_way(self) -> Way:
        """Returns the recorded way of the ego; FileError without two places."""
        group = self._group(self.ego)
        way = [] if group is None else list(_vertices(group))
        if len(way) < 2:
            raise FileError(f"{self.source}: its ego has no recorded way to begin from")
        return way

    def add_parameters(self, way: Way) -> tuple[tuple[Variable, ...], dict[str, float]]:
        """Declares the parameters and uses them, in place, so that the ego is left to its driver.

        Returns how they vary, and their values as recorded. way: of `ego_way`.
        """
        (t, x, y, h), speed = way[0], self._first_speed()
        mean = hypot(way[-1][1] - x, way[-1][2] - y) / max(way[-1][0] - t, 1e-3)
        values = {SPEED: speed, AHEAD: 0.0, PACE: 1.0, CRUISE: max(speed, mean, SLOWEST)}
        reach = min(AHEAD_MOST, 0.5 * self._nearest(x, y))
        laws = {
            AHEAD: Uniform(-reach, reach),
            PACE: Uniform(1.0 - PACE_SHARE, 1.0 + PACE_SHARE),
        }
        if speed >= SLOWEST:
            laws = {SPEED: Uniform((1 - SPEED_SHARE) * speed, (1 + SPEED_SHARE) * speed), **laws}
        self._declare(values)
        self._use(x, y, h)
        return tuple(Variable(name, law) for name, law in laws.items()), values

    def _first_speed(self) -> float:
        """Returns the ego's initial speed in m/s, at least 0; 0.0 where the file gives none."""
        one = self.root.find(f"Storyboard/Init/Actions/Private[@entityRef='{self.ego}']")
        target = None if one is None else one.find(".//AbsoluteTargetSpeed")
        return 0.0 if target is None else max(float(target.attrib["value"]), 0.0)

    def _nearest(self, x: float, y: float) -> float:
        """Returns the m from the ego's place to the nearest other's; inf without one.

        Less 5 m for both bodies, at least 0.5.
        """
        nearest = inf
        for part in self.root.findall("Storyboard/Init/Actions/Private"):
            place = part.find(".//WorldPosition")
            if part.get("entityRef") != self.ego and place is not None:
                away = hypot(float(place.attrib["x"]) - x, float(place.attrib["y"]) - y)
                nearest = min(nearest, max(away - 5.0, 0.5))
        return nearest

    def _declare(self, values: dict[str, float]) -> None:
        """Declares the parameters with their values, and sets the file's version to 1.2."""
        header = self.root.find("FileHeader")
        declared = self.root.find("ParameterDeclarations")
        assert header is not None
        header.set("revMinor", "2")
        if declared is None:
            declared = Element("ParameterDeclarations")
            self.root.insert(1, declared)
        for name, value in values.items():
            ElementTree.SubElement(
                declared, "ParameterDeclaration", name=name, parameterType="double", value=f"{value:.9g}"
            )  # fmt: skip

    def _use(self, x: float, y: float, h: float) -> None:
        """Makes the ego's place, its speeds and the others' times depend on the declared parameters."""
        ego = next(o for o in self._objects() if o.attrib["name"] == self.ego)
        properties = ego.find(".//Properties")
        assert properties is not None
        ElementTree.SubElement(properties, "Property", name="cruise_speed", value=f"${CRUISE}")
        for act in self.root.iter("Act"):
            for group in act.findall("ManeuverGroup"):
                if group is self._group(self.ego):
                    act.remove(group)
        init = self.root.find(f"Storyboard/Init/Actions/Private[@entityRef='{self.ego}']")
        assert init is not None
        place, target = init.find(".//WorldPosition"), init.find(".//AbsoluteTargetSpeed")
        assert place is not None
        assert target is not None
        place.set("x", f"${{{x:.3f} + ${AHEAD} * {cos(h):.6f}}}")
        place.set("y", f"${{{y:.3f} + ${AHEAD} * {sin(h):.6f}}}")
        target.set("value", f"${SPEED}")
        for group in self.root.iter("ManeuverGroup"):
            for timing in group.iter("Timing"):
                timing.set("scale", f"${{1 / ${PACE}}}")
            for clock in group.iter("SimulationTimeCondition"):
                if float(clock.attrib["value"]) > 0.0:
                    clock.set("value", f"${{{clock.attrib['value']} / ${PACE}}}")


def _property(thing: Element, name: str) -> str:
    """Returns the value of a property of an object; empty text where it has none."""
    found = thing.find(f".//Property[@name='{name}']")
    return "" if found is None else found.get("value", "")


def _vertices(group: Element) -> Iterator[tuple[float, float, float, float]]:
    """Yields (time in s, x, y in m, heading in rad) of each vertex of a manoeuvre group."""
    for vertex in group.iter("Vertex"):
        place: Any = vertex.find(".//WorldPosition")
        if place is not None:
            x, y, h = (float(place.get(key, "0")) for key in "xyh")
            yield float(vertex.attrib["time"]), x, y, h
