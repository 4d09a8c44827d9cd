"""What the matrix counts first: crashes with vehicles, departures, time to the first intervention (R-6)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from skidpad.core.text.wording import count_text
from skidpad.evidence.statistics import Interval, Rate, median_time
from skidpad.evidence.statistics_text import ASSUMED
from skidpad.recording.campaign.quantities import name_of
from skidpad.report.elements.page import Block, Cell, Number, Numbers, Table, Text
from skidpad.report.elements.tables import Column, Format, Quantity, table
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
from skidpad.report.matrix.tables import RATE, few_seeds_note, rate_hint, rate_quantity, remark_on

SERIOUS = (
    "serious_contacts",
    name_of("serious_contacts"),
    "5 km/h of change of speed or more, or any with a person or two wheels",
)
STRUCK = ("crashes_vehicle", name_of("crashes_vehicle"), "the ego hit a vehicle or was hit by one")
LEFT = (
    "road_departures",
    name_of("road_departures"),
    "into a barrier, off the road, or facing the wrong way",
)
PUT_BACK = (
    INTERVENTIONS,
    name_of(INTERVENTIONS),
    "times put back, each with its first cause; published as collisions",
)
DISTANCE = Format(",.0f")
PER_100_KM = Format(".1f", ".1f", absent="no run")


def headline_numbers(matrix: Matrix) -> Numbers:
    """Returns the head numbers: totals over the compared configurations, every drive once."""
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
            Number(f"{left:,}", LEFT[1], per_100_km(left)),
            Number(f"{put_back:,}", PUT_BACK[1], _meaning(put_back, first)),
            Number(
                f"{len(t):,}",
                "different drives",
                f"{config_list(matrix.comparison_configs)}, {count_text(matrix.seeds, 'seed')}",
            ),
            Number(f"{km:,.0f} km", "driven", f"{hours:.1f} h of simulated time"),
        ]
    )


def _meaning(put_back: int, first: int) -> str:
    """Returns a note on what an intervention is, and how many followed soon on another one.

    put_back: interventions in all; first: those that did not follow.
    """
    followed = put_back - first
    again = f"; {followed:,} soon after another one" if followed else ""
    return f"the car was put back, after light contacts, too{again}"


def headline_tables(matrix: Matrix) -> list[Table]:
    """Returns two tables by configuration, every drive once: per run, and folded per 100 km."""
    return [_per_run(matrix), _per_100_km(matrix)]


def _per_run(matrix: Matrix) -> Table:
    """Returns the table of events per run and median time to the first intervention."""
    *crashes, put_back = [
        Column[str](f"{title} per run", partial(_rate_per_run, matrix, name), meaning, format=RATE)
        for name, title, meaning in _event_kinds(matrix)
    ]
    first = Column[str](
        "time to the first intervention, median",
        partial(_first, matrix),
        "of runs; one without any counts as longer than every run, and so does one that was put "
        "back for another cause before",
        "s",
    )
    columns = [Column[str]("configuration", partial(_name, matrix)), *crashes, first, put_back]
    note = (
        f"Every drive once. Below a rate stands its 95 % interval, {ASSUMED}; where fewer than two seeds "
        "had an event, the largest share of seeds with one (95 %). Below a median stands its exact 95 % "
        "interval, from six runs on."
        f"{few_seeds_note(matrix)}"
    )
    return table(columns, matrix.configs, "What happened, by configuration", note)


def _per_100_km(matrix: Matrix) -> Table:
    """Returns the folded table of events per 100 km and distance in km."""
    columns = [
        Column[str]("configuration", config_title),
        Column[str]("distance", partial(_distance, matrix), "of all its drives", "km", DISTANCE),
        *(
            Column[str](title, partial(_rate_per_100_km, matrix, name), meaning, format=PER_100_KM)
            for name, title, meaning in _event_kinds(matrix)
        ),
    ]
    note = (
        f"Every drive once. Small: 95 % interval of the count {ASSUMED}, the way taken as given."
        f"{few_seeds_note(matrix)}"
    )
    caption = "The same per 100 km"
    return replace(table(columns, matrix.comparison_configs, caption, note), folded=True)


def _event_kinds(matrix: Matrix) -> tuple[tuple[str, str, str], ...]:
    """Returns column, title and meaning of what is counted; the last one are interventions."""
    return (SERIOUS if matrix.has_grades else STRUCK, LEFT, (EVENTS, EVENTS, "both"), PUT_BACK)


def _name(matrix: Matrix, config: str) -> Cell:
    """Returns a cell with the configuration's title, noted where it counts its reset cycle."""
    cycles = config == BASELINE and config not in matrix.comparison_configs
    return Cell(config_title(config), note="counts its reset cycle, see above" if cycles else "")


def _distance(matrix: Matrix, config: str) -> float:
    """Returns the distance in km of all drives of a configuration."""
    return float(matrix.cell(config)["distance_km"].sum())


def _rate_per_run(matrix: Matrix, column: str, config: str) -> Quantity:
    """Returns the events of `column` per run with their interval; no value for an unknown rate."""
    rate = matrix.rate(column, config)
    if rate is None:
        return Quantity(value=None)
    hint = f"{rate_hint(rate)}, {_distance(matrix, config):,.0f} km"
    return replace(rate_quantity(rate), hint=hint, remark=_short_remark(rate))


def _rate_per_100_km(matrix: Matrix, column: str, config: str) -> Quantity:
    """Returns the events of `column` per 100 km with their interval; no value without distance."""
    runs = matrix.cell(config).drop_nulls([column, "distance_km"])
    km = float(runs["distance_km"].sum())
    rate = rate_by_seed(runs, column)
    if rate is None or not km:
        return Quantity(value=None)
    scale = 100.0 * len(runs) / km
    limits = rate.interval and Interval(*(scale * end for end in rate.interval))
    return Quantity(
        value=scale * rate.rate, interval=limits, remark=_short_remark(rate), hint=rate_hint(rate)
    )


def _short_remark(rate: Rate) -> str:
    """Returns what stands beside a rate; without an interval only its bound, its counts are in the hint."""
    if rate.interval is None and rate.runs > 1 and rate.most_runs < 1.0:
        return f"in at most {100.0 * rate.most_runs:.0f} % of seeds"
    return remark_on(rate)


def _first(matrix: Matrix, config: str) -> Cell:
    """Returns a cell with the median time to the first intervention, "> END" beyond the end of runs."""
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
    """Returns a median time in s as text without its unit, "> END" where `t` is not finite."""
    return f"{t:.0f}" if np.isfinite(t) else f"> {end:.0f}"


# --- the baseline in words: with no driver at the pedals a run measures how often the car is put back


def baseline_text(matrix: Matrix) -> list[Block]:
    """Returns a note on what configuration 0 is and why it stands in no comparison (T-5).

    Empty where it is in the comparisons, or was not driven.
    """
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
        "Its counts measure this cycle and not the weather. They stand in the tables, but in no total. "
        "Comparisons and figures leave them out, except where the sources' own claims and numbers are judged."
    )
    return [Text(text, tone="note")]
