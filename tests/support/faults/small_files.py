"""Small files with much in them, to be damaged: a place in them that is hit is a place that matters."""

from __future__ import annotations

from functools import cache
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory

# --- maps

HEADER = """<header name="small" revMajor="1" revMinor="7"><geoReference>+proj=tmerc +lat_0=48.1
+lon_0=11.5 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m</geoReference>{}<userData
code="skidpad.ego_start" value="1 -1 9.0"/></header>"""
OFFSET = '<offset x="3" y="-2" z="1" hdg="0.2"/>'
CURVATURE, BEND = 0.02, 20.0  # 1/m, m
END = (30.0 + sin(CURVATURE * BEND) / CURVATURE, (1.0 - cos(CURVATURE * BEND)) / CURVATURE)
POLY3 = '<poly3 a="0" b="0" c="0.002" d="0"/>'
PARAMETRIC = (
    """<paramPoly3 pRange="{}" aU="0" bU="{u}" cU="0" dU="0" aV="0" bV="0" cV="{v}" dV="0"/>"""
)
MARK = '<roadMark sOffset="0" type="{}" laneChange="both"/>'
LANE = '<lane id="{}" type="{}" level="false">{}</lane>'
LINKED = '<link><predecessor id="{0}"/><successor id="{0}"/></link>'
CENTRE = f"<center>{LANE.format(0, 'none', MARK.format('solid solid'))}</center>"
WIDTH = '<width sOffset="0" a="3.5" b="0.01" c="0" d="0"/>'
BORDER = '<border sOffset="0" a="-5" b="0" c="0" d="0"/>'
SPEED = '<speed sOffset="0" max="30" unit="mph"/>'
CORNERS = "".join(
    f'<cornerLocal u="{u}" v="{v}" z="0" height="4"/>' for u, v in ((0, 0), (4, 0), (4, 3))
)
ON_ROAD = "".join(
    f'<cornerRoad s="{s}" t="{t}" dz="0" height="2"/>' for s, t in ((6, 1), (9, 1), (9, -3))
)
ALONG = """<repeat s="1" length="14" distance="{}" tStart="6" tEnd="7" zOffsetStart="0" zOffsetEnd="0.2"
heightStart="1" heightEnd="1"/>"""
OBJECT = (
    '<object id="{id}" type="{type}" s="5" t="6" zOffset="0" hdg="0.1" {size}>{inside}</object>'
)
SIZE = 'length="3" width="2" height="1.5"'
OUTLINES = "<outlines><outline>{}</outline></outlines>"
OBJECTS = (
    ("barrier", 'name="guardRail"', ALONG.format(0)), ("wall", SIZE, ""),
    ("kerb", "", OUTLINES.format(CORNERS)), ("crosswalk", "", OUTLINES.format(ON_ROAD)),
    ("crosswalk", SIZE, ""), ("parkingSpace", SIZE, ""),
    ("building", 'height="0"', OUTLINES.format(CORNERS)),
    ("pole", 'radius="0.2" height="5"', ALONG.format(7)),
    ("obstacle", 'subtype="sign"', f"<outline>{ON_ROAD}</outline>"), ("tree", "", ""),
)  # fmt: skip
SIGNAL = """<signal id="{id}" name="a" dynamic="{dynamic}" type="{type}" subtype="-1" orientation="+" s="20"
t="-6" zOffset="3" height="0.9" value="{value}" unit="km/h"><validity fromLane="-1" toLane="-1"/></signal>"""
SIGNALS = (
    SIGNAL.format(id=11, dynamic="yes", type="1000001", value=-1)
    + SIGNAL.format(id=12, dynamic="no", type="206", value=-1)
    + SIGNAL.format(id=13, dynamic="no", type="274", value=50)
    + SIGNAL.format(id=14, dynamic="no", type="294", value=-1)
)
REFERENCE = """<signalReference s="4" t="-5" id="11" orientation="+"><validity fromLane="-1"
toLane="-1"/></signalReference>"""
JUNCTION = """<controller id="3" name="c"><control signalId="11" type=""/></controller><junction id="5"
name="j"><connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start"><laneLink from="-1"
to="-1"/></connection></junction>"""


def geometry(s: float, x: float, y: float, heading: float, length: float, shape: str) -> str:
    return f'<geometry s="{s}" x="{x}" y="{y}" hdg="{heading}" length="{length}">{shape}</geometry>'


def section(s: float, left: str, right: str) -> str:
    return f'<laneSection s="{s}"><left>{left}</left>{CENTRE}<right>{right}</right></laneSection>'


def road(
    id: int, length: float, geometries: str, lanes: str, rest: str = "", junction: int = -1
) -> str:
    return f"""<road name="r" id="{id}" length="{length}" junction="{junction}" rule="RHT">{rest}
<planView>{geometries}</planView><lanes>{lanes}</lanes></road>"""


def own_lanes() -> str:
    out = LANE.format(-1, "driving", LINKED.format(-1) + WIDTH + MARK.format("broken") + SPEED)
    return section(0, LANE.format(1, "driving", WIDTH), out + LANE.format(-2, "shoulder", BORDER))


@cache
def crossing() -> bytes:
    """Two roads and the bend that joins them inside a junction; signals and their controller."""
    to = '<link><{} elementType="junction" elementId="5"/></link>'
    first = to.format("successor") + '<type s="0" type="town"><speed max="50" unit="km/h"/></type>'
    inner = """<link><predecessor elementType="road" elementId="1" contactPoint="end"/><successor
elementType="road" elementId="2" contactPoint="start"/></link>"""
    turn, bend = CURVATURE * BEND, f'<arc curvature="{CURVATURE}"/>'
    away = geometry(0, *END, turn, 15, "<line/>")
    away += geometry(15, END[0] + 15 * cos(turn), END[1] + 15 * sin(turn), turn, 15, POLY3)
    roads = (
        road(1, 30, geometry(0, 0, 0, 0, 30, "<line/>"), own_lanes(), first).replace(
            "</road>", f"<signals>{SIGNALS}</signals></road>"
        )
        + road(2, 30, away, own_lanes(), to.format("predecessor")).replace(
            "</road>", f"<signals>{REFERENCE}</signals></road>"
        )
        + road(3, BEND, geometry(0, 30, 0, 0, BEND, bend), own_lanes(), inner, 5)
    )
    return f"<OpenDRIVE>{HEADER.format('')}{roads}{JUNCTION}</OpenDRIVE>".encode()


@cache
def roadside() -> bytes:
    """One road of all shapes with objects of all kinds beside it, banked, uphill, in two sections."""
    spiral = '<spiral curvStart="0" curvEnd="0.01"/>'
    shapes = (
        geometry(0, 0, 0, 0, 10, "<line/>")
        + geometry(10, 10, 0, 0, 10, PARAMETRIC.format("arcLength", u=1, v=0.001))
        + geometry(20, 20, 0.1, 0.02, 10, PARAMETRIC.format("normalized", u=10, v=0.1))
        + geometry(30, 30, 0.4, 0.04, 15, spiral)
    )
    profiles = """<elevationProfile><elevation s="0" a="0" b="0.02" c="0" d="0"/><elevation s="20"
a="0.4" b="0.02" c="0.001" d="0"/></elevationProfile><lateralProfile><superelevation s="0" a="0.02"
b="0" c="0" d="0"/></lateralProfile>"""
    moved = '<laneOffset s="0" a="0.2" b="0" c="0" d="0"/>'
    wide = LANE.format(-1, "driving", LINKED.format(-1) + WIDTH) + LANE.format(
        -2, "sidewalk", WIDTH
    )
    lanes = moved + own_lanes() + section(25, LANE.format(1, "driving", WIDTH), wide)
    things = "".join(
        OBJECT.format(id=k, type=type, size=size, inside=inside)
        for k, (type, size, inside) in enumerate(OBJECTS)
    )
    one = road(1, 45, shapes, lanes, profiles).replace(
        "</road>", f"<objects>{things}</objects></road>"
    )
    return f"<OpenDRIVE>{HEADER.format(OFFSET)}{one}</OpenDRIVE>".encode()


def maps() -> list[bytes]:
    return [crossing(), roadside()]


@cache
def baked() -> list[bytes]:
    from skidpad.roads.opendrive.bake import bake

    found = []
    for data in maps():
        with TemporaryDirectory() as folder:
            path = Path(folder) / "small.npz"
            bake(data, "small", "small").save(path)
            found.append(path.read_bytes())
    return found


# --- a model of the identifier

TREES, DETECTORS = 2, 2


@cache
def models() -> list[bytes]:
    """The model that comes with Skidpad, cut down to some trees of some of its detectors."""
    from skidpad.evidence.channels.identifier.model import Model, load_model, model_bytes

    whole = load_model(None)
    (truth, route), detectors = next(
        (k, v) for k, v in whole.detectors.items() if k == ("world", "all")
    )
    few = {h: _few_trees(d) for h, d in list(detectors.items())[:DETECTORS]}
    return [
        model_bytes(
            Model({(truth, route): few}, {**whole.card, "recordings": whole.card["recordings"][:2]})
        )
    ]


def _few_trees(detector):
    from dataclasses import replace

    forest = detector.forest
    end = int(forest.roots[TREES])
    few = {n: a[:end] for n, a in forest._asdict().items() if len(a) == len(forest.feature)}
    return replace(detector, forest=forest._replace(roots=forest.roots[:TREES], **few))


# --- what happens in a run


def events() -> bytes:
    """One of each kind, in a run of some ticks with one other vehicle."""
    from skidpad.core.geometry import Pose
    from skidpad.core.states import ContactEvent, LaneInvasion, TrafficContact
    from skidpad.core.vocabulary import LightState, RelocationReason
    from skidpad.recording.run.events import (
        LightChange,
        Notice,
        NoticeSource,
        PutBack,
        Relocation,
        encode_events,
    )

    there = Pose(10.0, 2.0, 0.0, yaw=0.1)
    return encode_events(
        (
            LightChange(0, 1001, LightState.RED), LaneInvasion(1, "solid", 1),
            ContactEvent(2, 1, "", 900.0, 3.0, 1.0, 2.0), ContactEvent(2, -1, "wall", 9.0, 1.0, 1.0, 2.0),
            Relocation(4, next(iter(RelocationReason)), 1.5, Pose(1.0, 2.0), there),
            TrafficContact(5, 1, -1, 2.0), PutBack(6, 1), Notice(7, NoticeSource.STACK, "it stopped"),
        )
    )  # fmt: skip


# --- what a monitor found

CYCLES = 6


def short_record(text: bytes) -> bytes:
    """The first record of a file of hazards with its first cycles only."""
    from msgspec.structs import replace

    from skidpad.recording.hazards.records import decode_record, encode_record

    head, _, rest = text.decode().partition("\n")
    record = decode_record(rest[: rest.index("\nZ\n") + 3])
    return f"{head}\n{encode_record(replace(record, worlds=record.worlds[:CYCLES]))}".encode()
