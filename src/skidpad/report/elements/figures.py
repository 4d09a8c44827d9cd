"""Charts as inline SVG. Each function takes plain numbers and draws one kind of chart."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import ArrayLike

INK, FRAME = "#1c2530", "#8996a3"
PALETTE = ("#2b6cb0", "#d9541e", "#1f7a4d", "#8a5fb0", "#b8860b", "#5b6875", "#c2458a", "#2a9d8f")
STYLE: dict[Any, Any] = {
    "svg.hashsalt": "skidpad",  # the same data give the same bytes
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["system-ui", "Segoe UI", "Roboto", "DejaVu Sans"],
    "font.size": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e8ed",
    "grid.linewidth": 0.7,
    "axes.edgecolor": FRAME,
    "legend.frameon": False,
}


LEGEND_CHARACTERS = 12.0  # of its font, per inch
WIDEST = 4.0  # times the largest estimate, of an axis with intervals
POINTS_REACH = 1.0  # least reach of an axis of points
LEGEND_MARK = 5  # characters that a mark and its spaces take


@dataclass(frozen=True, slots=True)
class Series:
    """One colour of a chart: values with optional interval ends; None where there is no value."""

    name: str
    values: Sequence[float | None]
    low: Sequence[float | None] = ()
    high: Sequence[float | None] = ()
    published: Sequence[float | None] = ()  # drawn as hollow diamonds
    colour: int | None = None  # of the palette; None: by its place in the chart
    marker: str = "o"  # of points


@contextmanager
def canvas(
    width: float = 8.4, height: float = 3.4, columns: int = 1, rows: int = 1
) -> Iterator[tuple[Canvas, list[Axes]]]:
    """Yields a figure of `width` by `height` inches with its axes, row by row, in the common style."""
    with mpl.rc_context(STYLE):
        figure = Canvas(figsize=(width, height), layout="constrained")
        axes = figure.subplots(rows, columns, sharex="col", squeeze=False)
        yield figure, list(axes.ravel())


def svg_of(figure: Canvas) -> str:
    """Returns the figure as an SVG element that scales with the page; equal figures give equal text."""
    with mpl.rc_context(STYLE):
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = _numbered_ids(text[text.index("<svg") :])
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*"',
        r"\1",
        re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1),
        count=1,
    )


def _numbered_ids(text: str) -> str:
    """Returns the SVG with ids numbered by order of appearance behind a hash of the drawing.

    The library's own may vary between calls, and two charts in one page must not share any.
    """
    order = {
        old: str(k) for k, old in enumerate(dict.fromkeys(re.findall(r'\bid="([^"]+)"', text)))
    }

    def rename_ids(prefix: str) -> str:
        def swap(match: re.Match[str]) -> str:
            new = order.get(match[2])
            return match[0] if new is None else f"{match[1]}{prefix}{new}{match[3]}"

        return re.sub(r'(\bid="|url\(#|href="#)([^")]+)(["\)])', swap, text)

    return rename_ids("c" + hashlib.sha256(rename_ids("").encode()).hexdigest()[:8] + "-")


def grouped_bars(groups: Sequence[str], series: Sequence[Series], y_label: str) -> str:
    """Returns an SVG of bars side by side per group, with intervals and published values."""
    with canvas() as (figure, (axes,)):
        draw_bars(axes, groups, series, y_label)
        if len(series) > 1 or any(s.published for s in series):
            figure.legend(loc="outside upper center", ncols=min(len(series) + 1, 6))
        return svg_of(figure)


def draw_bars(axes: Axes, groups: Sequence[str], series: Sequence[Series], y_label: str) -> None:
    """Draws bars per group into the axes, and an arrow where an interval is cut off."""
    width = 0.8 / len(series)
    named = False
    for k, one in enumerate(series):
        x = [g + (k - (len(series) - 1) / 2) * width for g in range(len(groups))]
        heights = [v if v is not None else float("nan") for v in one.values]
        axes.bar(x, heights, 0.9 * width, color=_ink(one, k), label=one.name)
        if one.low:
            for xi, v, lo, hi in zip(x, one.values, one.low, one.high, strict=True):
                if v is not None and lo is not None and hi is not None:
                    axes.plot([xi, xi], [lo, hi], color=INK, linewidth=1.0)
        known = [(xi, v) for xi, v in zip(x, one.published, strict=False) if v is not None]
        if known:
            axes.plot(
                *zip(*known, strict=True),
                "D",
                markersize=4.5,
                markerfacecolor="white",
                markeredgecolor=INK,
                linestyle="none",
                label=None if named else "published",
            )
            named = True
    axes.set_xticks(range(len(groups)), groups)
    axes.set_ylabel(y_label)
    axes.set_ylim(0.0, min(axes.get_ylim()[1], interval_reach(series)))
    _mark_cut_bars(axes, series, len(groups), width)
    axes.grid(axis="x", visible=False)


def _mark_cut_bars(axes: Axes, series: Sequence[Series], groups: int, width: float) -> None:
    """Draws an arrow at the upper edge over each bar whose interval goes on beyond it."""
    top = axes.get_ylim()[1]
    cut = [
        (g + (k - (len(series) - 1) / 2) * width, top)
        for k, one in enumerate(series)
        for g, high in zip(range(groups), one.high, strict=False)
        if high is not None and high > top
    ]
    for x, y in cut:
        axes.plot([x], [y], marker="^", color=INK, markersize=5, clip_on=False)


def interval_reach(series: Sequence[Series], least: float = 0.0) -> float:
    """Returns how far an axis may go for the sake of intervals: WIDEST times the largest value.

    At least `least`; inf where both are 0. A few wide intervals would press all estimates into one
    place.
    """
    values = [abs(v) for one in series for v in (*one.values, *one.published) if v is not None]
    return max(WIDEST * max(values, default=0.0), least) or float("inf")


def cut_note(series: Sequence[Series], least: float = 0.0) -> str:
    """Returns the sentence of a caption where an interval goes beyond the axis, else ""."""
    reach = interval_reach(series, least)
    ends = (end for one in series for end in (*one.low, *one.high) if end is not None)
    cut = any(abs(end) > reach for end in ends)
    return " An arrow at the edge: the interval goes on beyond the axis." if cut else ""


def points_with_intervals(
    rows: Sequence[str], series: Sequence[Series], x_label: str, origin: float | None = None
) -> str:
    """Returns an SVG of estimates as points on a common scale, a row per label, intervals as lines.

    A bound that holds on one side is an arrow, an estimate without limits is hollow. origin: where a
    vertical rule is drawn; None: the axis begins at 0.
    """
    height = 1.1 + 0.3 * len(rows) + 0.12 * len(rows) * len(series)
    with canvas(height=height) as (figure, (axes,)):
        heights = [
            [r + 0.6 * ((k + 0.5) / len(series) - 0.5) for r in range(len(rows))]
            for k in range(len(series))
        ]
        for k, one in enumerate(series):
            _draw_points(axes, heights[k], one, _ink(one, k))
        if origin is not None:
            axes.axvline(origin, color=INK, linewidth=0.9)
        _keep_points_apart(axes, series, origin)
        for k, one in enumerate(series):
            _mark_cut_points(axes, heights[k], one, _ink(one, k))
        axes.set_yticks(range(len(rows)), rows)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel(x_label)
        axes.grid(axis="y", visible=False)
        if len(series) > 1:
            figure.legend(
                loc="outside upper center", ncols=legend_columns([s.name for s in series], 8.4)
            )
        return svg_of(figure)


def _keep_points_apart(axes: Axes, series: Sequence[Series], origin: float | None) -> None:
    """Limits the x axis to `interval_reach`; without an origin it begins at 0."""
    reach = interval_reach(series, POINTS_REACH)
    low, high = axes.get_xlim()
    axes.set_xlim(0.0 if origin is None else max(low, -reach), min(high, reach))


def _mark_cut_points(axes: Axes, heights: Sequence[float], one: Series, ink: str) -> None:
    """Draws an arrow at the left or right edge, at each height whose interval goes on beyond it."""
    left, right = axes.get_xlim()
    for y, low, high in zip(heights, one.low, one.high, strict=False):
        for mark, edge, end in (("<", left, low), (">", right, high)):
            if end is not None and not left <= end <= right:
                style: dict[str, Any] = {"marker": mark, "color": ink, "markersize": 6}
                axes.plot([edge], [y], clip_on=False, **style)


def _ink(one: Series, place: int) -> str:
    """Returns the colour of a series: its own of the PALETTE, else that of its place in the chart."""
    return PALETTE[(place if one.colour is None else one.colour) % len(PALETTE)]


def _draw_points(axes: Axes, y: Sequence[float], one: Series, ink: str) -> None:
    """Draws the estimates of one series at the heights y, with intervals or bounds."""
    style: dict[str, Any] = {
        "marker": one.marker,
        "color": ink,
        "markersize": 6.5,
        "linestyle": "none",
    }
    ends = zip(one.low, one.high, strict=True) if one.low else [(None, None)] * len(y)
    for k, ((low, high), yi, v) in enumerate(zip(ends, y, one.values, strict=True)):
        if v is None:
            continue
        known = [end for end in (low, high) if end is not None]
        face = ink if known else "white"
        name = None if k else one.name
        axes.plot([v], [yi], label=name, markerfacecolor=face, clip_on=False, zorder=3, **style)
        if known:
            ends_of_line = [min(*known, v), max(*known, v)]
            axes.plot(ends_of_line, [yi, yi], color=ink, linewidth=1.4)
        if len(known) == 1:
            axes.plot(known, [yi], marker="<" if low is None else ">", color=ink, markersize=5)


def stacked_bars(rows: Sequence[str], series: Sequence[Series], x_label: str) -> str:
    """Returns an SVG of parts of a whole per row, laid end to end; None counts as 0."""
    with canvas(height=1.2 + 0.36 * len(rows)) as (figure, (axes,)):
        left = [0.0] * len(rows)
        for k, one in enumerate(series):
            widths = [v or 0.0 for v in one.values]
            colour = _ink(one, k)
            axes.barh(range(len(rows)), widths, 0.6, left=left, color=colour, label=one.name)
            left = [a + b for a, b in zip(left, widths, strict=True)]
        axes.set_yticks(range(len(rows)), rows)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel(x_label)
        axes.grid(axis="y", visible=False)
        figure.legend(
            loc="outside upper center", ncols=legend_columns([s.name for s in series], 8.4)
        )
        return svg_of(figure)


def panel(groups: Sequence[str], charts: Sequence[tuple[str, Series]]) -> str:
    """Returns an SVG of small bar charts beside each other, one (label, series) each."""
    with canvas(width=10.5, height=2.9, columns=len(charts)) as (figure, all_axes):
        for axes, (label, series) in zip(all_axes, charts, strict=True):
            draw_bars(axes, groups, [series], label)
            axes.tick_params(axis="x", labelrotation=60, labelsize=8)
        return svg_of(figure)


@dataclass(frozen=True, slots=True)
class Curve:
    """Holds a line or a cloud of points; curves of one name share their entry in the legend."""

    name: str
    x: ArrayLike
    y: ArrayLike
    colour: int | None = None  # of the palette; None: by its place in the chart
    band: tuple[ArrayLike, ArrayLike] | None = None  # shaded, low and high
    style: Mapping[str, Any] = field(default_factory=dict)  # as for the library


@dataclass(frozen=True, slots=True)
class Chart:
    """Curves in one pair of axes."""

    curves: Sequence[Curve]
    x_label: str
    y_label: str
    title: str = ""
    log: bool = False
    y_range: tuple[float, float] | None = None
    x_range: tuple[float, float] | None = None
    rules: Sequence[float] = ()  # horizontal dashes at these heights
    equal: bool = False  # one unit is as long on both axes


POINTS = {"marker": "o", "linestyle": "none", "alpha": 0.75, "markersize": 5}


def curves(
    charts: Sequence[Chart], width: float = 8.4, height: float = 3.4, stacked: bool = False
) -> str:
    """Returns an SVG of charts beside (stacked: above) each other, in inches, with one legend.

    The legend is left out where there is one name.
    """
    rows, columns = (len(charts), 1) if stacked else (1, len(charts))
    named: set[str] = set()
    with canvas(width, height, columns, rows) as (figure, all_axes):
        for axes, chart in zip(all_axes, charts, strict=True):
            _draw_curves(axes, chart, named)
            axes.set_ylabel(chart.y_label)
            if not stacked or axes is all_axes[-1]:
                axes.set_xlabel(chart.x_label)
        if len(named) > 1:
            figure.legend(loc="outside upper center", ncols=legend_columns(named, width))
        return svg_of(figure)


def legend_columns(names: Iterable[str], width: float) -> int:
    """Returns 1 to 6, the columns of a legend in which the longest name fits; width: inches."""
    longest = max(map(len, names)) + LEGEND_MARK
    return max(1, min(6, int(width * LEGEND_CHARACTERS / longest)))


def _draw_curves(axes: Axes, chart: Chart, named: set[str]) -> None:
    """Draws a chart's curves, bands and rules; adds their names to `named`, which are labelled once."""
    for k, curve in enumerate(chart.curves):
        colour = PALETTE[(k if curve.colour is None else curve.colour) % len(PALETTE)]
        if curve.band is not None:
            axes.fill_between(curve.x, *curve.band, color=colour, alpha=0.15, linewidth=0)
        style = {"linewidth": 1.5, "color": colour, **curve.style}
        axes.plot(curve.x, curve.y, label=None if curve.name in named else curve.name, **style)
        named.add(curve.name)
    for height in chart.rules:
        axes.axhline(height, color=FRAME, linewidth=0.6, linestyle=(0, (6, 6)))
    if chart.title:
        axes.set_title(chart.title, fontsize=9.5, loc="left")
    if chart.log:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")  # not 10^-1, which is set slowly and read slowly
    if chart.y_range:
        axes.set_ylim(*chart.y_range)
    if chart.equal:
        axes.set_aspect("equal")
    if chart.x_range:
        axes.set_xlim(*chart.x_range)


Named = tuple[str, ArrayLike, ArrayLike]  # name, x, y


def scatter(points: Sequence[Named], x_label: str, y_label: str) -> str:
    """Returns an SVG of clouds of points (name, x, y) in one chart."""
    clouds = [Curve(*one, style=POINTS) for one in points]
    return curves([Chart(clouds, x_label, y_label)], height=3.6)


def lines(series: Sequence[Named], x_label: str, y_label: str) -> str:
    """Returns an SVG of curves (name, x, y) in one chart."""
    return curves([Chart([Curve(*one) for one in series], x_label, y_label)])
