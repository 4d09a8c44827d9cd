"""Tables of the friction report (B-142 to B-149)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.evidence.grip.study import (
    METRICS,
    ORIGINAL,
    REDUCED,
    Distance,
    Pair,
    Share,
    changed_outcome,
    compare_pair,
    completion,
    completion_p,
    mean_interval,
)
from skidpad.evidence.statistics import Comparison, Interval, compare_pairs
from skidpad.evidence.statistics_text import p_text
from skidpad.report.elements.page import Block, Cell
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.grip.data import GripCampaign
from skidpad.report.published import Source, published_rows

EFFECT_MAX = 100.0  # beyond, the differences hardly vary and the number says nothing
P_MARKED = 0.05
SCORE_MAX = 100.0
UNITS = {"x": "m", "y": "m", "v": "m/s", "cvip": "m"}
SHARE = Format(".1f", ".0f", "no run")
SCORE = Format(".2f", ".1f", "no run")
DISTANCE = Format(".3g", ".3g")
DELAY = Format("+.3g", "+.3g")
DIFFERENCE = Format("+.3g", "+.3g", "no pairs")
COMPLETED = "completion_rate_pct"  # published columns
SCORED = "mean_score_pct"
R = TypeVar("R")


def completion_tables(campaign: GripCampaign) -> list[Block]:
    """Returns a table per scenario of completions and score, original beside reduced (B-147)."""
    without = "runs without an accident, friction"
    happened = "of runs in which the scenario happened"
    columns = (
        Column[Pair]("weather", lambda pair: pair.weather),
        Column("original", partial(completion_share, ORIGINAL), f"{without} untouched", "%", SHARE),
        Column("reduced", partial(completion_share, REDUCED), f"{without} reduced", "%", SHARE),
        Column("McNemar", paired_test, "exact p of the paired outcomes"),
        Column("original if triggered", partial(if_triggered, ORIGINAL), happened, "%", SHARE),
        Column("reduced if triggered", partial(if_triggered, REDUCED), happened, "%", SHARE),
        Column("score original", partial(score, ORIGINAL), "mean benchmark score", "", SCORE),
        Column("score reduced", partial(score, REDUCED), "mean benchmark score", "", SCORE),
    )
    note = (
        "Small: 95 % interval, then the published value (? marks values that contradict themselves). "
        "Red: worse with reduced friction, green: better, by the paired test."
    )
    return [
        table(columns, campaign.of(scenario), f"{title}: completion and score", note, False)
        for scenario, title in campaign.titles
    ]


def completion_share(friction: str, pair: Pair) -> Quantity:
    """Returns the share without an accident in percent, beside the published."""
    found = completion(pair.side(friction))
    return share(found, kind=mark(pair, friction), **find_published(pair, friction, COMPLETED))


def if_triggered(friction: str, pair: Pair) -> Quantity:
    """Returns the share without an accident in percent, of runs in which the scenario happened."""
    return share(completion(pair.side(friction), given_triggered=True), kind=mark(pair, friction))


def score_of_runs(runs: pl.DataFrame) -> tuple[float | None, Interval | None]:
    """Returns the mean score of runs, and its interval cut to 0 to SCORE_MAX; None where unknown."""
    value, limits = mean_interval(runs["score"]) or (None, None)
    if limits is None:
        return value, None
    return value, Interval(max(limits.low, 0.0), min(limits.high, SCORE_MAX))


def score(friction: str, pair: Pair) -> Quantity:
    """Returns the mean benchmark score with its interval."""
    value, interval = score_of_runs(pair.side(friction))
    kind = mark(pair, friction)
    return Quantity(
        value=value, interval=interval, kind=kind, **find_published(pair, friction, SCORED)
    )


def paired_test(pair: Pair) -> Cell:
    """Returns a cell with the exact p of both frictions completing alike, or "same drives"."""
    p = completion_p(pair) if len(pair.common) else 1.0
    text = "same drives" if pair.identical else p_text(p)
    return Cell(text, sort=p, kind="muted" if p >= P_MARKED else "")


def mark(pair: Pair, friction: str) -> str:
    """Returns the tone of a cell: "good" or "bad" where the paired test finds a difference, else ""."""
    before, after = completion(pair.original).value, completion(pair.reduced).value
    if friction == ORIGINAL or before is None or after is None or not len(pair.common):
        return ""
    if completion_p(pair) >= P_MARKED:
        return ""
    return "bad" if after < before else "good"


def find_published(pair: Pair, friction: str, column: str) -> dict[str, Any]:
    """Returns the published value of a cell and whether it is doubted, as fields of Quantity; or {}."""
    rows = published_rows(Source.COMPLETION, "scenario", "preset", "friction_mode")
    row = rows.get((pair.scenario, pair.weather, friction))
    if row is None:
        return {}
    return {"published": row[column], "doubted": row["consistency_flag_derived"] != "ok"}


def share(found: Share, kind: str = "", **more: Any) -> Quantity:
    """Returns a share as a quantity in percent with its interval and n, without value for an unknown one.

    more: further fields of Quantity.
    """
    if found.value is None:
        return Quantity(value=None, **more)
    limits = Interval(*(100.0 * end for end in found.interval))
    return Quantity(
        value=100.0 * found.value, interval=limits, remark=f"n = {found.n}", kind=kind, **more
    )


def distance_tables(campaign: GripCampaign) -> list[Block]:
    """Returns a table per scenario of warping distances of the seven series (B-148)."""
    published = published_rows(Source.WARPING, "scenario", "preset", "metric")

    def of(metric: str, pair: Pair) -> Quantity:
        row = published.get((pair.scenario, pair.weather, metric))
        return distance(campaign.distances[pair.scenario, pair.weather][metric], row)

    def name(pair: Pair) -> Cell:
        return Cell(pair.weather, note="baseline: the same drives" if pair.identical else "")

    note = (
        "Dynamic time warping: root of the least sum of squared differences, not normalised. Small: "
        "95 % interval from 200 resamples at 5 Hz; floor: the distance between two halves of the "
        "original runs; then the published value."
    )
    columns = [Column("weather", name), *metric_columns(of)]
    tables: list[Block] = []
    for scenario, title in campaign.titles:
        caption = f"{title}: distance of the median series, reduced against original"
        pairs = [p for p in campaign.of(scenario) if (p.scenario, p.weather) in campaign.distances]
        tables += [table(columns, pairs, caption, note, False)] if pairs else []
    return tables


def metric_columns(of: Callable[[str, R], Quantity], definition: str = "") -> list[Column[R]]:
    """Returns a column per compared series, whose cell is `of(metric, row)`."""
    return [
        Column(m, partial(of, m), definition, UNITS.get(m, ""), format=DISTANCE) for m in METRICS
    ]


def distance(d: Distance, published: dict[str, Any] | None) -> Quantity:
    """Returns the distance of two series beside the published, muted where chance gives as much."""
    return Quantity(
        value=d.value,
        interval=d.interval if d.value > 0.0 else None,
        lines=() if d.floor is None else (f"floor {d.floor:.3g}",),
        published=None if published is None else published["dtw_distance"],
        kind="" if d.floor is not None and d.value > d.floor else "muted",
    )


def change_tables(campaign: GripCampaign) -> list[Block]:
    """Returns a table per scenario of outcome, delay and control by pairs (B-142 to B-145, B-149)."""

    def difference_of(column: str, pair: Pair) -> Quantity:
        return difference(compare_pair(pair, column))

    def delay(pair: Pair) -> Quantity:
        return late(campaign.delays.get((pair.scenario, pair.weather), np.empty(0)))

    columns = (
        Column[Pair]("weather", lambda pair: pair.weather),
        Column[Pair]("other outcome", lambda pair: share(changed_outcome(pair)),
                     "pairs of which one collided and the other did not (B-143)", "%", SHARE),
        Column("ego out of control", partial(control_lost_cell, "loss_of_control_ego"),
               "original and reduced (B-145)", "%"),
        Column("others out of control", partial(control_lost_cell, "loss_of_control_npc"),
               "original and reduced, before any contact (B-145)", "%"),
        Column("delay", delay,
               "constant shift of the speed series, where one explains it (B-142)", "s", DELAY),
        Column("least distance", partial(difference_of, "min_cvip_m"),
               "least distance of box centres: warns of collisions (B-149)", "m", DIFFERENCE),
        Column("steering spread", partial(difference_of, "steer_std"),
               "deviation of the steering command (B-144)", "", DIFFERENCE),
        Column("corrections", partial(difference_of, "steer_corrections"),
               "changes of steering direction per second (B-144)", "1/s", DIFFERENCE),
    )  # fmt: skip
    note = "Reduced minus original, with 95 % interval and effect size d (mean over deviation)."
    tables: list[Block] = []
    for scenario, title in campaign.titles:
        pairs = [p for p in campaign.of(scenario) if len(p.common) and not p.identical]
        caption = f"{title}: what reduced friction changes, paired by seed"
        tables += [table(columns, pairs, caption, note, False)] if pairs else []
    return tables


def control_lost_cell(column: str, pair: Pair) -> Cell:
    """Returns a cell with the shares out of control in %, original and reduced; bad beyond 5 more."""
    before, after = (
        100.0 * float(side[column].mean() or 0.0)  # type: ignore[arg-type]
        for side in (pair.original, pair.reduced)
    )
    kind = "bad" if after > before + 5.0 else ""
    return Cell(f"{before:.0f} → {after:.0f}", sort=after, kind=kind)


def late(delay: NDArray[np.float64]) -> Quantity:
    """Returns the mean delay in s where at least half of the pairs have one (nan: none)."""
    known = delay[~np.isnan(delay)]
    told = (f"in {len(known)} of {len(delay)} pairs",)
    if 2 * len(known) < len(delay) or not len(known):
        return Quantity(value=None, lines=told)
    return difference(compare_pairs(known), told)


def difference(c: Comparison | None, lines: tuple[str, ...] = ()) -> Quantity:
    """Returns a paired difference with its effect size, muted where its sign is not clear; None: none."""
    if c is None:
        return Quantity(value=None)
    sized = c.effect is not None and abs(c.effect) < EFFECT_MAX
    return Quantity(
        value=c.mean,
        interval=c.interval,
        remark=f"d = {c.effect:.1f}" if sized else "",
        lines=lines,
        kind="" if c.is_clear else "muted",
        hint=f"{c.n} pairs",
    )


def variant_table(campaign: GripCampaign) -> list[Block]:
    """Returns the table of original, unfixed and fixed cut-in, friction untouched (B-075 to B-077).

    Empty where none was driven.
    """
    outcomes = published_rows(Source.CUTIN_COMPLETION, "variant")
    distances = published_rows(Source.CUTIN_WARPING, "variant_compared_with_original", "metric")

    def completion_of(pair: Pair) -> Quantity:
        return share(
            completion(pair.original), published=outcomes.get(pair.cutin, {}).get(COMPLETED)
        )

    def score_of(pair: Pair) -> Quantity:
        value, interval = score_of_runs(pair.original)
        theirs = outcomes.get(pair.cutin, {}).get(SCORED)
        return Quantity(value=value, interval=interval, published=theirs)

    def of(metric: str, pair: Pair) -> Quantity:
        found = campaign.variant_distances.get(pair.cutin)
        if found is None:
            return Quantity(value=None)
        return distance(found[metric], distances.get((pair.cutin, metric)))

    columns = [
        Column[Pair]("variant", lambda pair: pair.cutin),
        Column("completion", completion_of, unit="%", format=SHARE),
        Column("score", score_of, format=SCORE),
        *metric_columns(of, "distance to the original variant"),
    ]
    pairs = [campaign.variants.get(name) for name in ("original", "unfixed", "fixed")]
    driven = [pair for pair in pairs if pair is not None and len(pair.original)]
    caption = "Ghost cut-in: what a spawn delay alone does, and a shorter merge distance"
    return [table(columns, driven, caption, sortable=False)] if driven else []


STOPS = (
    ("ratio", "ratio", ".3f"),
    ("mu_80", "mu at 80", ".2f"),
    ("stop_50_m", "m from 50", ".1f"),
    ("stop_80_m", "m from 80", ".1f"),
    ("stop_100_m", "m from 100", ".1f"),
)


def stopping_table(rows: pl.DataFrame) -> list[Block]:
    """Returns the table of ratio, friction and stopping distances under both models (G-5), or nothing."""
    if not len(rows):
        return []
    by_cell = {(row["weather"], row["model"]): row for row in rows.to_dicts()}

    def of(model: str, quantity: str, weather: str) -> float | None:
        return by_cell.get((weather, model), {}).get(quantity)

    columns = [
        Column[str]("weather", lambda weather: weather),
        *(
            Column(f"{model[:4]}. {title}", partial(of, model, name), format=Format(digits))
            for model in ("statistical", "physical")
            for name, title, digits in STOPS
        ),
    ]
    note = (
        "Full stops of the ego. Measured by braking tests: dry 0.90 to 1.03, wet 0.63 to 0.72, packed "
        "snow 0.34, sheet ice 0.12; the statistical ratio puts heavy rain below packed snow."
    )
    weathers = rows["weather"].unique(maintain_order=True).to_list()
    return [table(columns, weathers, "What each weather does to stopping", note)]
