"""Drive a stored run again and look closely at a stretch of it: all views, the tier trace, a film.

The run is deterministic, so the second drive is the first one: the logs are compared by content hash.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import yaml
from PIL import Image

from skidpad.campaign.backends import make_backend
from skidpad.campaign.cells import Cell, Driver
from skidpad.campaign.drive import loop, prepare
from skidpad.campaign.runfolder import CONFIG
from skidpad.campaign.views import SIZE, twelve_views
from skidpad.core.errors import ConfigError, FileError, OutputError
from skidpad.core.frames import SensorFrame
from skidpad.core.setup import DT
from skidpad.core.states import StackReport, WorldTruth
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather
from skidpad.recording.logfiles import log_hash, read_log
from skidpad.recording.runlog import RunLog
from skidpad.stack.configurations import parse_functions
from skidpad.stack.loading import GuardedStack
from skidpad.stack.settings import Settings

PICTURES = 40  # at most this many PNG files of a stretch when no film is asked for


@dataclass(frozen=True, slots=True)
class Rerun:
    """What came of it."""

    same: bool  # the stretch up to its end has the same content hash
    pictures: tuple[Path, ...]
    film: Path | None
    trace: tuple[str, ...]  # one line per change of tier or status


def rerun(run: Path, begin_s: float, end_s: float, out: Path, film: Path | None = None) -> Rerun:
    """Drive the run in folder `run` again up to `end_s`, keeping what happens from `begin_s` on."""
    stored = read_log(run)
    cell = read_cell(run)
    last = float(stored.t[-1])
    if not 0.0 <= begin_s < end_s:
        raise ConfigError(f"--from {begin_s:g} must be >= 0 and below --to {end_s:g}")
    if begin_s > last:
        raise ConfigError(f"--from {begin_s:g} lies after the end of the run at {last:g} s")
    end_s = min(end_s, last + DT)
    ready = prepare(replace(cell, duration=end_s))
    watcher = Closely(begin_s, end_s, out, film, ready.stack)
    backend = make_backend(cell.backend)
    try:
        again = loop(backend, ready, (watcher,))
    finally:
        backend.close()
        watcher.close()
    ticks = len(again.log)
    same = log_hash(again.log) == log_hash(first_ticks(stored, ticks))
    return Rerun(same, tuple(watcher.pictures), film, tuple(watcher.trace))


def first_ticks(log: RunLog, n: int) -> RunLog:
    """The first n ticks of a log."""

    def cut(series: Any) -> Any:
        return type(series)._make(a[:n] for a in series)

    last = int(log.tick[n - 1])
    return replace(
        log,
        tick=log.tick[:n],
        actors=cut(log.actors),
        present=log.present[:n],
        mu=log.mu[:n],
        ego=cut(log.ego),
        applied=cut(log.applied),
        requested=cut(log.requested),
        report=cut(log.report),
        supervision=log.supervision[:n],
        weather=log.weather[:n],
        events=tuple(e for e in log.events if e.tick <= last),
    )


def read_cell(run: Path) -> Cell:
    """The cell that a run's config.yaml describes."""
    path = run / CONFIG
    try:
        plain = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror}") from error
    try:
        return Cell(
            driver=Driver(
                label=plain["driver"],
                functions=parse_functions(",".join(plain["functions"])),
                stack=plain["stack"],
                options=plain["options"],
            ),
            weather=msgspec.convert(plain["weather"], Weather),
            seed=plain["seed"],
            profile=plain["profile"],
            settings=Settings().with_values(plain["settings"]),
            map=plain["map"],
            duration=plain["duration"],
            traffic=plain["traffic"],
            vehicles=plain["vehicles"],
            allow_fewer=plain["allow_fewer"],
            level=SensorLevel(plain["sensors"]),
            render_all=plain["render"] == "all",
        )
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path} does not describe a run: {error!r}") from error


class Closely:
    """Watches a stretch: pictures or a film of all views, and the trace of tiers."""

    def __init__(
        self, begin_s: float, end_s: float, out: Path, film: Path | None, stack: GuardedStack
    ) -> None:
        """stack: who drives, asked for its mode in words (A-139)."""
        self.begin, self.out, self.stack = begin_s, out, stack
        self.every = max(1, round((end_s - begin_s) / DT / PICTURES))
        self.pictures: list[Path] = []
        self.trace: list[str] = []
        self._before: tuple[Any, Any] | None = None
        self._film = None if film is None else open_film(film)

    def see(self, frame: SensorFrame, truth: WorldTruth, report: StackReport | None) -> None:
        """Keep this moment if it lies in the stretch."""
        t = frame.tick * DT
        if t < self.begin - 1e-9:
            return
        self._trace(t, report)
        if self._film is not None:
            picture = twelve_views(frame, truth, report, DT, self.stack.mode)
            self._film.write(np.ascontiguousarray(picture[..., ::-1]))
        elif frame.tick % self.every == 0:
            self.out.mkdir(parents=True, exist_ok=True)
            path = self.out / f"{t:07.2f}s.png"
            picture = twelve_views(frame, truth, report, DT, self.stack.mode)
            Image.fromarray(picture).save(path)
            self.pictures.append(path)

    def _trace(self, t: float, report: StackReport | None) -> None:
        if report is None or (report.tier, report.status) == self._before:
            return
        self._before = (report.tier, report.status)
        tier = report.tier.name if report.tier is not None else "-"
        status = report.status.name if report.status is not None else "-"
        distance = f", {report.distance:.1f} m" if report.distance is not None else ""
        self.trace.append(f"{t:7.2f} s  {self.stack.mode or tier:<36} {status}{distance}")

    def close(self) -> None:
        """Finish the film."""
        if self._film is not None:
            self._film.release()


def open_film(path: Path) -> cv2.VideoWriter:
    """A film at 20 pictures per second; OutputError when it cannot be written."""
    if path.suffix != ".mp4":
        raise ConfigError(f"--video takes a file that ends in .mp4, got {path}")
    path.parent.mkdir(parents=True, exist_ok=True)
    code = cv2.VideoWriter.fourcc(*"mp4v")
    writer = cv2.VideoWriter(str(path), code, 1.0 / DT, (SIZE[1], SIZE[0]))
    if not writer.isOpened():
        raise OutputError(f"cannot write the film {path}")
    return writer
