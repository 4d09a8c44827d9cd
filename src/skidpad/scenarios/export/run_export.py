"""The log of any run as OpenSCENARIO and OpenDRIVE: everybody moves as recorded."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from pathlib import Path

import numpy as np

from skidpad.core.errors import InputError
from skidpad.core.files.names import path_part
from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind
from skidpad.recording.files import write_bytes
from skidpad.recording.run.log import RunLog
from skidpad.roads.bundled import FOLDER, load_map
from skidpad.scenarios.export.hazard_export import road_under
from skidpad.scenarios.export.tracks import Track
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.export.writer import Sheet, write_element, write_scenario
from skidpad.scenarios.reading.environment import Environment

DATE = datetime(1970, 1, 1)  # noqa: DTZ001  # the library writes naive times
EGO = 0  # row of the log's tables


def export_run(
    log: RunLog,
    folder: Path,
    stem: str,
    roads: Iterable[Path] = (),
    version: OscVersion = OscVersion.V1_2,
    environment: Environment | None = None,
) -> tuple[Path, Path, bool]:
    """Writes STEM.xosc and STEM.xodr into `folder`; returns them, and whether the road is the run's.

    environment: weather and road of the run, where they are known.
    roads: files of which one may be the run's road; bundled ones are known. Without it a straight
    road lies under everything. InputError for a log without a moment.
    """
    entities = log_tracks(log)
    if not entities:
        raise InputError(f"{stem}: its log is empty")
    stem = path_part(stem)
    road_file, scenario_file = folder / f"{stem}.xodr", folder / f"{stem}.xosc"
    under, parking = road_under(entities, stem)
    road = road_of(log, roads)
    if road is None:
        write_element(road_file, under)
    else:
        write_bytes(road_file, road.read_bytes())
    sheet = Sheet(
        title=f"Run {stem}",
        date=DATE,
        road_file=road_file.name,
        t_end=max(track.t[-1] for track in entities),
        parking=parking,
        version=version,
        sparse=True,
        environment=environment,
    )
    write_scenario(scenario_file, entities, sheet)
    return scenario_file, road_file, road is not None


def road_of(log: RunLog, roads: Iterable[Path]) -> Path | None:
    """Returns the OpenDRIVE file that the run was driven on, by its content; None without one."""
    bundled = FOLDER / f"{log.header.map}.xodr"
    for file in (*roads, bundled):
        if file.suffix != ".xodr" or not file.is_file():
            continue
        map = log.header.map if file == bundled else file
        if load_map(map).content_hash == log.header.map_hash:
            return file
    return None


def log_tracks(log: RunLog) -> list[Track]:
    """Returns the tracks of all actors of a log, the ego first; times in s from its first moment."""
    found = []
    for i, name in enumerate(log.table.names):
        there = np.flatnonzero(log.present[:, i])
        if len(there):
            found.append(_track(log, i, name, there))
    return found


def _track(log: RunLog, i: int, name: str, there: np.ndarray) -> Track:
    """Returns the track of actor i of a log at the rows `there`."""
    a, table = log.actors, log.table
    x, y, z, yaw = (v[there, i].astype(np.float64) for v in (a.x, a.y, a.z, a.yaw))
    vx, vy = (v[there, i].astype(np.float64) for v in (a.vx, a.vy))
    return Track(
        name,
        "",
        i == EGO,
        LABEL_OF_KIND[ActorKind(int(table.kind[i]))],
        (float(table.length[i]), float(table.width[i]), 0.0, 0.0),
        t=np.round(log.t[there] - log.t[0], 3).tolist(),
        x=x.tolist(),
        y=y.tolist(),
        heading=np.unwrap(yaw).tolist(),
        v=(vx * np.cos(yaw) + vy * np.sin(yaw)).tolist(),
        z=z.tolist(),
        height=float(table.height[i]),
        colour="#" + "".join(f"{int(c):02X}" for c in table.rgb[i]),
    )
