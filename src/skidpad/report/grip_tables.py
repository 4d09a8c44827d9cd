"""Tables of the friction report (B-142 to B-149)."""

from __future__ import annotations

import numpy as np
import polars as pl

from skidpad.evidence.grip.study import (
    METRICS,
    ORIGINAL,
    REDUCED,
    Distance,
    Pair,
    Share,
    changed_outcome,
    compared,
    completion,
    completion_p,
    mean_interval,
)
from skidpad.evidence.statistics import Comparison, compare_pairs, p_text
from skidpad.report.grip_data import (
    GripCampaign,
    published_completion,
    published_distances,
    published_variant_distances,
    published_variants,
    scenario_title,
)
from skidpad.report.page import Block, Cell, Table

EFFECT_MAX = 100.0  # beyond, the differences hardly vary and the number says nothing
UNITS = {"x": "m", "y": "m", "v": "m/s", "cvip": "m"}


def completion_tables(campaign: GripCampaign) -> list[Block]:
    """Both completions and the score of every cell, original beside reduced (B-147)."""
    blocks: list[Block] = []
    for scenario in campaign.scenarios:
        rows = [
            [Cell(weather), *_completion_cells(campaign.pairs[scenario, weather])]
            for weather in campaign.weathers(scenario)
        ]
        columns = [
            ("weather", ""),
            ("original, %", "runs without an accident, friction untouched"),
            ("reduced, %", "runs without an accident, friction reduced"),
            ("McNemar", "exact p of the paired outcomes"),
            ("original if triggered, %", "of runs in which the scenario happened"),
            ("reduced if triggered, %", "of runs in which the scenario happened"),
            ("score original", "mean benchmark score"),
            ("score reduced", "mean benchmark score"),
        ]
        blocks.append(
            Table(
                columns,
                rows,
                caption=f"{scenario_title(scenario)}: completion and score",
                note="Small: 95 % interval, then the published value (? marks values that contradict "
                "themselves). Red: worse with reduced friction, green: better, by the paired test.",
                sortable=False,
            )
        )
    return blocks


def _completion_cells(pair: Pair) -> list[Cell]:
    p = completion_p(pair) if len(pair.common) else 1.0
    before, after = completion(pair.original), completion(pair.reduced)
    mark = ""
    if p < 0.05 and before.value is not None and after.value is not None:
        mark = "bad" if after.value < before.value else "good"
    test = "same drives" if pair.identical else p_text(p)
    return [
        _share_cell(before, _said(pair, ORIGINAL, 0)),
        _share_cell(after, _said(pair, REDUCED, 0), mark),
        Cell(test, sort=p, kind="muted" if p >= 0.05 else ""),
        _share_cell(completion(pair.original, given_triggered=True), ""),
        _share_cell(completion(pair.reduced, given_triggered=True), "", mark),
        _score_cell(pair.original, _said(pair, ORIGINAL, 1)),
        _score_cell(pair.reduced, _said(pair, REDUCED, 1), mark),
    ]


def _said(pair: Pair, friction: str, column: int) -> str:
    row = published_completion().get((pair.scenario, pair.weather, friction))
    if row is None:
        return ""
    return f"\npublished {row[column]:g}{' ?' if row[2] else ''}"


def _share_cell(share: Share, said: str, kind: str = "") -> Cell:
    if share.value is None:
        return Cell("no run", kind="muted", note=said.strip())
    low, high = share.interval
    note = f"{100 * low:.0f} to {100 * high:.0f}, n = {share.n}{said}"
    return Cell(f"{100 * share.value:.1f}", sort=share.value, note=note, kind=kind)


def _score_cell(runs: pl.DataFrame, said: str, kind: str = "") -> Cell:
    found = mean_interval(runs["score"])
    if found is None:
        return Cell("no run", kind="muted", note=said.strip())
    mean, (low, high) = found
    return Cell(f"{mean:.2f}", sort=mean, note=f"{low:.1f} to {high:.1f}{said}", kind=kind)


def distance_tables(campaign: GripCampaign) -> list[Block]:
    """Warping distance of the seven series (B-148)."""
    blocks: list[Block] = []
    for scenario in campaign.scenarios:
        rows = []
        for weather in campaign.weathers(scenario):
            found = campaign.distances.get((scenario, weather))
            if found is None:
                continue
            said = {
                d.metric: published_distances().get((scenario, weather, d.metric)) for d in found
            }
            baseline = campaign.pairs[scenario, weather].identical
            head = Cell(weather, note="baseline: the same drives" if baseline else "")
            rows.append([head, *(_distance_cell(d, said[d.metric]) for d in found)])
        if rows:
            blocks.append(
                Table(
                    [("weather", ""), *((_heading(m), "") for m in METRICS)],
                    rows,
                    caption=f"{scenario_title(scenario)}: distance of the median series, reduced "
                    "against original",
                    note="Dynamic time warping: root of the least sum of squared differences, not "
                    "normalised. Small: 95 % interval from 200 resamples at 5 Hz; floor: the distance "
                    "between two halves of the original runs; then the published value.",
                    sortable=False,
                )
            )
    return blocks


def _heading(metric: str) -> str:
    return f"{metric}, {UNITS[metric]}" if metric in UNITS else metric


def _distance_cell(d: Distance, said: float | None) -> Cell:
    notes = []
    if d.interval is not None and d.value > 0.0:
        notes.append(f"{d.interval.low:.3g} to {d.interval.high:.3g}")
    if d.floor is not None:
        notes.append(f"floor {d.floor:.3g}")
    if said is not None:
        notes.append(f"published {said:g}")
    above = d.floor is not None and d.value > d.floor
    return Cell(
        f"{d.value:.3g}", sort=d.value, note="\n".join(notes), kind="" if above else "muted"
    )


CHANGES = (
    (
        "min_cvip_m",
        "least distance, m",
        "least distance of box centres: warns of collisions (B-149)",
    ),
    ("steer_std", "steering spread", "deviation of the steering command (B-144)"),
    ("steer_corrections", "corrections, 1/s", "changes of steering direction per second (B-144)"),
)


def change_tables(campaign: GripCampaign) -> list[Block]:
    """What else changes: outcome, delay, control (B-142 to B-145, B-149)."""
    blocks: list[Block] = []
    for scenario in campaign.scenarios:
        rows = []
        for weather in campaign.weathers(scenario):
            pair = campaign.pairs[scenario, weather]
            if not len(pair.common) or pair.identical:
                continue
            rows.append([Cell(weather), *_change_cells(campaign, pair)])
        if not rows:
            continue
        columns = [
            ("weather", ""),
            ("other outcome, %", "pairs of which one collided and the other did not (B-143)"),
            ("ego out of control, %", "original and reduced (B-145)"),
            ("others out of control, %", "original and reduced, before any contact (B-145)"),
            ("delay, s", "constant shift of the speed series, where one explains it (B-142)"),
            *((title, hint) for _, title, hint in CHANGES),
        ]
        caption = f"{scenario_title(scenario)}: what reduced friction changes, paired by seed"
        note = "Reduced minus original, with 95 % interval and effect size d (mean over deviation)."
        blocks.append(Table(columns, rows, caption=caption, note=note, sortable=False))
    return blocks


def _change_cells(campaign: GripCampaign, pair: Pair) -> list[Cell]:
    delay = campaign.delays.get((pair.scenario, pair.weather), np.empty(0))
    return [
        _share_cell(changed_outcome(pair), ""),
        _lost_cell(pair, "loss_of_control_ego"),
        _lost_cell(pair, "loss_of_control_npc"),
        _delay_cell(delay),
        *(_difference_cell(compared(pair, column)) for column, _, _ in CHANGES),
    ]


def _lost_cell(pair: Pair, column: str) -> Cell:
    shares = [100.0 * float(side[column].mean() or 0.0) for side in (pair.original, pair.reduced)]  # type: ignore[arg-type]
    kind = "bad" if shares[1] > shares[0] + 5.0 else ""
    return Cell(f"{shares[0]:.0f} → {shares[1]:.0f}", sort=shares[1], kind=kind)


def _delay_cell(delay: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Cell:
    known = delay[~np.isnan(delay)]
    if 2 * len(known) < len(delay) or not len(known):
        return Cell("none", kind="muted", note=f"in {len(known)} of {len(delay)} pairs")
    c = compare_pairs(known)
    return _difference_cell(c, f"in {len(known)} of {len(delay)} pairs")


def _difference_cell(c: Comparison | None, more: str = "") -> Cell:
    if c is None:
        return Cell("no pairs", kind="muted")
    note = f"{c.interval.low:+.3g} to {c.interval.high:+.3g}"
    if c.effect is not None and abs(c.effect) < EFFECT_MAX:
        note += f", d = {c.effect:.1f}"
    clear = c.interval.low > 0.0 or c.interval.high < 0.0
    return Cell(
        f"{c.mean:+.3g}", sort=c.mean, note=note + (f"\n{more}" if more else ""),
        kind="" if clear else "muted", hint=f"{c.n} pairs",
    )  # fmt: skip


def variant_table(campaign: GripCampaign) -> list[Block]:
    """Original, unfixed and fixed cut-in, friction untouched (B-075 to B-077)."""
    rows = []
    for name in ("original", "unfixed", "fixed"):
        pair = campaign.variants.get(name)
        if pair is None or not len(pair.original):
            continue
        said = published_variants().get(name)
        first = "" if said is None else f"\npublished {said[0]:g}"
        second = "" if said is None else f"\npublished {said[1]:g}"
        rows.append(
            [
                Cell(name),
                _share_cell(completion(pair.original), first),
                _score_cell(pair.original, second),
                *(
                    _distance_cell(d, published_variant_distances().get((name, d.metric)))
                    for d in campaign.variant_distances.get(name, [])
                ),
            ]
        )
    if not rows:
        return []
    columns = [("variant", ""), ("completion, %", ""), ("score", "")]
    columns += [(_heading(m), "distance to the original variant") for m in METRICS]
    caption = "Ghost cut-in: what a spawn delay alone does, and a shorter merge distance"
    return [Table(columns, rows, caption=caption, sortable=False)]


def stopping_table(rows: pl.DataFrame) -> list[Block]:
    """Ratio, friction and stopping distances under both models (decision G-5)."""
    if not len(rows):
        return []
    weathers = rows["weather"].unique(maintain_order=True).to_list()
    body = []
    for weather in weathers:
        cells = [Cell(weather)]
        for model in ("statistical", "physical"):
            found = rows.filter(
                (pl.col("weather") == weather) & (pl.col("model") == model)
            ).to_dicts()
            if not found:
                cells += [Cell("none", kind="muted")] * 5
                continue
            r = found[0]
            values = (r["ratio"], r["mu_80"], r["stop_50_m"], r["stop_80_m"], r["stop_100_m"])
            cells += [
                Cell(f"{v:.{d}f}", sort=v) for v, d in zip(values, (3, 2, 1, 1, 1), strict=True)
            ]
        body.append(cells)
    columns = [("weather", "")]
    for model in ("stat.", "phys."):
        columns += [
            (f"{model} {name}", "")
            for name in ("ratio", "mu at 80", "m from 50", "m from 80", "m from 100")
        ]
    note = (
        "Full stops of the ego. Measured by braking tests: dry 0.90 to 1.03, wet 0.63 to 0.72, packed "
        "snow 0.34, sheet ice 0.12; the statistical ratio puts heavy rain below packed snow."
    )
    return [Table(columns, body, caption="What each weather does to stopping", note=note)]
