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
    banks: str = "",
) -> str:
    """A road of one or two pieces, a line before an arc; the arc begins where the line ends."""
    x, y, heading = start
    plan, s = "", 0.0
    lateral = f"<lateralProfile>{banks}</lateralProfile>" if banks else "<lateralProfile/>"
    for length, shape in pieces:
        plan += f'<geometry s="{s}" x="{x}" y="{y}" hdg="{heading}" length="{length}">{shape}</geometry>'
        x, s = x + length, s + length
    return f"""<road name="" length="{s}" id="{id}" junction="-1"><link/><planView>{plan}</planView>
<elevationProfile>{heights}</elevationProfile>{lateral}<lanes><laneSection s="0">
<left>{LEFT}</left><center><lane id="0" type="none" level="false"/></center><right>{RIGHT}</right>
</laneSection></lanes></road>"""


def network(*roads: str) -> str:
    return f"""<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4" name="" version="1"
north="0" south="0" east="0" west="0"/>{"".join(roads)}</OpenDRIVE>"""


ONE = (lane(1), lane(-1))  # lanes of roads at the fork, left and right


def arm(id: int, start: tuple[float, float, float], link: str) -> str:
    """A road of 100 m with one lane either way; link: its predecessor or successor at the fork."""
    x, y, heading = start
    left, right = ONE
    return f"""<road name="" length="100" id="{id}" junction="-1"><link><{link} elementType="junction"
elementId="10"/></link><planView><geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="100"><line/>
</geometry></planView><lanes><laneSection s="0"><left>{left}</left><center><lane id="0" type="none"
level="false"/></center><right>{right}</right></laneSection></lanes></road>"""


def connection(
    id: int,
    ends: tuple[tuple[int, str], tuple[int, str]],
    lanes: tuple[int, int],
    start: tuple[float, float, float],
    shape: tuple[float, str],
) -> str:
    """A connecting road with one lane on the right, from an end of a road to that of another."""
    (a, from_), (b, to) = ends
    x, y, heading = start
    length, form = shape
    own = lane(-1).replace(
        "<link/>", f'<link><predecessor id="{lanes[0]}"/><successor id="{lanes[1]}"/></link>'
    )
    return f"""<road name="" length="{length}" id="{id}" junction="10"><link><predecessor elementType="road"
elementId="{a}" contactPoint="{from_}"/><successor elementType="road" elementId="{b}" contactPoint="{to}"/>
</link><planView><geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length}">{form}</geometry>
</planView><lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
<right>{own}</right></laneSection></lanes></road>"""


def fork() -> str:
    """Road 1 runs east to x = 100; beyond 20 m road 2 runs on east, and road 3 north."""
    east, north = (0.0, 0.0, 0.0), (120.0, 20.0, pi / 2)
    turn = 10.0 * pi
    pieces = (
        (11, ((1, "end"), (2, "start")), (-1, -1), (100.0, 0.0, 0.0), (20.0, LINE)),
        (12, ((1, "end"), (3, "start")), (-1, -1), (100.0, 0.0, 0.0), (turn, ARC.format(0.05))),
        (13, ((2, "start"), (1, "end")), (1, 1), (120.0, 0.0, pi), (20.0, LINE)),
        (14, ((3, "start"), (1, "end")), (1, 1), (120.0, 20.0, -pi / 2), (turn, ARC.format(-0.05))),
    )
    links = "".join(
        f"""<connection id="{k}" incomingRoad="{ends[0][0]}" connectingRoad="{id}" contactPoint="start">
<laneLink from="{lanes[0]}" to="-1"/></connection>"""
        for k, (id, ends, lanes, _, _) in enumerate(pieces)
    )
    roads = [arm(1, east, "successor"), arm(2, (120.0, 0.0, 0.0), "predecessor")]
    roads += [arm(3, north, "predecessor"), *(connection(*piece) for piece in pieces)]
    return network(*roads, f'<junction name="" id="10">{links}</junction>')


def detour() -> str:
    """From road 1 the outer lane leads straight to road 4, by road 2; the inner one by road 3, and to 5.

    Road 3 is a detour to the left; road 5 ends after 60 m.
    """
    bows = ((10.0 * pi, 0.05), (20.0 * pi, -0.05), (10.0 * pi, 0.05))
    spots = ((120.0, 0.0, 0.0), (140.0, 20.0, pi / 2), (180.0, 20.0, -pi / 2))
    bow, s = "", 0.0
    for (length, k), (x, y, h) in zip(bows, spots, strict=True):
        bow += f"""<geometry s="{s}" x="{x}" y="{y}" hdg="{h}" length="{length}">{ARC.format(k)}
</geometry>"""
        s += length
    whole = road((100.0, LINE))
    return network(
        whole.replace("<link/>", _ends(after=10), 1),
        road((100.0, LINE), id=4, start=(220.0, 0.0, 0.0)).replace("<link/>", _ends(before=20), 1),
        _one_way(2, (120.0, -3.5, 0.0), (80.0, LINE), _ends(10, 20)),
        _one_way(3, (120.0, 0.0, 0.0), (s, LINE), _ends(10, 20), bow),
        _one_way(5, (120.0, 0.0, 0.0), (60.0, LINE), _ends(before=10)),
        *(_link(*piece) for piece in DETOUR),
        *(f'<junction name="" id="{id}">{"".join(_told(p) for p in DETOUR if p[5] == id)}</junction>'
          for id in (10, 20)),
    )  # fmt: skip


# id, from road and lane, to road and lane, y and x of the reference line's begin, junction
DETOUR = (
    (11, (1, -2), (2, -1), -3.5, 100.0, 10),
    (13, (1, -1), (5, -1), 0.0, 100.0, 10),
    (12, (1, -1), (3, -1), 0.0, 100.0, 10),
    (21, (2, -1), (4, -2), -3.5, 200.0, 20),
    (22, (3, -1), (4, -1), 0.0, 200.0, 20),
)


def _ends(before: int | None = None, after: int | None = None) -> str:
    ends = (("predecessor", before), ("successor", after))
    links = (f'<{k} elementType="junction" elementId="{j}"/>' for k, j in ends if j is not None)
    return f"<link>{''.join(links)}</link>"


def _one_way(
    id: int,
    start: tuple[float, float, float],
    shape: tuple[float, str],
    links: str,
    plan: str = "",
    own: str = lane(-1),
    junction: int = -1,
) -> str:
    """A road with one lane on the right."""
    (x, y, h), (length, form) = start, shape
    plan = plan or f'<geometry s="0" x="{x}" y="{y}" hdg="{h}" length="{length}">{form}</geometry>'
    return f"""<road name="" length="{length}" id="{id}" junction="{junction}">{links}<planView>{plan}
</planView><lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
<right>{own}</right></laneSection></lanes></road>"""


def _link(
    id: int, a: tuple[int, int], b: tuple[int, int], y: float, x: float, junction: int
) -> str:
    """A connecting road, straight on for 20 m."""
    links = f"""<link><predecessor elementType="road" elementId="{a[0]}" contactPoint="end"/>
<successor elementType="road" elementId="{b[0]}" contactPoint="start"/></link>"""
    lanes = f'<link><predecessor id="{a[1]}"/><successor id="{b[1]}"/></link>'
    own = lane(-1).replace("<link/>", lanes)
    return _one_way(id, (x, y, 0.0), (20.0, LINE), links, own=own, junction=junction)


def _told(piece: tuple[int, tuple[int, int], tuple[int, int], float, float, int]) -> str:
    id, (road_id, lane_id) = piece[:2]
    return f"""<connection id="{id}" incomingRoad="{road_id}" connectingRoad="{id}" contactPoint="start">
<laneLink from="{lane_id}" to="-1"/></connection>"""


RISE = """<elevation s="0" a="0" b="0" c="0" d="0"/><elevation s="100" a="0" b="0" c="0.0004" d="0"/>
<elevation s="200" a="4" b="0.08" c="0" d="0"/>"""

# beyond the shoulders lie lanes without a type
VOID = (
    network(road((1000.0, LINE)))
    .replace("<left>", f"<left>{lane(4, 'none', 5.0)}")
    .replace("</right>", f"{lane(-4, 'none', 5.0)}</right>")
)

# the curve is 100 m straight, then turns left on a radius of 120 m; two roads cross at (200, 0)
ROADS = {
    "straight": network(road((1000.0, LINE))),
    "void": VOID,
    "curve": network(road((100.0, LINE), (300.0, ARC.format(1 / 120)))),
    "hill": network(road((800.0, LINE), heights=RISE)),
    "banked": network(
        road((600.0, LINE), banks='<superelevation s="0" a="0.5" b="0" c="0" d="0"/>')
    ),
    "fork": fork(),
    "detour": detour(),
    "cross": network(road((600.0, LINE)), road((400.0, LINE), id=2, start=(200.0, -200.0, pi / 2))),
}
