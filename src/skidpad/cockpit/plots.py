"""Plots of speed, gap and grip under the pictures of a film, with the moment that each one shows."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import cv2
import numpy as np

from skidpad.cockpit.indicators import FAR
from skidpad.cockpit.pictures import Picture
from skidpad.cockpit.source import Source
from skidpad.core.setup import DT

Ink = tuple[int, int, int]  # blue, green, red
GROUND, FRAME, DIM, NOW = (43, 35, 29), (68, 57, 48), (177, 165, 154), (255, 255, 255)
SPEED, LIMIT, GAP, GRIP, CRASH = (
    (255, 157, 77),
    (82, 133, 255),
    (127, 206, 79),
    (65, 180, 242),
    (82, 91, 255),
)
LEFT, RIGHT, ROW, PLOT, FOOT = 76, 24, 96, 58, 34  # px: beside the axes, a row, its axes, below all
SIZE = 0.72  # of the letters
Values = Sequence[float | None]


class Plots:
    """Draws the plots of a stretch once, and then the moment of each picture into a copy."""

    def __init__(self, source: Source, moments: Sequence[int], width: int) -> None:
        """moments: of the stretch, in order. width: of the pictures in px."""
        curves = source.curves(slice(None))
        self._first, self._last, self._width = moments[0], max(moments[-1], moments[0] + 1), width
        part = slice(self._first, self._last + 1)
        speed, limit = curves.speed[part], curves.limit[part]
        fastest = max((v for v in (*speed, *limit) if v is not None), default=0.0)
        self._values: tuple[Values, ...] = (speed, curves.gap[part], curves.grip[part])
        most = (20 * max(ceil(fastest / 20), 1), round(FAR), 1)
        rows = zip(
            ("speed, km/h", "gap to what is ahead, m", "grip of the tyres"),
            (SPEED, GAP, GRIP),
            most,
            strict=True,
        )
        self._plain: Picture = np.full((3 * ROW + FOOT, width, 3), GROUND, dtype=np.uint8)
        for row, (name, ink, top) in enumerate(rows):
            self._frame(row, name, ink, top)
            if row == 0 and limit:
                self._curve(0, limit, top, LIMIT)
                self._write(self._plain, "speed envelope", LEFT + 170, ROW - PLOT - 13, LIMIT)
            self._curve(row, self._values[row], top, ink)
        self._foot(source)

    def at(self, k: int) -> Picture:
        """Returns the plots with the moment k of the source on them, and the values there."""
        shown: Picture = self._plain.copy()
        for row, values in enumerate(self._values):
            self._rule(shown, row, k, NOW)
            v = values[k - self._first]
            text = "-" if v is None else f"{v:.2f}" if row == 2 else f"{v:.0f}"
            self._write(shown, text, self._width - RIGHT, row * ROW + 26, NOW, 1.0)
        return shown

    def _column(self, k: int) -> int:
        """Returns the px of a moment."""
        share = (k - self._first) / (self._last - self._first)
        return LEFT + round(share * (self._width - LEFT - RIGHT))

    def _frame(self, row: int, name: str, ink: Ink, top: float) -> None:
        """Draws a plot without its curve: name and axes with numbers at the ends."""
        low = (row + 1) * ROW - 4
        corners = (LEFT - 1, low - PLOT - 1), (self._width - RIGHT + 1, low + 1)
        cv2.rectangle(self._plain, *corners, FRAME, 1)
        self._write(self._plain, name, LEFT, low - PLOT - 9, ink)
        self._write(self._plain, f"{top:g}", LEFT - 8, low - PLOT + 15, DIM, 1.0)
        self._write(self._plain, "0", LEFT - 8, low, DIM, 1.0)

    def _curve(self, row: int, values: Values, top: float, ink: Ink) -> None:
        """Draws a curve, with a gap where there is no value and a dot for a lone one."""
        low = (row + 1) * ROW - 4
        run: list[tuple[int, int]] = []
        for i, v in enumerate((*values, None)):
            if v is not None:
                height = round(PLOT * min(max(v / top, 0.0), 1.0))
                run.append((self._column(self._first + i), low - height))
            elif run:
                points = np.array(run, dtype=np.int32)
                cv2.polylines(self._plain, [points], False, ink, 2, cv2.LINE_AA)
                if len(run) == 1:
                    cv2.circle(self._plain, run[0], 2, ink, cv2.FILLED)
                run = []

    def _foot(self, source: Source) -> None:
        """Draws the crashes of the stretch, and its first and last time in s."""
        for tick, kind, _ in source.marks:
            k = (tick - source.tick(0)) // source.step
            if kind == "crash" and self._first <= k <= self._last:
                for row in range(3):
                    self._rule(self._plain, row, k, CRASH)
        y = 3 * ROW + 24
        ends = (source.tick(min(k, source.ticks - 1)) * DT for k in (self._first, self._last))
        for t, x, share in zip(ends, (LEFT, self._width - RIGHT), (0.0, 1.0), strict=True):
            self._write(self._plain, f"{t:.1f} s", x, y, DIM, share)

    def _rule(self, picture: Picture, row: int, k: int, ink: Ink) -> None:
        """Draws a moment into one plot, in place."""
        x, low = self._column(k), (row + 1) * ROW - 4
        cv2.rectangle(picture, (x - 1, low - PLOT), (x + 1, low), ink, cv2.FILLED)

    def _write(
        self, picture: Picture, text: str, x: int, y: int, ink: Ink, share: float = 0.0
    ) -> None:
        """Writes text with `share` of its width left of x, in place."""
        (wide, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, SIZE, 1)
        at = (x - round(share * wide), y)
        cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, SIZE, ink, 1, cv2.LINE_AA)
