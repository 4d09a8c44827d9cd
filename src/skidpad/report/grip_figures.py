"""Figures of the friction report: series over time, steering, trajectories (B-140, B-141, B-146)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.core.setup import DT
from skidpad.evidence.grip.study import ORIGINAL, REDUCED, Pair
from skidpad.report.figures import PALETTE, canvas, svg_of
from skidpad.report.grip_data import GripCampaign, scenario_title
from skidpad.report.page import Block, Figure

Floats = NDArray[np.float64]
SHOWN = ("icy_30", "icy_100", "rain_100")  # of each scenario
LABELS = {"cvip": "distance, m", "v": "speed, m/s", "steer": "steering, left negative"}
BINS = 82  # edges
STEER_MIN = 0.01


def both_modes(campaign: GripCampaign) -> list[Block]:
    """Distance, speed and steering over time and the density of steering, by friction."""
    blocks: list[Block] = []
    for scenario in campaign.scenarios:
        for weather in SHOWN:
            pair = campaign.pairs.get((scenario, weather))
            if pair is not None and len(pair.original) and len(pair.reduced):
                blocks.append(_both(campaign, pair))
    return blocks


def _both(campaign: GripCampaign, pair: Pair) -> Figure:
    bins = _steering_bins(campaign, pair)
    with canvas(width=11.0, height=2.9, columns=4) as (figure, axes):
        for k, friction in enumerate((ORIGINAL, REDUCED)):
            series = campaign.series(pair, friction)
            assert series is not None
            colour = PALETTE[k]
            for ax, metric in zip(axes, LABELS, strict=False):
                runs, median = series.values[metric], series.median(metric)
                t = np.arange(len(median)) * DT
                low, high = np.nanpercentile(runs[:, : len(median)], (10, 90), axis=0)
                ax.fill_between(t, low, high, color=colour, alpha=0.15, linewidth=0)
                ax.plot(
                    t,
                    median,
                    color=colour,
                    linewidth=1.5,
                    label=friction if ax is axes[0] else None,
                )
                ax.set_xlabel("s")
                ax.set_ylabel(LABELS[metric])
            steer = series.values["steer"]
            density, _ = np.histogram(steer[~np.isnan(steer)], bins=bins, density=True)
            axes[3].step(bins[:-1], np.maximum(density, 1e-3), where="post", color=colour)
        axes[3].set_yscale("log")
        axes[3].set_xlabel("steering")
        axes[3].set_ylabel("density")
        figure.legend(loc="outside upper center", ncols=2)
        caption = (
            f"{scenario_title(pair.scenario)}, {pair.weather}: medians over runs still driving, bands "
            "from the 10th to the 90th percentile; a series ends where fewer than half of its runs "
            "are left."
        )
        return Figure(svg_of(figure), caption)


def _steering_bins(campaign: GripCampaign, pair: Pair) -> Floats:
    """Edges that hold nearly all steering of both modes, at least a hundredth of full steer."""
    sides = (campaign.series(pair, f) for f in (ORIGINAL, REDUCED))
    most = max(float(np.nanmax(np.abs(s.values["steer"]))) for s in sides if s is not None)
    reach = max(most, STEER_MIN)
    return np.linspace(-reach, reach, BINS)


def across_weathers(campaign: GripCampaign) -> list[Block]:
    """Distance to the nearest vehicle by weather, in one mode each (B-141)."""
    blocks: list[Block] = []
    for scenario, prefix in (
        ("lead_slowdown", "icy"),
        ("ghost_cut_in", "icy"),
        ("front_accident", "rain"),
    ):
        weathers = [w for w in campaign.weathers(scenario) if w.startswith(prefix)]
        if len(weathers) < 2:
            continue
        with canvas(width=9.6, height=3.1, columns=2) as (figure, axes):
            for ax, friction in zip(axes, (REDUCED, ORIGINAL), strict=True):
                for k, weather in enumerate(weathers):
                    series = campaign.series(campaign.pairs[scenario, weather], friction)
                    if series is None:
                        continue
                    median = series.median("cvip")
                    label = weather if ax is axes[0] else None
                    ax.plot(
                        np.arange(len(median)) * DT,
                        median,
                        color=PALETTE[k],
                        linewidth=1.4,
                        label=label,
                    )
                ax.set_title(f"{friction} friction", fontsize=10)
                ax.set_xlabel("s")
                ax.set_ylabel("distance, m")
            figure.legend(loc="outside upper center", ncols=6)
            svg = svg_of(figure)
        title = scenario_title(scenario)
        blocks.append(Figure(svg, f"{title}: distance to the nearest vehicle, medians by weather."))
    return blocks


def trajectories(campaign: GripCampaign) -> list[Block]:
    """Ways of ego and other vehicle in the cut-in, all runs, by friction and by variant (B-146)."""
    blocks: list[Block] = []
    for weather in SHOWN:
        pair = campaign.pairs.get(("ghost_cut_in", weather))
        if pair is not None and len(pair.original) and len(pair.reduced):
            sides = [(f"{f} friction", pair, f) for f in (ORIGINAL, REDUCED)]
            blocks.append(
                _ways(campaign, sides, f"Ghost cut-in, {weather}: ways of ego and ghost.")
            )
    rest = [(n, p, ORIGINAL) for n, p in campaign.variants.items() if len(p.original)]
    if rest:
        rest.sort(key=lambda item: ("original", "unfixed", "fixed").index(item[0]))
        caption = "Ghost cut-in: ways in the three variants, friction untouched."
        blocks.append(_ways(campaign, rest, caption))
    return blocks


def _ways(campaign: GripCampaign, sides: Sequence[tuple[str, Pair, str]], caption: str) -> Figure:
    with canvas(width=9.6, height=1.5 * len(sides) + 0.5) as (figure, (placeholder,)):
        figure.delaxes(placeholder)
        grid = figure.subplots(len(sides), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (title, pair, friction) in zip(grid, sides, strict=True):
            series = campaign.series(pair, friction)
            assert series is not None
            for k, (along, left, name) in enumerate(
                (("y", "x", "ego"), ("npc_y", "npc_x", "ghost"))
            ):
                for n, (a, b) in enumerate(
                    zip(series.values[along][:30], series.values[left][:30], strict=True)
                ):
                    label = name if n == 0 and ax is grid[0] else None
                    ax.plot(a, b, color=PALETTE[1 - k], alpha=0.35, linewidth=0.8, label=label)
            for edge in (0.0, -3.5, -7.0, -10.5):
                ax.axhline(edge, color="#8996a3", linewidth=0.6, linestyle=(0, (6, 6)))
            ax.set_ylabel("m left")
            ax.set_title(title, fontsize=9, loc="left")
        grid[-1].set_xlabel("m along the road")
        figure.legend(loc="outside upper center", ncols=2)
        return Figure(svg_of(figure), caption + " Thirty runs each.")
