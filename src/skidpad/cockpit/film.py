"""A stretch of a stored run as a film: the same pictures and marks as on the page, without one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from PIL import Image

from skidpad.campaign.driving.loop import Moment
from skidpad.cockpit import hud
from skidpad.cockpit.companion import Companion
from skidpad.cockpit.marks import LightAhead, Lying, marks_of, patch_marks
from skidpad.cockpit.pictures import Picture, colours, draw
from skidpad.cockpit.plots import Plots
from skidpad.cockpit.source import Source, index_at
from skidpad.cockpit.studio import FOR_PEOPLE, Looks, Studio, View
from skidpad.cockpit.turn_signals import TurnSignals
from skidpad.core.errors import ConfigError, OutputError
from skidpad.core.setup import DT
from skidpad.recording.run.surfaces import read_surfaces

SHADOW = (0, 0, 0)
INK, DIM, ACCENT = (240, 240, 240), (190, 180, 170), (82, 133, 255)  # blue, green, red
INSETS = ((View.LEFT, 0.2), (View.REAR, 0.3), (View.RIGHT, 0.2))  # shares of the width, on top
MARGIN = 8  # px
WEBP_QUALITY = 55
SUFFIXES = (".mp4", ".webp")


def stretch_of(source: Source, begin_s: float, end_s: float) -> range:
    """Returns the moments between two times in s; ConfigError for a stretch that is not in the run."""
    first, last = (source.tick(k) * DT for k in (0, source.ticks - 1))
    if not first <= begin_s < end_s:
        raise ConfigError(f"--from {begin_s:g} must be >= {first:g} and below --to {end_s:g}")
    if begin_s > last:
        raise ConfigError(f"--from {begin_s:g} lies after the end of the run at {last:g} s")
    k = [index_at(source, round(t / DT)) for t in (begin_s, min(end_s, last))]
    return range(k[0], k[1] + 1)


def write_film(
    source: Source,
    moments: range,
    view: View,
    path: Path,
    other: Source | None = None,
    looks: Looks = FOR_PEOPLE,
    plots: bool = False,
) -> Path:
    """Writes a film, .mp4 or .webp, of these moments in their own time, and returns its path.

    other: a run to be shown beside it; looks: of the world in both. plots: of speed, gap
    and grip are under the pictures. ConfigError for another ending, OutputError when it cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise ConfigError(f"a film's file ends in {' or '.join(SUFFIXES)}, got {path}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write the film {path}: {error.strerror}") from error
    dt = source.step * DT
    if path.suffix == ".webp":
        _webp(frames(source, moments[::2], view, other, looks, plots), path, 2.0 * dt)
    else:
        _mp4(frames(source, moments, view, other, looks, plots), path, dt)
    return path


def frames(
    source: Source,
    moments: Sequence[int],
    view: View,
    other: Source | None = None,
    looks: Looks = FOR_PEOPLE,
    plots: bool = False,
) -> Iterator[Picture]:
    """Yields a picture per moment: the view, mirrors in it, what is said, and another run beside it.

    plots: of the first run are under it.
    """
    first = source.seat(moments[0]).outside
    studio = Studio(source.map, source.table, first, source.seed, looks=looks)
    companion = None if other is None else Companion(other, source.tick(0), looks)
    camera, light = studio.suite.cameras[view.value], LightAhead(source.map)
    lying = Lying(source.map, read_surfaces(source.folder))
    signals = TurnSignals(source)
    under: Plots | None = None
    for k in moments:
        moment = source.moment(k)
        studio.change(source.seat(k).outside)
        truth = moment.truth
        images = studio.look(truth, source.crash(k), signals.at(truth.tick))
        shown = studio.draw(images, (view, *(v for v, _ in INSETS)))
        picture = colours(shown[view])
        seen = marks_of(camera, moment.frame.radar, moment.report, light.mark(camera, moment))
        patches = patch_marks(camera, lying.outlines(truth.tick), truth.states.pose(0))
        draw(picture, *msgspec.to_builtins(seen._replace(patches=patches)))
        _inset(picture, {v: colours(shown[v]) for v, _ in INSETS})
        _say(
            picture,
            hud.motion(moment),
            hud.opinion(moment),
            moment.truth.tick,
            hud.list_events(moment),
        )
        if companion is not None:
            picture = np.hstack([picture, _other(companion, moment, view)])
        if plots:
            under = under or Plots(source, moments, picture.shape[1])
            picture = np.vstack([picture, under.at(k)])
        yield picture


def _other(companion: Companion, moment: Moment, view: View) -> Picture:
    """Returns the picture of the other run at the same time, with a line of its own."""
    shown, said = companion(moment, view)
    picture = colours(shown)
    height = picture.shape[0]
    write_text(picture, f"{abs(said['speed_kmh']):.0f} km/h", 16, height - 44, INK, 1.1, 2)
    line = f"{said['t']:6.2f} s   {said['mode']}   {said['weather']}"
    write_text(picture, line, 16, height - 16, DIM, 0.55, 1)
    return picture


def _inset(picture: Picture, small: dict[View, Picture]) -> None:
    """Draws the small views into the top of the picture, centred, in place."""
    width = picture.shape[1]
    x = (width - round(sum(s for _, s in INSETS) * width) - 2 * MARGIN) // 2
    for view, share in INSETS:
        w, h = round(share * width), round(0.16 * width * 0.75)
        source = small[view]
        rows = min(source.shape[0], round(source.shape[1] * h / w))
        top = (source.shape[0] - rows) // 2
        cut = cv2.resize(source[top : top + rows], (w, h), interpolation=cv2.INTER_AREA)
        picture[MARGIN : MARGIN + h, x : x + w] = cut
        cv2.rectangle(picture, (x, MARGIN), (x + w, MARGIN + h), (40, 40, 40), 1)
        x += w + MARGIN


def _say(
    picture: Picture, motion: dict[str, Any], stack: dict[str, Any], tick: int, events: list[str]
) -> None:
    """Writes speed, grip, time, mode and events into the picture, in place."""
    height = picture.shape[0]
    write_text(picture, f"{abs(motion['speed_kmh']):.0f} km/h", 16, height - 44, INK, 1.1, 2)
    mu = [v for v in motion["mu"] if v is not None]
    grip = f"   grip {min(mu):.2f}" if mu else ""
    write_text(
        picture, f"{tick * DT:6.2f} s{grip}   {stack['mode']}", 16, height - 16, DIM, 0.55, 1
    )
    write_text(picture, ", ".join(events), 16, height - 80, ACCENT, 0.6, 2)


def write_text(
    picture: Picture, text: str, x: int, y: int, ink: tuple[int, int, int], size: float, bold: int
) -> None:
    """Writes a line of text with a shadow at (x, y) px, in place."""
    for colour, shift in ((SHADOW, 1), (ink, 0)):
        at = (x + shift, y + shift)
        cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, colour, bold, cv2.LINE_AA)


def _mp4(pictures: Iterator[Picture], path: Path, dt: float) -> None:
    """Writes the pictures as an MP4 film; raises OutputError where it cannot be opened."""
    writer: cv2.VideoWriter | None = None
    try:
        for picture in pictures:
            if writer is None:
                size = (picture.shape[1], picture.shape[0])
                writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 1.0 / dt, size)
                if not writer.isOpened():
                    raise OutputError(f"cannot write the film {path}")
            writer.write(np.ascontiguousarray(picture))
    finally:
        if writer is not None:
            writer.release()


def _webp(pictures: Iterator[Picture], path: Path, dt: float) -> None:
    """Writes an animated WebP that a page shows by itself, in 0.6 of the size; dt: s per picture."""
    shown = [
        Image.fromarray(
            np.ascontiguousarray(
                cv2.resize(p, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)[..., ::-1]
            )
        )
        for p in pictures
    ]
    try:
        shown[0].save(
            path, save_all=True, append_images=shown[1:], duration=round(1000 * dt), loop=0,
            quality=WEBP_QUALITY, method=4,
        )  # fmt: skip
    except OSError as error:
        raise OutputError(f"cannot write the film {path}: {error}") from error
