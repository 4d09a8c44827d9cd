"""One moment of a stored run as one picture: views, weathers, without and with drops on the lens."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from skidpad.cockpit.film import DIM, INK, write_text
from skidpad.cockpit.pictures import Picture, colours
from skidpad.cockpit.source import Source
from skidpad.cockpit.studio import FOR_PEOPLE, Looks, Studio, View, plane
from skidpad.core.errors import ConfigError, OutputError
from skidpad.core.setup import DT
from skidpad.core.weather import Weather
from skidpad.sensors.pictures.encodings import cityscapes_colours
from skidpad.sensors.pictures.overlay import Lens

WIDTH, HEIGHT = 640, 480  # px of one picture in the sheet
COLUMNS = 3  # of a sheet of one view
SUFFIXES = (".png", ".jpg", ".webp")


class Shots(NamedTuple):
    """What one sheet shows; no weathers: that of the run. A picture for each of their combinations."""

    views: Sequence[View]
    weathers: Sequence[Weather] = ()
    drops: bool = False  # each picture a second time, with rain drops on the lens

    @property
    def columns(self) -> int:
        """Returns how many pictures stand beside each other: all of a view, where there are several."""
        per_view = max(len(self.weathers), 1) * (1 + self.drops)
        if len(self.views) > 1 and per_view == 1:
            return min(len(self.views), COLUMNS)
        if len(self.views) > 1:
            return per_view
        return 2 if self.drops else min(per_view, COLUMNS)


def write_sheet(
    source: Source, k: int, shots: Shots, path: Path, looks: Looks = FOR_PEOPLE
) -> Path:
    """Writes the pictures of moment k to one file, .png, .jpg or .webp, and returns its path.

    ConfigError for another ending, OutputError when it cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise ConfigError(f"a picture's file ends in {', '.join(SUFFIXES)}, got {path}")
    pictures = list(_pictures(source, k, shots, looks))
    pictures += [np.zeros_like(pictures[0])] * (-len(pictures) % shots.columns)
    rows = [pictures[i : i + shots.columns] for i in range(0, len(pictures), shots.columns)]
    sheet = np.vstack([np.hstack(row) for row in rows])
    data = cv2.imencode(path.suffix, sheet)[1]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise OutputError(f"cannot write the picture {path}: {error.strerror}") from error
    return path


def _pictures(source: Source, k: int, shots: Shots, looks: Looks) -> Iterator[Picture]:
    """Yields the titled pictures of the moment: by view, then weather, then without and with drops."""
    outside = source.seat(k).outside
    studio = Studio(source.map, source.table, outside, source.seed, looks=looks)
    truth = source.moment(k).truth
    for view in shots.views:
        for weather in shots.weathers or (outside.weather,):
            studio.change(replace(outside, weather=weather))
            images = studio.look(truth, source.crash(k))
            title = f"{view.value}, {weather.name}, {truth.tick * DT:.2f} s"
            lens = Lens(weather, source.seed)
            seen = [(images, "")] + [(lens.add_drops(images), ", drops")] * shots.drops
            for shown, added in seen:
                image = shown[view.value]
                if view is View.SEMANTIC:
                    picture = np.ascontiguousarray(cityscapes_colours(plane(image))[..., ::-1])
                elif added and image.rgb is not None:
                    picture = np.ascontiguousarray(image.rgb[..., ::-1])
                else:
                    picture = colours(plane(image))
                yield _frame_with_title(picture, title + added)


def _frame_with_title(picture: Picture, title: str) -> Picture:
    """Returns the picture in the size of the sheet's, bars beside it where its shape differs, titled."""
    scale = min(WIDTH / picture.shape[1], HEIGHT / picture.shape[0])
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    framed = np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)
    top, left = (HEIGHT - small.shape[0]) // 2, (WIDTH - small.shape[1]) // 2
    framed[top : top + small.shape[0], left : left + small.shape[1]] = small
    write_text(framed, title, 12, HEIGHT - 14, INK, 0.6, 1)
    cv2.rectangle(framed, (0, 0), (WIDTH - 1, HEIGHT - 1), DIM, 1)
    return framed
