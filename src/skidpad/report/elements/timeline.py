"""Timelines of many quantities over one drive as inline SVG, one strip each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats

BINS = 420  # over the width; a bin shows the least and greatest value in it
LEFT, WIDTH, STRIP, GAP = 232.0, 840.0, 30.0, 9.0  # px
ALARM = "#d9541e"


@dataclass(frozen=True, slots=True)
class Strip:
    """One quantity drawn over time."""

    label: str
    t: Floats  # (k,) s
    value: Floats  # (k,), NaN: not evaluated
    alarm: NDArray[np.bool_]  # (k,)
    low: float = 0.0  # of the scale
    high: float = 1.0
    threshold: float | None = None
    note: str = ""  # right of the strip


@dataclass(frozen=True, slots=True)
class Mark:
    """A stretch of time that is shaded over all strips."""

    t_start: float
    t_end: float
    name: str


def timelines(strips: Sequence[Strip], marks: Sequence[Mark], t0: float, t1: float) -> str:
    """Returns an SVG element: strips below each other on one time axis from t0 to t1 s.

    Alarms and marks are orange.
    """
    t1 = max(t1, t0 + 0.1)
    top = 22.0 if marks else 4.0
    height = top + len(strips) * (STRIP + GAP) + 24.0
    box = f"0 0 {LEFT + WIDTH + 110:.0f} {height:.0f}"
    parts = [f'<svg class="timeline" viewBox="{box}" role="img" aria-label="indicators over time">']
    bottom = height - 24.0
    parts += _marks(marks, t0, t1, top, bottom)
    for i, strip in enumerate(strips):
        parts.append(_strip(strip, top + i * (STRIP + GAP), t0, t1))
    parts += _axis(t0, t1, bottom)
    return "".join(parts) + "</svg>"


def _x(t: float, t0: float, t1: float) -> float:
    """Returns the x coordinate in the drawing of the time `t` between `t0` and `t1`, all in s."""
    return LEFT + WIDTH * (t - t0) / (t1 - t0)


def _marks(marks: Sequence[Mark], t0: float, t1: float, top: float, bottom: float) -> list[str]:
    """Returns an SVG group per mark, a titled band from `top` to `bottom`; t0 and t1 are in s."""
    out = []
    for mark in marks:
        a, b = _x(mark.t_start, t0, t1), _x(mark.t_end, t0, t1)
        title = escape(f"{mark.name}, {mark.t_start:.1f} to {mark.t_end:.1f} s")
        out.append(
            f'<g><title>{title}</title><rect x="{a:.1f}" y="{top - 6:.1f}" '
            f'width="{max(b - a, 2.0):.1f}" height="{bottom - top + 6:.1f}" fill="{ALARM}" '
            f'opacity=".16"/><path d="M{a:.1f} {top - 6:.1f}l-4 -8h8z" fill="{ALARM}"/></g>'
        )
    return out


def _strip(s: Strip, y: float, t0: float, t1: float) -> str:
    """Returns the SVG group of one strip at height `y`: values, threshold, alarms, gaps and note."""
    bins = min(BINS, max(len(s.t) // 2, 1))  # none without a value, where there are few
    edges = np.clip(((s.t - t0) / (t1 - t0) * bins).astype(int), 0, bins - 1)
    known = np.isfinite(s.value)
    low, high = np.full(bins, np.inf), np.full(bins, -np.inf)
    np.minimum.at(low, edges[known], s.value[known])
    np.maximum.at(high, edges[known], s.value[known])
    alarm = np.bincount(edges[s.alarm], minlength=bins) > 0
    missing = (np.bincount(edges[~known], minlength=bins) > 0) & ~np.isfinite(low)
    scale = STRIP / max(s.high - s.low, 1e-9)
    step = WIDTH / bins

    def at(value: float) -> float:
        return y + STRIP - scale * (min(max(value, s.low), s.high) - s.low)

    parts = [
        f'<g><text x="{LEFT - 10:.0f}" y="{y + 19:.0f}" text-anchor="end">{escape(s.label)}</text>',
        f'<rect x="{LEFT}" y="{y:.0f}" width="{WIDTH}" height="{STRIP}" class="ground"/>',
    ]
    for a, n in _runs(missing):
        parts.append(
            f'<rect x="{LEFT + a * step:.1f}" y="{y:.0f}" width="{n * step:.1f}" '
            f'height="{STRIP}" class="missing"/>'
        )
    for a, n in _runs(np.isfinite(low)):
        up = [f"{LEFT + (k + 0.5) * step:.1f} {at(high[k]) - 0.6:.1f}" for k in range(a, a + n)]
        down = [
            f"{LEFT + (k + 0.5) * step:.1f} {at(low[k]) + 0.6:.1f}"
            for k in range(a + n - 1, a - 1, -1)
        ]
        parts.append(f'<path d="M{"L".join([*up, *down])}z" class="value"/>')
    if s.threshold is not None:
        parts.append(f'<path d="M{LEFT} {at(s.threshold):.1f}h{WIDTH}" class="bound"/>')
    for a, n in _runs(alarm):
        parts.append(
            f'<rect x="{LEFT + a * step:.1f}" y="{y + STRIP - 3:.1f}" '
            f'width="{max(n * step, 1.6):.1f}" height="3" fill="{ALARM}"/>'
        )
    if s.note:
        parts.append(
            f'<text x="{LEFT + WIDTH + 10:.0f}" y="{y + 19:.0f}" class="note">{escape(s.note)}</text>'
        )
    return "".join(parts) + "</g>"


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Returns the stretches of true values as (first, length)."""
    padded = np.concatenate([[False], flags, [False]])
    change = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(a), int(b - a)) for a, b in zip(change[::2], change[1::2], strict=True)]


def _axis(t0: float, t1: float, y: float) -> list[str]:
    """Returns SVG ticks with labels in s below the strips, at most about 13 over the span."""
    span = t1 - t0
    step = next(
        s for s in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 1e9) if span / s <= 12
    )
    out = []
    for t in np.arange(np.ceil(t0 / step) * step, t1 + 1e-6, step):
        x = _x(float(t), t0, t1)
        out.append(
            f'<path d="M{x:.1f} {y:.0f}v4" class="tick"/>'
            f'<text x="{x:.1f}" y="{y + 17:.0f}" text-anchor="middle" class="note">{t:g} s</text>'
        )
    return out
