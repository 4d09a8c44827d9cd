"""A trend as a chart with axes: share of cycles over days, with its interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from html import escape

from skidpad.fleet.insight.trends import Trend

WIDTH, HEIGHT = 260.0, 130.0
LEFT, RIGHT, TOP, BOTTOM = 42.0, 14.0, 12.0, 24.0  # room around the plot for its labels
INK, LINE = "#9aa5b1", "#4d9dff"
TOPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # of the share's axis


def trend_svg(trends: Sequence[Trend], name: str) -> str:
    """Draw the share of cycles in violation over time, with its interval as a band (of one day: a bar)."""
    most = max(max(t.interval.high, t.share) for t in trends)
    top = next((limit for limit in TOPS if limit >= most), 1.0)
    first, last = trends[0].at, trends[-1].at
    span = last - first

    def x(at: float) -> float:
        part = (at - first) / span if span > 0.0 else 0.5
        return LEFT + part * (WIDTH - LEFT - RIGHT)

    def y(share: float) -> float:
        return HEIGHT - BOTTOM - share / top * (HEIGHT - TOP - BOTTOM)

    dates = [first] if span <= 0.0 else [first, last]
    body = _axes(top, y) + "".join(_date(x(at), at, len(dates) > 1) for at in dates)
    body += _data([(x(t.at), y(t.share), y(t.interval.low), y(t.interval.high)) for t in trends])
    return (
        f'<svg role="img" aria-label="{escape(name)}" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" '
        f'font-size="11" fill="{INK}" style="width:100%;background:#0d1014">{body}</svg>'
    )


def _axes(top: float, y: Callable[[float], float]) -> str:
    """Lines at nothing, half and the top of the axis, each with its share in percent."""
    return "".join(
        f'<path d="M{LEFT:g} {y(share):.1f}H{WIDTH - RIGHT:g}" stroke="#303944"/>'
        f'<text x="{LEFT - 4:g}" y="{y(share) + 4:.1f}" text-anchor="end">{100 * share:g} %</text>'
        for share in (0.0, top / 2, top)
    )


def _date(x: float, at: float, is_end: bool) -> str:
    """A day (UTC) under the plot; the first and the last of several stay within the picture."""
    day = f"{datetime.fromtimestamp(at, timezone.utc):%Y-%m-%d}"
    anchor = "middle" if not is_end else "start" if x < WIDTH / 2 else "end"
    return f'<text x="{x:.1f}" y="{HEIGHT - 8:g}" text-anchor="{anchor}">{day}</text>'


def _data(points: Sequence[tuple[float, float, float, float]]) -> str:
    """Points (x, share, low, high) as a line within a band; a single one as a dot on a bar."""
    if len(points) == 1:
        x, share, low, high = points[0]
        return (
            f'<path d="M{x:.1f} {low:.1f}V{high:.1f}" stroke="{LINE}" stroke-opacity=".5" '
            f'stroke-width="6"/><circle cx="{x:.1f}" cy="{share:.1f}" r="4" fill="{LINE}"/>'
        )
    band = [(x, high) for x, _, _, high in points] + [(x, low) for x, _, low, _ in points[::-1]]
    line = [(x, share) for x, share, _, _ in points]
    return (
        f'<polygon points="{_points(band)}" fill="{LINE}" fill-opacity=".3"/>'
        f'<polyline points="{_points(line)}" fill="none" stroke="{LINE}" stroke-width="2"/>'
    )


def _points(points: Sequence[tuple[float, float]]) -> str:
    """Returns points as the text of an SVG attribute, one decimal."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
