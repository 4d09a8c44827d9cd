"""One picture per fatal event: the view ahead, with the top view in its corner (A-257)."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.core.files.names import path_part, slug
from skidpad.core.frames import SensorFrame
from skidpad.core.vocabulary import RelocationReason
from skidpad.recording.campaign.folder import SNAPSHOTS
from skidpad.recording.files import write_atomically

FRONT, TOP = "rgb_front", "rgb_top"
MARGIN = 12  # px
FATAL = (  # without a contact
    RelocationReason.WRONG_WAY,
    RelocationReason.OFF_ROAD,
    RelocationReason.ROLL_OVER,
)


class Snapshots(Sink):
    """Writes PNG files named by configuration, weather and time; without a folder it does nothing."""

    sees_all = False

    def __init__(self, folder: Path | None, driver: str, weather: str, dt: float) -> None:
        self.folder = None if folder is None else folder / SNAPSHOTS
        self.stem, self.dt = path_part(f"{slug(driver)}_{weather}"), dt
        self.paths: list[Path] = []

    def see(self, moment: Moment) -> None:
        """Takes a picture when the ego touches something, or was moved for a reason in FATAL."""
        relocate = moment.action.relocate
        moved = None if relocate is None else relocate.moved
        if moment.truth.contacts or (moved is not None and moved.reason in FATAL):
            self.take(moment.frame)

    def take(self, frame: SensorFrame) -> None:
        """Writes the front picture of this moment with the top view inset; nothing without images."""
        if self.folder is None or FRONT not in frame.images:
            return
        front = frame.images[FRONT].rgb
        if front is None:
            return
        picture = front.copy()
        if TOP in frame.images and (top := frame.images[TOP].rgb) is not None:
            _inset(picture, top)
        path = self.folder / f"{self.stem}_{frame.tick * self.dt:07.2f}s.png"
        write_atomically(path, partial(_save, Image.fromarray(picture)))
        self.paths.append(path)


def _save(picture: Image.Image, path: Path) -> None:
    """Writes the picture as PNG, compressed the same way each time."""
    picture.save(path, format="PNG", optimize=False, compress_level=3)


def _inset(picture: np.ndarray, small: np.ndarray) -> None:
    """Copies `small` into the upper right corner of `picture`, in place; nothing if it does not fit."""
    h, w = small.shape[:2]
    if h + MARGIN <= picture.shape[0] and w + MARGIN <= picture.shape[1]:
        picture[MARGIN : MARGIN + h, -MARGIN - w : -MARGIN] = small
