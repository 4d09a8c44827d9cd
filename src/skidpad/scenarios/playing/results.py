"""What a played scenario leaves besides its log: trajectories, the story, what it staged."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import cos, hypot, sin
from pathlib import Path

from skidpad.recording.files import csv_text, write_bytes
from skidpad.recording.run.lamps import write_lamps
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.staging import write_staging
from skidpad.recording.run.tilts import write_tilts
from skidpad.scenarios.elements import Happening
from skidpad.scenarios.playing.player import Played
from skidpad.scenarios.playing.stage import Row, rows_csv
from skidpad.scenarios.reading.entities import Box

TRAJECTORIES, STORY = "trajectories.csv", "storyboard.csv"
STORY_COLUMNS = {
    "time": "s, since the start",
    "element": "path of the element in the storyboard, parted by ::",
    "what": "its transition, or what a condition says",
}


def write_results(folder: Path, log: RunLog, played: Played) -> None:
    """Writes staging, lamps, tilts, story and trajectories of a run into the folder."""
    write_staging(folder, played.staging)
    write_lamps(folder, played.lamps)
    write_tilts(folder, played.tilts)
    rows = rows_csv(log_rows(log, played.boxes))
    write_bytes(folder / TRAJECTORIES, rows.encode())
    write_bytes(folder / STORY, story_csv(played.story).encode())


def log_rows(log: RunLog, boxes: Mapping[str, Box]) -> Iterator[Row]:
    """Yields the places of reference points, as the file means them, of all that is there at each time."""
    a, times = log.actors, log.t.tolist()
    columns = [v.tolist() for v in (a.x, a.y, a.z, a.yaw, a.vx, a.vy, log.present)]
    for k, t in enumerate(times):
        for i, name in enumerate(log.table.names):
            x, y, z, yaw, vx, vy, there = (column[k][i] for column in columns)
            if not there:
                continue
            box = boxes.get(name, Box())
            x -= box.forward * cos(yaw) - box.left * sin(yaw)
            y -= box.forward * sin(yaw) + box.left * cos(yaw)
            yield Row(t, i, name, x, y, z, yaw, hypot(vx, vy))


def story_csv(story: Iterable[Happening]) -> str:
    """Returns the story as CSV with STORY_COLUMNS."""
    return csv_text(STORY_COLUMNS, ((f"{h.t:.3f}", "::".join(h.path), h.what) for h in story))
