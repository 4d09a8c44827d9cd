"""Figures of a threshold map: the map itself, and completion over friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from skidpad.evidence.grip.threshold import Situation
from skidpad.report.elements.figures import FRAME, INK, Chart, Curve, canvas, curves, svg_of

COLOURS = "YlOrRd"
NOT_SHOWN = "#d5dae0"
DARK = 0.6  # share of the scale above which text is white
TOP = 0.9  # end of the colour scale, the friction of a dry road
COLUMNS = 3  # charts beside each other


def map_figure(groups: Mapping[str, Sequence[Situation]]) -> str:
    """Returns an SVG with a panel per group: starts against decelerations, coloured by the threshold."""
    columns = min(2, len(groups))
    rows = -(-len(groups) // columns)
    with canvas(9.6, 2.9 * rows, columns, rows) as (figure, all_axes):
        for axes, (name, found) in zip(all_axes, groups.items(), strict=False):
            _panel(axes, found)
            axes.set_title(name, fontsize=9.5, loc="left")
        for axes in all_axes[len(groups) :]:
            axes.set_axis_off()
        return svg_of(figure)


def _panel(axes: Axes, found: Sequence[Situation]) -> None:
    """Draws one map: a square with the threshold per situation, start by deceleration in m/s²."""
    starts = list(dict.fromkeys(s.start for s in sorted(found, key=_order)))
    brakings = sorted({s.deceleration for s in found})
    scale = mpl.colormaps[COLOURS]
    for s in found:
        x, y = brakings.index(s.deceleration), starts.index(s.start)
        mu = s.threshold.mu if s.tells else None
        colour = "white" if mu is None else scale(mu / TOP)
        axes.add_patch(
            mpl.patches.Rectangle(
                (x - 0.5, y - 0.5), 1.0, 1.0, facecolor=colour if s.tells else NOT_SHOWN,
                edgecolor=FRAME, linewidth=0.5,
            )
        )  # fmt: skip
        if s.tells:
            ink = "white" if mu is not None and mu / TOP > DARK else INK
            low, high = s.threshold.interval
            told = f"< {s.threshold.least:.2f}"
            if mu is not None:
                told = f"{mu:.2f}\n{low:.2f} to {high:.2f}"
            axes.text(x, y, told, ha="center", va="center", fontsize=7.5, color=ink)
    axes.set_xlim(-0.5, len(brakings) - 0.5)
    axes.set_ylim(-0.5, len(starts) - 0.5)
    axes.set_xticks(range(len(brakings)), [f"{b:g}" for b in brakings])
    axes.set_yticks(range(len(starts)), starts)
    axes.tick_params(labelbottom=True)
    axes.set_xlabel("deceleration of the lead, m/s²")
    axes.grid(visible=False)


def _order(s: Situation) -> tuple[float, float]:
    """Returns the sort key of a start: the highest speed first, then the smallest gap."""
    return (-s.speed_kmh, s.gap_m)


def curve_figures(groups: Mapping[str, Sequence[Situation]]) -> dict[str, str]:
    """Returns SVGs by name of a group: a chart per start, a curve per deceleration, telling ones alone.

    More than COLUMNS charts go on under NAME, continued.
    """
    found = {}
    for name, all_of in groups.items():
        telling = sorted((s for s in all_of if s.tells), key=_order)
        brakings = sorted({s.deceleration for s in all_of})
        charts = [
            Chart(
                [_curve(s, brakings.index(s.deceleration)) for s in telling if s.start == start],
                "friction",
                "completed, %",
                start,
                y_range=(-3.0, 103.0),
                rules=(50.0,),
            )
            for start in dict.fromkeys(s.start for s in telling)
        ]
        for k in range(0, len(charts), COLUMNS):
            part = f"{name}" if k == 0 else f"{name}, continued"
            found[part] = curves(charts[k : k + COLUMNS], width=9.6, height=3.0)
    return found


def _curve(s: Situation, colour: int) -> Curve:
    """Returns the share completed in % over friction with its 95 % band, of one situation."""
    shares = [s.at(mu) for mu in s.levels]
    limits = 100.0 * np.array([share.interval for share in shares])
    values = [100.0 * (share.value or 0.0) for share in shares]
    name = f"{s.deceleration:g} m/s²"
    band = (limits[:, 0], limits[:, 1])
    return Curve(
        name, s.levels, values, colour=colour, band=band, style={"marker": "o", "markersize": 3}
    )
