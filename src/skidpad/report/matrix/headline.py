"""What the matrix counts first: crashes with vehicles, departures, time to the first intervention (R-6)."""

from __future__ import annotations

from functools import partial

import numpy as np

from skidpad.core.wording import count_text
from skidpad.evidence.statistics import ASSUMED, median_time
from skidpad.report.elements.page import Block, Cell, Number, Numbers, Table, Text
from skidpad.report.elements.tables import Column, Quantity, table
from skidpad.report.matrix.data import (
    BASELINE,
    EVENTS,
    FIRST,
    INTERVENTIONS,
    Matrix,
    config_list,
    config_title,
    rate_by_seed,
)
from skidpad.report.matrix.tables import RATE, few_seeds_note, rate_hint, remark_on

SERIOUS = (
    "serious_contacts",
    "serious contacts",
    "5 km/h of change of speed or more, or any with a person or two wheels",
)
STRUCK = ("crashes_vehicle", "crashes with vehicles", "the ego hit a vehicle or was hit by one")
LEFT = ("road_departures", "departures", "into a barrier, off the road, or facing the wrong way")
PUT_BACK = (
    INTERVENTIONS,
    "interventions",
    "times put back, each with its first cause; published as collisions",
)


def headline_numbers(matrix: Matrix) -> Numbers:
    """Totals over the compared configurations, every drive once."""
    t = matrix.counted.filter(matrix.counted["config"].is_in(matrix.comparison_configs))
    km = float(t["distance_km"].sum())
    column, contacts, _ = SERIOUS if matrix.has_grades else STRUCK
    hits, left, put_back, first = (
        int(t[c].sum()) for c in (column, "road_departures", INTERVENTIONS, "fatal_first")
    )

    def per_100_km(events: int) -> str:
        return f"{100 * events / km:.1f} per 100 km" if km else ""

    hours = float(t["duration_s"].sum()) / 3600
    return Numbers(
        [
            Number(f"{hits:,}", contacts, per_100_km(hits)),
            Number(f"{left:,}", "departures from the road", per_100_km(left)),
            Number(f"{put_back:,}", "interventions", _meaning(put_back, first)),
            Number(
                f"{len(t):,}",
                "different drives",
                f"{config_list(matrix.comparison_configs)}, {count_text(matrix.seeds, 'seed')}",
            ),
            Number(f"{km:,.0f} km", "driven", f"{hours:.1f} h of simulated time"),
        ]
    )


def _meaning(put_back: int, first: int) -> str:
    """What an intervention is, and how many followed on another one."""
    followed = put_back - first
    again = f"; {followed:,} soon after another one" if followed else ""
    return f"the car was put back, after light contacts, too{again}"


def headline_table(matrix: Matrix) -> Table:
    """One row per configuration, every drive once."""
    both = (EVENTS, EVENTS, "both")
    kinds = (SERIOUS if matrix.has_grades else STRUCK, LEFT, both, PUT_BACK)
    counts = [
        Column[str](f"{title} per run", partial(_count, matrix, name), meaning, format=RATE)
        for name, title, meaning in kinds
    ]
    first = Column[str](
        "time to the first intervention, median",
        partial(_first, matrix),
        "of runs; one without any counts as longer than every run, and so does one that was put "
        "back for another cause before",
        "s",
    )
    columns = [
        Column[str]("configuration", partial(_name, matrix)),
        *counts[:3],
        first,
        counts[3],
    ]
    note = (
        f"Every drive once. Small: 95 % interval {ASSUMED}; per 100 km it is that of the count, the way "
        "taken as given; of the median exact by order statistics, from six runs on."
    ) + few_seeds_note(matrix)
    return table(columns, matrix.configs, "What happened, by configuration", note)


def _name(matrix: Matrix, config: str) -> Cell:
    cycles = config == BASELINE and config not in matrix.comparison_configs
    return Cell(config_title(config), note="counts its reset cycle, see above" if cycles else "")


def _count(matrix: Matrix, column: str, config: str) -> Quantity:
    runs = matrix.cell(config).drop_nulls([column, "distance_km"])
    km = float(runs["distance_km"].sum())
    if not len(runs) or not km:
        return Quantity(value=None)
    rate = rate_by_seed(runs, column)
    assert rate is not None
    scale = 100.0 * len(runs) / km
    lines = [f"per 100 km {scale * rate.rate:.1f}"]
    if rate.interval is not None:
        low, high = (scale * end for end in rate.interval)
        lines.append(f"{low:.1f} to {high:.1f}")
    return Quantity(
        value=rate.rate,
        interval=rate.interval,
        remark=remark_on(rate),
        lines=tuple(lines) if config in matrix.comparison_configs else (),
        hint=f"{rate_hint(rate)}, {km:,.0f} km",
    )


def _first(matrix: Matrix, config: str) -> Cell:
    """Median time to the first intervention; beyond the end of runs it cannot be told."""
    runs = matrix.cell(config).drop_nulls("duration_s")
    if not len(runs):
        return Cell("no run", kind="muted")
    end = float(runs["duration_s"].min())  # type: ignore[arg-type]
    times = runs[FIRST].cast(float).fill_null(np.inf).to_numpy()
    median, limits = median_time(times, end)
    told = "" if limits is None else " to ".join(_time(t, end) for t in limits)
    if limits is not None and not np.isfinite(limits[0]):
        told = f"95 %: > {end:.0f}"
    hint = count_text(len(runs), "run")
    return Cell(_time(median, end), note=told, sort=min(median, end), hint=hint)


def _time(t: float, end: float) -> str:
    return f"{t:.0f}" if np.isfinite(t) else f"> {end:.0f}"


# --- the baseline in words: with no driver at the pedals a run measures how often the car is put back


def baseline_text(matrix: Matrix) -> list[Block]:
    """What configuration 0 is, and why it stands in no comparison (decision T-5)."""
    if matrix.comparison_configs == matrix.configs:
        return []
    runs = matrix.cell(BASELINE).drop_nulls([INTERVENTIONS, "duration_s"])
    events = int(runs[INTERVENTIONS].sum())
    text = "Configuration 0 has nobody at the pedals: it aims for 150 km/h and never brakes. "
    first = runs[FIRST].drop_nulls()
    if events and len(first):
        cycle = float(runs["duration_s"].sum()) / events
        text += (
            f"It was put back on the road every {cycle:.0f} s, the first time after "
            f"{float(first.median()):.0f} s in the median of {count_text(len(runs), 'drive')}. "  # type: ignore[arg-type]
        )
    text += (
        "Its counts measure this cycle and not the weather. They stand in the tables as they were, "
        "and in no total, and in no comparison or figure but those of the sources' own claims and numbers."
    )
    return [Text(text, tone="note")]
