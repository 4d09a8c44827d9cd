"""Films of the worst crashes of a campaign, each drawn once, in a process beside the page's."""

from __future__ import annotations

import multiprocessing
import signal
from contextlib import suppress
from multiprocessing.process import BaseProcess
from pathlib import Path

from skidpad.cockpit.film import write_film
from skidpad.cockpit.producer import GROUP
from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.source import BEFORE, index_at, opening_tick
from skidpad.cockpit.studio import View
from skidpad.core.errors import SkidpadError
from skidpad.core.setup import DT

LENGTH = 8.0  # s of a film: BEFORE the crash and what comes of it; our choice


class CrashFilms:
    """Draws films of runs, one at a time, from before their fastest crash on."""

    def __init__(self, folder: Path) -> None:
        """folder: where the films are written."""
        self.folder = folder
        self._paths: dict[Path, Path] = {}  # of the film by run, begun or drawn
        self._process: BaseProcess | None = None

    def __enter__(self) -> CrashFilms:
        return self

    def __exit__(self, *error: object) -> None:
        """Ends the drawing of a film."""
        if self._process is not None:
            self._process.kill()
            self._process.join()

    def draw(self, run: Path | None) -> None:
        """Begins to draw the film of a run, unless it was begun before or another one is being drawn."""
        busy = self._process is not None and self._process.is_alive()
        if run is None or run in self._paths or busy:
            return
        self._paths[run] = self.folder / f"{len(self._paths)}.webp"
        self._process = multiprocessing.get_context("spawn").Process(
            target=_work, args=(run, self._paths[run]), daemon=True, name="film"
        )
        self._process.start()

    def find(self, run: Path | None) -> Path | None:
        """Returns the film of a run; None without a run, or where its film is not drawn."""
        path = None if run is None else self._paths.get(run)
        return path if path is not None and path.is_file() else None

    def describe(self, run: Path | None) -> str:
        """Returns what is to be said of a run's film: drawn, or being drawn; "" where there is none."""
        if self.find(run) is not None:
            return f"film from {BEFORE:g} s before it"
        alive = self._process is not None and self._process.is_alive()
        begun = run is not None and run == next(reversed(self._paths), None)
        return "its film is being drawn" if alive and begun else ""


def _work(run: Path, path: Path) -> None:
    """Draws a film in a process of its own; none where the run cannot be replayed."""
    for one in GROUP:  # the page's process hears it, and ends this one
        signal.signal(one, signal.SIG_IGN)
    with suppress(SkidpadError):
        draw_crash(run, path)


def draw_crash(run: Path, path: Path) -> None:
    """Writes a film of a run, .webp, with plots, of LENGTH s from before its fastest crash on.

    FileError for a folder that cannot be replayed, OutputError for a film that cannot be written.
    """
    source = RecordedRun(run)
    begin = opening_tick(source)
    first, last = (index_at(source, tick) for tick in (begin, begin + round(LENGTH / DT)))
    part = path.with_name(f"part-{path.name}")
    write_film(source, range(first, last + 1), View.FOLLOW, part, plots=True).rename(path)
