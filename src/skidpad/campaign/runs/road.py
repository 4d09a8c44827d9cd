"""The road of a stored run: the file kept with it, else the one that its description names."""

from __future__ import annotations

from pathlib import Path

from skidpad.campaign.driving.course_file import load_scenario
from skidpad.campaign.runs.stored import read_run
from skidpad.core.courses import Roads, Scenario
from skidpad.core.errors import FileError, InputError
from skidpad.recording.run.log import LogHeader
from skidpad.roads.bundled import KEPT, bundled_maps, load_map
from skidpad.roads.queries import RoadMap


def road_files(run: Path) -> list[Path]:
    """Returns the files that may be a run's road, those kept with it or its campaign first."""
    run = run.resolve()
    kept = [file for above in (run, *run.parents[:2]) for file in sorted(above.glob(f"{KEPT}/*/*"))]
    try:
        course = read_run(run).course
        if isinstance(course, Roads):
            return [*kept, Path(course.map)]
        if isinstance(course, Scenario):
            return [*kept, Path(load_scenario(course).map_name)]
    except InputError:  # the road is known by its content, or it is not
        pass
    return kept


def load_road(run: Path, header: LogHeader) -> RoadMap:
    """Returns the map that a run was driven on, or today's map of that name if it has changed.

    Raises:
        FileError: no map of that name is there.
    """
    files = [file for file in road_files(run) if file.stem == header.map and file.is_file()]
    maps = [load_map(file) for file in files]
    if header.map in bundled_maps():
        maps.append(load_map(header.map))
    if not maps:
        raise FileError(
            f"{run}: its road {header.map!r} is not there any more; copy the OpenDRIVE file to "
            f"{run / KEPT / 'road' / header.map}.xodr"
        )
    return next((map for map in maps if map.content_hash == header.map_hash), maps[0])
