"""A hazard as the beginning of a search: its scene as recorded, and the same scene with values that vary.

The ego begins where and as fast as it was recorded, and is driven from there on; all others go their
recorded ways. Three parameters vary: how fast the ego begins, how far ahead of its place, and how
fast the others go through their ways.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from math import atan2, cos, hypot, sin
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from msgspec import structs

from skidpad.campaign.runs.run import run
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.files.reading import read_bytes
from skidpad.core.maths.space import Choice, Space, Variable
from skidpad.core.run import Passenger, RunSpec
from skidpad.core.text.told import on_a_line
from skidpad.recording.campaign.searches import Group, Hazard, Search, Trial
from skidpad.recording.files import write_bytes
from skidpad.recording.hazards.records import (
    RECORD_LIMIT,
    TEXT_FILE,
    HazardRecord,
    decode_record,
    read_hazards,
)
from skidpad.roads.bundled import FOLDER, bundled_maps, load_map
from skidpad.scenarios.export.hazard_export import export_hazard
from skidpad.scenarios.reading.document import parse
from skidpad.search.exported import ExportedHazard, Way
from skidpad.search.failures import find_border
from skidpad.search.files import write_xml
from skidpad.search.loop import SCENE, drive_all
from skidpad.search.margin import NO_CONFLICT
from skidpad.search.trial import Point, describe_run

if TYPE_CHECKING:
    from skidpad.campaign.workers.worker import Runner

BEND_MOST = 1.0  # m that the ego's way may leave a straight line where the road is not known


@dataclass(frozen=True, slots=True)
class Scene:
    """A hazard ready to be searched.

    Attributes:
        title: of the hazard.
        recorded: scenario in which everybody moves as recorded, the ego, too.
        varied: the same with parameters, in which the ego is driven.
        variables: what varies, and how.
        values: of the parameters as they were recorded.
        monitored: the monitor's folder that holds the hazard, and its id there; None: it is no such one.
    """

    title: str
    recorded: Path
    varied: Path
    variables: tuple[Variable, ...]
    values: dict[str, float]
    monitored: tuple[Path, str] | None = None


def prepare_scene(source: Path, id: str | None, out: Path) -> Scene:
    """Write the scene of a hazard into `out`/scene, as recorded and with parameters.

    Args:
        source: folder of a monitor or its hazards.txt, or a scenario that a hazard was exported to.
        id: of the hazard, where there are several.
        out: folder of the search.

    Raises:
        ConfigError: there is no such hazard, or several and no `id`.
        FileError: the file is missing, damaged or no exported hazard.
        InputError: the record has no world with an ego.
    """
    folder = out / SCENE
    if source.suffix == ".xosc":
        if id is not None:
            raise ConfigError(f"--hazard chooses one of a monitor's folder; {source} is one file")
        parse(source)
        return _write_scene(source, source.stem, folder)
    record = choose_record(source, id)
    channel = record.driving if record.driving in record.channels else record.channels[0]
    exported, road = export_hazard(record, folder / "exported", world=channel)
    known = _known_road(record)
    if known is not None:
        write_bytes(road, known.read_bytes())
    else:
        _centre_lane(road)
    scene = _write_scene(exported, f"{record.id} ({record.type.value})", folder, known is not None)
    if source.is_file() and source.name != TEXT_FILE:
        return scene
    kept = source if source.is_dir() else source.parent
    return replace(scene, monitored=(kept, record.id))


def choose_record(source: Path, id: str | None) -> HazardRecord:
    """Returns one hazard of a monitor's folder, or of its file hazards.txt, or the record in a file.

    id: of the hazard, None where there is one. FileError for what is no hazard, ConfigError for none
    or several without an id, or an unknown one.
    """
    if source.is_file() and source.name != TEXT_FILE:  # one record, as a fleet gives it
        if id is not None:
            raise ConfigError(f"--hazard chooses one of a monitor's folder; {source} is one record")
        return _read_one(source)
    folder = source.parent if source.name == TEXT_FILE else source
    if not (folder / TEXT_FILE).is_file():
        raise FileError(
            f"{source}: is no hazard; give a folder of `skidpad monitor`, its {TEXT_FILE}, a record of "
            "a fleet, or a .xosc of `skidpad hazards export`"
        )
    records = {record.id: record for record in read_hazards(folder)}
    if not records:
        raise ConfigError(
            f"{source}: no hazard was found in this drive, so there is none to search"
        )
    if id is None and len(records) > 1:
        raise ConfigError(f"{source} has {len(records)} hazards: give --hazard {'|'.join(records)}")
    if id is not None and id not in records:
        raise ConfigError(f"--hazard {id}: {source} has {', '.join(records)}")
    return records[id or next(iter(records))]


def _read_one(file: Path) -> HazardRecord:
    """Returns the record of a hazard in a file; raises FileError where it holds none."""
    try:
        return decode_record(
            read_bytes(file, "the record of a hazard", RECORD_LIMIT).decode("ascii")
        )
    except (FileError, UnicodeDecodeError) as error:
        raise FileError(f"{file}: is no record of a hazard ({on_a_line(error)})") from None


def _known_road(record: HazardRecord) -> Path | None:
    """Returns the file of the map that the record names; None unless it comes with Skidpad unchanged."""
    name = record.context.get("map", "")
    if name not in bundled_maps() or load_map(name).content_hash != record.context.get("map_hash"):
        return None
    file = FOLDER / f"{name}.xodr"
    return file if file.is_file() else None


def _centre_lane(road: Path) -> None:
    """Moves the straight road of an export, in its file, so that the ego is in the middle of a lane."""
    root = ElementTree.parse(road).getroot()
    line, width = root.find(".//planView/geometry"), root.find(".//right/lane/width")
    assert line is not None
    assert width is not None
    h, half = float(line.attrib["hdg"]), 0.5 * float(width.attrib["a"])
    line.set("x", repr(float(line.attrib["x"]) - half * sin(h)))
    line.set("y", repr(float(line.attrib["y"]) + half * cos(h)))
    write_xml(road, root)


def _write_scene(source: Path, title: str, folder: Path, is_road_known: bool = False) -> Scene:
    """Writes the recorded and the varied scenario of an exported hazard and returns them as a scene.

    FileError where the ego's way bends and its road is not known.
    """
    root = ElementTree.parse(source).getroot()
    found = ExportedHazard(root, source)
    found.keep_one_world()
    way = found.ego_way()
    if not is_road_known and (bend := _bend_of(way)) > BEND_MOST:
        raise FileError(
            f"{source}: the ego's way leaves a straight line by {bend:.1f} m and its road is not known, "
            f"so no driver can follow it; at most {BEND_MOST:g} m are possible"
        )
    logic = root.find("RoadNetwork/LogicFile")
    if logic is not None:
        logic.set("filepath", str((source.parent / logic.attrib["filepath"]).resolve()))
    recorded, varied = folder / "recorded.xosc", folder / "varied.xosc"
    folder.mkdir(parents=True, exist_ok=True)
    write_xml(recorded, copy.deepcopy(root))
    variables, values = found.add_parameters(way)
    write_xml(varied, root)
    return Scene(title, recorded, varied, variables, values)


def _bend_of(way: Way) -> float:
    """Return how far a way leaves the straight line of its beginning's heading, m."""
    _, x0, y0, h = way[0]
    _, x1, y1, _ = way[-1]
    if hypot(x1 - x0, y1 - y0) > 5.0:
        h = atan2(y1 - y0, x1 - x0)
    return max(abs((y - y0) * cos(h) - (x - x0) * sin(h)) for _, x, y, _ in way)


def recorded_unit(space: Space, values: dict[str, float]) -> tuple[float, ...]:
    """Returns the point of the unit cube that stands for the recorded values; 0.5 for what no record says."""
    return tuple(
        0.5
        if isinstance(v.law, Choice) or v.name not in values
        else v.law.share_below(values[v.name])
        for v in space.variables
    )


def _as_recorded(template: RunSpec, scene: Scene) -> RunSpec:
    """Returns the run that replays the scene as recorded, with the ego as a passenger."""
    course = template.course
    assert isinstance(course, Scenario)
    moved = structs.replace(course, file=str(scene.recorded), parameters={})
    return structs.replace(template, driver=Passenger(), course=moved)


def judge_hazard(
    found: Search, scene: Scene, trials: list[Trial], runner: Runner, has_exposure: bool
) -> Hazard:
    """Return how near the hazard was, and what would have made it a crash.

    Drives the scene as recorded, then with the searched driver in the ego's place and the recorded
    values, and halves the way from there to the nearest failure of the search.
    """
    template = found.template
    blank = Trial(number=0, unit=(), values={}, margin=NO_CONFLICT)
    recorded = describe_run(blank, run(_as_recorded(template, scene)), found.objective)
    unit = recorded_unit(found.space, scene.values)
    (driven,) = drive_all([Point(template, found.space, 0, unit, found.objective)], runner)
    bad = [t for t in trials if t.is_failure]
    border: Group | None = None
    if bad and driven.is_harmless:
        nearest = min(
            bad, key=lambda t: sum((a - b) ** 2 for a, b in zip(t.unit, unit, strict=True))
        )
        border = find_border(found, Group(kind=nearest.kind, failures=(nearest,)), [driven], runner)
    failing = driven if driven.is_failure else None if border is None else border.failing
    return Hazard(
        title=scene.title,
        recorded=recorded,
        driven=driven,
        changes=() if border is None else border.changes,
        failing=failing,
        likelihood=found.space.likelihood(failing.values) if has_exposure and failing else None,
    )
