"""Readers of catalogs, of judged recordings and of the cockpit's replay, for tests that damage them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from support import runs
from support.faults import small_files
from support.faults.readers import (
    BYTES_OR_ARRAYS,
    BYTES_OR_JSON,
    BYTES_OR_TABLE,
    BYTES_OR_XML,
    BYTES_OR_YAML,
    STORY_DT,
    STORY_S,
    Reader,
    story_of,
)
from support.scenarios.files import VEHICLE, event, private, speed, time, to, vehicle, write

# --- catalogs of scenarios

CATALOG = """<?xml version='1.0'?>
<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2026-01-01T00:00:00" description="x"
author="x"/><Catalog name="all">{}</Catalog></OpenSCENARIO>"""
PLACES = '<VehicleCatalog><Directory path="cat"/></VehicleCatalog>'
DECLARED = """<ParameterDeclarations><ParameterDeclaration name="{}" parameterType="double" value="{}"/>
</ParameterDeclarations>"""
NAMED = '<CatalogReference catalogName="all" entryName="{}"/>'
STORY = f"""<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1"><Actors
selectTriggeringEntities="false"><EntityRef entityRef="other"/></Actors>{NAMED.format("slow")}
</ManeuverGroup><StartTrigger/></Act></Story>"""


def catalogs() -> list[bytes]:
    car = (
        VEHICLE.format(x=1)
        .replace('name="v"', 'name="long"')
        .replace('length="4.2"', 'length="$L"')
    )
    car = car.replace("<BoundingBox>", DECLARED.format("L", 9) + "<BoundingBox>", 1)
    slow = event("slow", private(speed(to("$v"), "linear", 2)), time(2.0))
    manoeuvre = f'<Maneuver name="slow">{DECLARED.format("v", 1)}{slow}</Maneuver>'
    return [CATALOG.format(car + manoeuvre).encode()]


def read_catalog(path: Path) -> object:
    """A scenario that takes a vehicle and a manoeuvre from it, played; a new folder each time."""
    from skidpad.scenarios.playing.stage import play_ideal

    with TemporaryDirectory(dir=path.parent) as name, np.errstate(all="ignore"):
        folder = Path(name)
        (folder / "cat").mkdir()
        (folder / "cat" / "all.xosc").write_bytes(path.read_bytes())
        other = f'<ScenarioObject name="other">{NAMED.format("long")}</ScenarioObject>'
        file = write(folder, catalogs=PLACES, entities=vehicle("ego") + other, stories=STORY)
        scenario = story_of(file).scenario
        return scenario and play_ideal(scenario, STORY_S, STORY_DT).csv()


# --- what was judged before


MADE_BY = {"code": "1", "recording": "2"}


def judged() -> list[bytes]:
    from skidpad.core.vocabulary import HazardType
    from skidpad.evidence.channels.judging.kept import segment_bytes
    from skidpad.evidence.channels.judging.segments import Segment
    from skidpad.evidence.channels.matching import Span

    span = Span(HazardType.STUCK_VEHICLE, 1.0, 2.0)
    segment = Segment(
        "a", "town", 0.1, {"practical": (span,)}, {"sim": (span,)}, {}, 0, {1.0: (span,)}, (),
        t=np.arange(5.0), rows=np.ones((5, 3)), motion=np.ones((5, 3)),
    )  # fmt: skip
    return [segment_bytes(segment, MADE_BY)]


def read_judged(path: Path) -> object:
    """Read whole, or judged again: damage is never taken for what was found."""
    from skidpad.evidence.channels.judging.kept import segment_bytes, segment_from

    segment = segment_from(path.read_bytes(), MADE_BY)
    assert segment is None or segment_bytes(segment, MADE_BY) == judged()[0]
    return segment


# --- a run in the cockpit


@cache
def drive() -> dict[str, bytes]:
    from skidpad.campaign.runs.play import run_to

    with TemporaryDirectory() as folder:
        out = Path(folder) / "runs" / "a"
        run_to(runs.adas_run(duration=0.5, vehicles=1), out)
        return {p.name: p.read_bytes() for p in out.iterdir() if p.is_file()}


def part(name: str) -> Callable[[], list[bytes]]:
    """One file of the run."""
    return lambda: [drive()[name]]


def events() -> list[bytes]:
    return [drive()["events.jsonl"], small_files.events()]


def look(path: Path) -> object:
    """What the cockpit asks of a run that is opened."""
    from skidpad.cockpit.opening import open_source

    folder = path.parent / "runs" / "a"
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in drive().items():
        (folder / name).write_bytes(path.read_bytes() if name == path.name else content)
    source = open_source(folder)
    with np.errstate(all="ignore"):
        for k in {0, source.ticks // 2, source.ticks - 1}:
            source.moment(k), source.crash(k), source.collisions(k), source.seat(k)
        return source.curves(), source.marks


READERS = {
    "catalog": Reader("all.xosc", catalogs, read_catalog, BYTES_OR_XML),
    "judged": Reader("a.judged", judged, read_judged, BYTES_OR_ARRAYS),
    "cockpit-ticks": Reader("ticks.parquet", part("ticks.parquet"), look, BYTES_OR_TABLE),
    "cockpit-events": Reader("events.jsonl", events, look, BYTES_OR_JSON),
    "cockpit-run": Reader("config.yaml", part("config.yaml"), look, BYTES_OR_YAML),
}
