"""Small roads of one shape each, two lanes either way, for reference trajectories."""

from __future__ import annotations

from math import pi

WIDTH = 3.5  # m of a driving lane
LINE, ARC = "<line/>", '<arc curvature="{}"/>'


def lane(id: int, kind: str = "driving", width: float = WIDTH) -> str:
    return f"""<lane id="{id}" type="{kind}" level="false"><link/>
<width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane>"""


LEFT = lane(3, "shoulder", 3.0) + lane(2) + lane(1)
RIGHT = lane(-1) + lane(-2) + lane(-3, "shoulder", 3.0)


def road(
    *pieces: tuple[float, str],
    id: int = 1,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    heights: str = '<elevation s="0" a="0" b="0" c="0" d="0"/>',
) -> str:
    """A road of one or two pieces, a line before an arc; the arc begins where the line ends."""
    x, y, heading = start
    plan, s = "", 0.0
    for length, shape in pieces:
        plan += f'<geometry s="{s}" x="{x}" y="{y}" hdg="{heading}" length="{length}">{shape}</geometry>'
        x, s = x + length, s + length
    return f"""<road name="" length="{s}" id="{id}" junction="-1"><link/><planView>{plan}</planView>
<elevationProfile>{heights}</elevationProfile><lateralProfile/><lanes><laneSection s="0">
<left>{LEFT}</left><center><lane id="0" type="none" level="false"/></center><right>{RIGHT}</right>
</laneSection></lanes></road>"""


def network(*roads: str) -> str:
    return f"""<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4" name="" version="1"
north="0" south="0" east="0" west="0"/>{"".join(roads)}</OpenDRIVE>"""


RISE = """<elevation s="0" a="0" b="0" c="0" d="0"/><elevation s="100" a="0" b="0" c="0.0004" d="0"/>
<elevation s="200" a="4" b="0.08" c="0" d="0"/>"""

# the curve is 100 m straight, then turns left on a radius of 120 m; two roads cross at (200, 0)
ROADS = {
    "straight": network(road((1000.0, LINE))),
    "curve": network(road((100.0, LINE), (300.0, ARC.format(1 / 120)))),
    "hill": network(road((800.0, LINE), heights=RISE)),
    "cross": network(road((600.0, LINE)), road((400.0, LINE), id=2, start=(200.0, -200.0, pi / 2))),
}
