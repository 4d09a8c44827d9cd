"""Figures of the friction report: series over time, steering, trajectories (B-140, B-141, B-146)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.setup import DT
from skidpad.core.text.wording import count_text
from skidpad.evidence.grip.study import ORIGINAL, REDUCED, CellSeries, Pair
from skidpad.report.elements.figures import Chart, Curve, curves
from skidpad.report.elements.page import Block, Figure
from skidpad.report.grip.data import GripCampaign, scenario_title

SHOWN = ("icy_30", "icy_100", "rain_100")  # of each scenario
LABELS = {"cvip": "distance, m", "v": "speed, m/s", "steer": "steering, left negative"}
ACROSS = (("lead_slowdown", "icy"), ("ghost_cut_in", "icy"), ("front_accident", "rain"))
BINS = 82  # edges
STEER_MIN = 0.01
WAYS = 30  # runs
LANE_EDGES = (0.0, -3.5, -7.0, -10.5)  # m left


def both_modes(campaign: GripCampaign) -> list[Block]:
    """Returns a figure per SHOWN cell with both frictions: three series over time, steering density."""
    pairs = [campaign.pairs.get((s, w)) for s in campaign.scenarios for w in SHOWN]
    return [
        _both(campaign, pair)
        for pair in pairs
        if pair is not None and len(pair.original) and len(pair.reduced)
    ]


def _both(campaign: GripCampaign, pair: Pair) -> Figure:
    """Returns a figure of a pair's metrics over time and its steering densities, a curve per friction."""
    sides = [(f, s) for f in (ORIGINAL, REDUCED) if (s := campaign.series(pair, f)) is not None]
    charts = [
        Chart([_over_time(name, series, metric) for name, series in sides], "s", label)
        for metric, label in LABELS.items()
    ]
    bins = _steering_bins([series for _, series in sides])
    densities = [_density(name, series.values["steer"], bins) for name, series in sides]
    charts.append(Chart(densities, "steering", "density", log=True))
    caption = (
        f"{scenario_title(pair.scenario)}, {pair.weather}: medians over runs still driving, bands "
        "from the 10th to the 90th percentile; a series ends where fewer than half of its runs "
        "are left."
    )
    return Figure(curves(charts, width=11.0, height=2.9), caption)


def _over_time(name: str, series: CellSeries, metric: str) -> Curve:
    """Returns the median of a metric over time in s, with the 10th to 90th percentile as band."""
    runs, median = series.values[metric], series.median(metric)
    low, high = np.nanpercentile(runs[:, : len(median)], (10, 90), axis=0)
    return Curve(name, np.arange(len(median)) * DT, median, band=(low, high))


def _density(name: str, steer: Floats, bins: Floats) -> Curve:
    """Returns the density of steering as a stepped curve over the bins, at least 1e-3 for the log scale."""
    density, _ = np.histogram(steer[~np.isnan(steer)], bins=bins, density=True)
    return Curve(name, bins[:-1], np.maximum(density, 1e-3), style={"drawstyle": "steps-post"})


def _steering_bins(sides: Sequence[CellSeries]) -> Floats:
    """Returns BINS edges that hold all steering of both modes, at least +-STEER_MIN."""
    most = max(float(np.nanmax(np.abs(s.values["steer"]))) for s in sides)
    reach = max(most, STEER_MIN)
    return np.linspace(-reach, reach, BINS)


def across_weathers(campaign: GripCampaign) -> list[Block]:
    """Returns figures of the distance to the nearest vehicle by weather, a chart per friction (B-141)."""
    blocks: list[Block] = []
    for scenario, prefix in ACROSS:
        pairs = [p for p in campaign.of(scenario) if p.weather.startswith(prefix)]
        if len(pairs) < 2:
            continue
        charts = [
            Chart(_medians(campaign, pairs, friction), "s", "distance, m", f"{friction} friction")
            for friction in (REDUCED, ORIGINAL)
        ]
        svg = curves(charts, width=9.6, height=3.1)
        title = scenario_title(scenario)
        blocks.append(Figure(svg, f"{title}: distance to the nearest vehicle, medians by weather."))
    return blocks


def _medians(campaign: GripCampaign, pairs: Sequence[Pair], friction: str) -> list[Curve]:
    """Returns a curve of the median CVIP over time in s per pair whose series with this friction is known."""
    found = ((k, pair.weather, campaign.series(pair, friction)) for k, pair in enumerate(pairs))
    medians = ((k, name, s.median("cvip")) for k, name, s in found if s is not None)
    return [Curve(name, np.arange(len(m)) * DT, m, colour=k) for k, name, m in medians]


def trajectories(campaign: GripCampaign) -> list[Block]:
    """Returns figures of the ways of ego and ghost in the cut-in, by friction and by variant (B-146)."""
    blocks: list[Block] = []
    for weather in SHOWN:
        pair = campaign.pairs.get(("ghost_cut_in", weather))
        if pair is not None and len(pair.original) and len(pair.reduced):
            sides = [(f"{f} friction", pair, f) for f in (ORIGINAL, REDUCED)]
            caption = f"Ghost cut-in, {weather}: ways of ego and ghost."
            blocks.append(_ways(campaign, sides, caption))
    order = ("original", "unfixed", "fixed")
    variants = [(name, campaign.variants[name]) for name in order if name in campaign.variants]
    sides = [(name, pair, ORIGINAL) for name, pair in variants if len(pair.original)]
    if sides:
        caption = "Ghost cut-in: ways in the three variants, friction untouched."
        blocks.append(_ways(campaign, sides, caption))
    return blocks


def _ways(campaign: GripCampaign, sides: Sequence[tuple[str, Pair, str]], caption: str) -> Figure:
    """Returns a figure of the first WAYS paths of ego and ghost per side; each side needs a series."""
    charts, drawn = [], 0
    for title, pair, friction in sides:
        series = campaign.series(pair, friction)
        assert series is not None
        drawn = max(drawn, len(series.values["x"][:WAYS]))
        ways = [
            Curve(name, along, left, colour=colour, style={"alpha": 0.35, "linewidth": 0.8})
            for colour, name, x, y in ((1, "ego", "y", "x"), (0, "ghost", "npc_y", "npc_x"))
            for along, left in zip(series.values[x][:WAYS], series.values[y][:WAYS], strict=True)
        ]
        charts.append(Chart(ways, "m along the road", "m left", title, rules=LANE_EDGES))
    svg = curves(charts, width=9.6, height=1.5 * len(sides) + 0.5, stacked=True)
    runs = count_text(drawn, "run")
    return Figure(
        svg, f"{caption} {runs} each." if drawn < WAYS else f"{caption} The first {runs} each."
    )
