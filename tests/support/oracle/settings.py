"""Roads, entities and begins of the files for reference trajectories."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

from support.scenarios.files import (
    FILE,
    condition,
    event,
    init,
    on_lane,
    pedestrian,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    vehicle,
)

NORTH, WEST = pi / 2, pi
BEGIN = 0.975  # s


@dataclass(frozen=True)
class Case:
    """One file: its name, its road, and the parts of its text."""

    name: str
    road: str
    parts: dict[str, str] = field(default_factory=dict)
    end: float = 10.0

    def text(self) -> str:
        values = {
            "minor": 2,
            "parameters": "",
            "variables": "",
            "catalogs": "",
            "road": f'<LogicFile filepath="{self.road}.xodr"/>',
            "stop": condition(time(self.end - 0.025)),
        } | self.parts
        return FILE.format(**values)


def moving(name: str, place: str, v: float, *more: str) -> str:
    return init(name, teleport(place), speed(to(v)), *more)


def turned(lane: int, s: float, h: float, offset: float = 0.0) -> str:
    """A place on a lane with a heading against it."""
    return f"""<LanePosition roadId="1" laneId="{lane}" s="{s}" offset="{offset}">
<Orientation type="relative" h="{h}"/></LanePosition>"""


# name of a setting: road, kind of the other one, where ego and other begin and how fast
SETTINGS: dict[str, tuple[str, bool, str, str]] = {
    "straight": (
        "straight",
        False,
        moving("ego", on_lane(-2, 100), 12),
        moving("other", on_lane(-1, 130), 10),
    ),
    "curve": (
        "curve",
        False,
        moving("ego", on_lane(-2, 60), 12),
        moving("other", on_lane(-1, 90), 10),
    ),
    "arc": (
        "curve",
        False,
        moving("ego", on_lane(-2, 150), 12),
        moving("other", on_lane(-1, 180), 10),
    ),
    "hill": (
        "hill",
        False,
        moving("ego", on_lane(-2, 60), 12),
        moving("other", on_lane(-1, 90), 10),
    ),
    "banked": (
        "banked",
        False,
        moving("ego", on_lane(-2, 60), 12),
        moving("other", on_lane(-1, 90, 1.3), 10),
    ),
    "oncoming": (
        "straight",
        False,
        moving("ego", on_lane(-1, 100), 12),
        moving("other", on_lane(1, 300), 10),
    ),
    "crossing": (
        "cross",
        False,
        moving("ego", on_lane(-1, 100), 12),
        moving("other", on_lane(-1, 90, road=2), 10),
    ),
    "reverse": (
        "straight",
        False,
        moving("ego", on_lane(-2, 100), 8),
        moving("other", on_lane(-1, 200), -6),
    ),
    "on_foot": (
        "straight",
        True,
        moving("ego", on_lane(-2, 100), 8),
        moving("other", on_lane(-1, 130), 1.5),
    ),
}
KNOWN = tuple(SETTINGS)


def case(
    name: str, setting: str, action: str, *, when: str = "", more: str = "", end: float = 10.0
) -> Case:
    """The other one does something in a setting; at 1 s, unless `when` says otherwise."""
    road, walks, ego, other = SETTINGS[setting]
    entities = vehicle("ego") + (pedestrian("other") if walks else vehicle("other"))
    stories = (
        story(event("e", private(action), when or time(BEGIN)), start=when and time(BEGIN)) + more
    )
    parts = {"entities": entities, "init": ego + other, "stories": stories}
    return Case(f"{name}_{setting}", road, parts, end)
