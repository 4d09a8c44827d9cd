"""A town that somebody else drew: a closed street with two tight bends and nothing beside it."""

from __future__ import annotations

from math import pi
from pathlib import Path

STRAIGHT, RADIUS = 300.0, 40.0  # m
WIDTH = 3.5  # m
LANE = (
    '<lane id="{id}" type="{type}" level="false"><link><predecessor id="{id}"/>'
    '<successor id="{id}"/></link><width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    '<roadMark sOffset="0" type="solid"/></lane>'
)


def lane(id: int, type: str = "driving", width: float = WIDTH) -> str:
    """One lane of constant width."""
    return LANE.format(id=id, type=type, width=width)


def stadium(beside: str = "none", start: bool = True, closed: bool = True) -> str:
    """OpenDRIVE text; beside: the type of a 2 m lane on either side, "none" is grass."""
    arc = pi * RADIUS
    pieces = [
        (0.0, 0.0, 0.0, STRAIGHT, 0.0),
        (STRAIGHT, 0.0, 0.0, arc, 1.0 / RADIUS),
        (STRAIGHT, 2.0 * RADIUS, pi, STRAIGHT, 0.0),
        (0.0, 2.0 * RADIUS, pi, arc, 1.0 / RADIUS),
    ]
    plan, s = "", 0.0
    for x, y, heading, length, curvature in pieces if closed else pieces[:1]:
        shape = f'<arc curvature="{curvature}"/>' if curvature else "<line/>"
        plan += f'<geometry s="{s}" x="{x}" y="{y}" hdg="{heading}" length="{length}">{shape}'
        plan += "</geometry>"
        s += length
    link = '<{} elementType="road" elementId="1" contactPoint="{}"/>'
    links = link.format("predecessor", "end") + link.format("successor", "start")
    place = '<userData code="skidpad.ego_start" value="1 -1 20.0"/>' if start else ""
    return (
        f'<OpenDRIVE><header revMajor="1" revMinor="7">{place}</header>'
        f'<road name="ring" length="{s}" id="1" junction="-1"><link>{links if closed else ""}</link>'
        f'<type s="0" type="town"><speed max="50" unit="km/h"/></type><planView>{plan}</planView>'
        f'<lanes><laneSection s="0"><left>{lane(2, beside, 2.0)}{lane(1)}</left>'
        f'<center><lane id="0" type="none"/></center>'
        f"<right>{lane(-1)}{lane(-2, beside, 2.0)}</right></laneSection></lanes></road></OpenDRIVE>"
    )


def written(folder: Path, name: str = "elsewhere.xodr", **what: object) -> Path:
    """The same as a file."""
    path = folder / name
    path.write_text(stadium(**what), encoding="utf-8")  # type: ignore[arg-type]
    return path
