"""Drive a stored run again and look closely at a stretch of it: all views, the tier trace, a film.

The run is deterministic, so the second drive is the first one: the logs are compared by content hash.
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from skidpad.campaign.channels.drive import drive_segment
from skidpad.campaign.driving.backends import keep_server
from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.runs.run import OpenRun
from skidpad.campaign.runs.state_files import CheckpointWriter, StateFiles, find_nearest
from skidpad.campaign.runs.stored import read_run, read_segment
from skidpad.campaign.runs.views import SIZE, twelve_views
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.campaign.user_files import with_kept_map
from skidpad.core.errors import CheckpointError, ConfigError, FileError, OutputError
from skidpad.core.run import RunSpec
from skidpad.core.setup import DT
from skidpad.core.states import StackReport
from skidpad.recording.channels.content_hash import recording_hash
from skidpad.recording.files import output_error, write_atomically
from skidpad.recording.run.inputs import read_inputs
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import log_hash, read_log

PICTURES = 40  # at most this many PNG files of a stretch when no film is asked for


@dataclass(frozen=True, slots=True)
class Rerun:
    """Outcome of driving a stored run again."""

    same: bool  # the stretch up to its end has the same content hash
    pictures: tuple[Path, ...]
    film: Path | None
    trace: tuple[str, ...]  # one line per change of tier or status
    begun_s: float = 0.0  # of the checkpoint from which it was driven; 0: from the beginning
    refused: str = ""  # why no checkpoint was used, where that needs a word


def rerun(
    run: Path,
    begin_s: float,
    end_s: float,
    out: Path,
    film: Path | None = None,
    checkpoints_s: float | None = None,
) -> Rerun:
    """Drives the run in folder `run` again up to `end_s`, keeping what happens from `begin_s` on.

    It begins at the nearest checkpoint before, where the folder has any. Pictures go to `out`, or a film to
    `film`; with `checkpoints_s` the whole way is driven, and a checkpoint written each so many s. FileError
    for an empty run, ConfigError for a stretch outside of it.
    """
    stored = read_log(run)
    spec = with_kept_map(read_run(run), run.resolve().parents[1])
    if not len(stored):
        raise FileError(f"{run} holds a run that ended before its first tick")
    last = float(stored.t[-1])
    if not 0.0 <= begin_s < end_s:
        raise ConfigError(f"--from {begin_s:g} must be >= 0 and below --to {end_s:g}")
    if begin_s > last:
        raise ConfigError(f"--from {begin_s:g} lies after the end of the run at {last:g} s")
    end_s = min(end_s, last + DT)
    closely = Closely(begin_s, end_s, out, film)
    keep_server(spec.backend)
    opened = OpenRun(spec, sinks=(closely,), desk=desk_of(run, spec))
    writer = None
    if checkpoints_s is not None:
        writer = CheckpointWriter(opened, run, max(round(checkpoints_s / DT), 1))
    refused, begun = "", 0
    try:
        if writer is None:
            refused, begun = _go_to_nearest(opened, run, round(begin_s / DT))
        while (moment := opened.step()) is not None:
            if writer is not None:
                writer.note_tick()
            if moment.frame.tick + 1 >= round(end_s / DT):
                break
        closely.finish()
    finally:
        closely.close()
        opened.close()
    again = opened.log.log.finish()
    if begun:
        stored = last_ticks(stored, begun + 1)
    n = len(again)
    same = log_hash(first_ticks(again, n)) == log_hash(first_ticks(stored, n))
    return Rerun(same, tuple(closely.pictures), film, tuple(closely.trace), begun * DT, refused)


def _go_to_nearest(opened: OpenRun, run: Path, tick: int) -> tuple[str, int]:
    """Puts a run to the nearest checkpoint in its folder before a tick.

    Returns why none was used, where that needs a word, and its tick; 0: none was.
    """
    try:
        stored = find_nearest(run, opened.spec, tick)
        if stored is None or opened.step() is None:
            return "", 0
        StateFiles(opened).restore(stored)
    except CheckpointError as error:
        return str(error), 0
    return "", opened.tick


def desk_of(run: Path, spec: RunSpec) -> Desk | None:
    """Returns the desk at which a stored run's inputs are repeated; None: no person took part."""
    if not spec.inputs:
        return None
    return Desk(Recorded(read_inputs(run, spec.inputs)), spec)


def same_segment(recording: Path) -> bool:
    """Drives a recorded segment of channels again; returns True when it gives the same contents."""
    spec = with_kept_map(read_segment(recording), recording.resolve().parents[1])
    with TemporaryDirectory() as folder:
        again = Path(folder) / "again.mcap"
        drive_segment(spec, again)
        return recording_hash(again) == recording_hash(recording)


def first_ticks(log: RunLog, n: int) -> RunLog:
    """Returns the log cut to its first n ticks, events too; 1 <= n <= length of the log."""
    last, cut = int(log.tick[n - 1]), _cut(log, slice(n))
    return replace(
        cut,
        weathers=log.weathers[: int(cut.weather.max()) + 1],
        events=tuple(e for e in log.events if e.tick <= last),
    )


def last_ticks(log: RunLog, n: int) -> RunLog:
    """Returns the log without its first n ticks and their events; 0 <= n < length of the log."""
    first = int(log.tick[n])
    events = tuple(e for e in log.events if e.tick >= first)
    return replace(_cut(log, slice(n, None)), events=events)


def _cut(log: RunLog, rows: slice) -> RunLog:
    """Returns the log with some of its rows, and all of its events."""

    def cut_series(series: Any) -> Any:
        return type(series)._make(a[rows] for a in series)

    return replace(
        log,
        tick=log.tick[rows],
        actors=cut_series(log.actors),
        present=log.present[rows],
        mu=log.mu[rows],
        ego=cut_series(log.ego),
        applied=cut_series(log.applied),
        requested=cut_series(log.requested),
        report=cut_series(log.report),
        supervision=log.supervision[rows],
        weather=log.weather[rows],
    )


class Closely(Sink):
    """Watches a stretch: pictures or a film of all views, and the trace of tiers."""

    def __init__(self, begin_s: float, end_s: float, out: Path, film: Path | None) -> None:
        self.begin_s, self.out = begin_s, out
        self.every = max(1, round((end_s - begin_s) / DT / PICTURES))
        self.pictures: list[Path] = []
        self.trace: list[str] = []
        self._before: tuple[Any, Any] | None = None
        self._film = None if film is None else Film(film)

    def see(self, moment: Moment) -> None:
        """Keeps the trace and a picture of a moment from `begin_s` on."""
        t = moment.frame.tick * DT
        if t < self.begin_s - 1e-9:
            return
        self._trace(t, moment.report, moment.driver.mode)
        if self._film is not None:
            self._film.write(np.ascontiguousarray(twelve_views(moment, DT)[..., ::-1]))
        elif moment.frame.tick % self.every == 0:
            path = self.out / f"{t:07.2f}s.png"
            picture = Image.fromarray(twelve_views(moment, DT))
            write_atomically(path, partial(picture.save, format="PNG"))
            self.pictures.append(path)

    def _trace(self, t: float, report: StackReport, mode: str) -> None:
        """Appends a line to the trace when tier or status differ from those before; `t` is in s."""
        if (report.tier, report.status) == self._before:
            return
        self._before = (report.tier, report.status)
        tier = report.tier.name if report.tier is not None else "-"
        status = report.status.name if report.status is not None else "-"
        distance = f", {report.distance:.1f} m" if report.distance is not None else ""
        self.trace.append(f"{t:7.2f} s  {mode or tier:<36} {status}{distance}")

    def finish(self) -> None:
        """Puts the film in place, if there is one."""
        if self._film is not None:
            self._film.finish()

    def close(self) -> None:
        """Removes a film that was not finished."""
        if self._film is not None:
            self._film.close()


class Film:
    """A film at 20 pictures per second, in place when it is finished; OutputError if it cannot be."""

    def __init__(self, path: Path) -> None:
        if path.suffix != ".mp4":
            raise ConfigError(f"--video takes a file that ends in .mp4, got {path}")
        self.path, self.part = path, path.with_name(f".{path.stem}.{os.getpid()}.part.mp4")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(path, error) from error
        code = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(self.part), code, 1.0 / DT, (SIZE[1], SIZE[0]))
        if not self._writer.isOpened():
            raise OutputError(f"cannot write the film {path}")

    def write(self, picture: NDArray[np.uint8]) -> None:
        """Appends a picture (H, W, 3), blue first."""
        self._writer.write(picture)

    def finish(self) -> None:
        """Closes the film and moves it to its path, over a file there; OutputError when that cannot be."""
        self._writer.release()
        try:
            os.replace(self.part, self.path)
        except OSError as error:
            raise output_error(self.path, error) from error

    def close(self) -> None:
        """Removes the unfinished film; harmless after `finish`."""
        self._writer.release()
        with suppress(OSError):
            self.part.unlink(missing_ok=True)
