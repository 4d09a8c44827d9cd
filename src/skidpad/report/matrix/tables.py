"""Tables of the matrix report (A-256, A-258)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import polars as pl

from skidpad.core.text.wording import count_text
from skidpad.evidence.contrasts import per_seed
from skidpad.evidence.statistics import UNITS_FROM, Interval, Rate, mean_limits, poisson_interval
from skidpad.evidence.statistics_text import ASSUMED, no_limits_text, rate_remark
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.campaign.quantities import name_of
from skidpad.report.elements.campaign import Metric, metrics_of
from skidpad.report.elements.page import Block, Cell, Table
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.data import (
    EVENTS,
    INTERVENTIONS,
    Matrix,
    WeatherGroup,
    config_title,
    rate_by_seed,
)

METRICS = {m.name: m for m in metrics_of(Metrics)}
SAME_AS_INTERVENTIONS = "interventions"  # the column of newer results; older ones lack it
RATE = Format(".2f", absent="no run")
MEANS = (
    ("dropout_pct", "ticks without a target or persisting"),
    ("headway_variance_m2", ""),
    ("mean_error_m", ""),
    ("radar_fpr_pct", "after the lane check"),
    ("radar_fnr_pct", "after the lane check"),
    ("mean_speed_kmh", ""),
)
KINDS = (
    ("collisions_vehicle", "vehicles", "recoveries after hitting or being hit by a vehicle"),
    (
        "rear_ended",
        "of these struck from behind",
        "another vehicle drove into the ego; until the morning of 2026-11-25 touches at the side counted too",
    ),
    ("collisions_static", "barriers and posts", "recoveries after hitting anything that stands"),
    ("off_road", "off the road", "left all lanes and was put back"),
    (
        "bend_exits",
        "in a bend without a lead",
        "of the two before and of roll-overs: speed alone was too much for the bend",
    ),
    ("wrong_way", "wrong-way corrections", ""),
    ("roll_overs", "rolled over", "lay on its side and was put back"),
    ("stuck_relocations", "stuck and put back", "no intervention"),
)
UNGRADED_TITLES = {"rear_ended": "of these struck from behind or touched sideways"}
CONTACTS = ("contacts", "contacts", "of the ego, also those within the cool-down of a recovery")
GRADES = (
    ("contacts_light", "below 5 km/h", "of the contacts with road users, by change of speed"),
    ("contacts_medium", "5 to 20 km/h", "the same, or slower with a person or two wheels"),
    ("contacts_heavy", "above 20 km/h", "the same"),
    ("contacts_vulnerable", "with persons or two wheels", "of these"),
    ("contacts_static", "with what stands", "barriers, posts"),
    ("contacts_repeated", "the same one again", "touched once more within 8 s, graded once"),
)
COUNTS = frozenset(  # events of which a mean is a rate
    (
        *("serious_contacts", "road_departures", INTERVENTIONS, "interventions", "fatal_first"),
        *("crashes_vehicle", "crashes_vehicle_first", "road_departures_first", "lane_invasions"),
        *(name for name, *_ in (*KINDS, CONTACTS, *GRADES)),
    )
)

GRADES_NOTE = (
    "Classes are of contacts with road users, by the larger change of speed of the two; persons and two "
    "wheels are among them and never in the lowest. The three classes, what stands and repeated "
    "touches add up to all contacts."
)
BACKGROUND = (
    ("traffic_contacts", "contacts", "of two background vehicles, first touch"),
    ("traffic_contacts_after_ego", "soon after the ego's", "within 20 s of a contact of the ego"),
    ("traffic_put_back", "put back", "stood without a cause or left the lane for 10 s"),
    ("traffic_roll_overs", "rolled over", "lay on their side"),
    ("traffic_moved", "moved", "far from the ego, and entered anew nearer to it"),
)

BACKGROUND_NOTE = (
    "Contacts of two background vehicles with each other. Put back: a vehicle that stood without a "
    "cause or left the lane for 10 s. Moved: taken from far away and entered anew nearer to the ego, "
    "which keeps the traffic around it dense."
)


def collisions(matrix: Matrix) -> list[Block]:
    """Returns tables of crashes, interventions, and what they were."""
    return [
        count_table(matrix, EVENTS, crash_meaning(matrix)),
        *([count_table(matrix, "serious_contacts")] if matrix.has_grades else []),
        count_table(matrix, "road_departures"),
        count_table(matrix, INTERVENTIONS, " (published as collisions)"),
        count_table(matrix, "fatal_first", ": without those soon after another one"),
        kinds_table(matrix),
        grades_table(matrix),
        background_table(matrix),
    ]


def crash_meaning(matrix: Matrix) -> str:
    """Returns what a crash is in these results, to stand behind its name."""
    if matrix.has_grades:
        return ": serious contacts and departures"
    return ": interventions, as these results grade no contact"


def others(matrix: Matrix) -> list[Block]:
    """Returns tables of lane invasions, dropouts and radar errors."""
    return [
        count_table(matrix, "lane_invasions"),
        *(mean_table(matrix, column, meaning) for column, meaning in MEANS),
    ]


def by_weather(
    matrix: Matrix,
    of: Callable[[WeatherGroup | None, str], Quantity],
    format: Format,
    caption: str,
    note: str,
) -> Table:
    """Returns a table with a row per configuration, a column per weather, and one over all weathers.

    of: the quantity of a group of weathers (None: all, each drive once) and a configuration.
    Weathers that every configuration drove alike are one column.
    """
    columns = [
        Column[str]("configuration", config_title),
        *(
            Column[str](g.title, partial(of, g), ", ".join(g.weathers), format=format)
            for g in matrix.weather_groups
        ),
        Column[str]("all", partial(of, None), "every drive once", format=format),
    ]
    return table(columns, matrix.configs, caption, note)


def count_table(matrix: Matrix, column: str, meaning: str = "") -> Table:
    """Returns the table of events of `column` per run with intervals, shaded by the rate.

    meaning: stands behind the quantity's name in the caption.
    """
    rates = {
        (c, g): rate_by_seed(matrix.within(c, g), column)
        for c in matrix.configs
        for g in matrix.weather_groups
    }
    top = max(
        (r.rate for (c, _), r in rates.items() if r and c in matrix.comparison_configs), default=0.0
    )

    def of(group: WeatherGroup | None, config: str) -> Quantity:
        if group is None:
            return rate_quantity(matrix.rate(column, config))
        shade = top or 1.0 if config in matrix.comparison_configs else None
        return rate_quantity(rates[config, group], shade)

    note = (
        f"Per run of {matrix.duration:g} s; small: 95 % interval {ASSUMED}.{few_seeds_note(matrix)}"
    )
    caption = f"{name_of(column).capitalize()} per run{meaning}"
    return by_weather(matrix, of, RATE, caption, note)


def rate_quantity(rate: Rate | None, top: float | None = None) -> Quantity:
    """Returns events per run as a quantity, shaded against the rate `top`; no value for None."""
    if rate is None:
        return Quantity(value=None)
    return Quantity(
        value=rate.rate,
        interval=rate.interval,
        remark=remark_on(rate),
        heat=None if top is None else (rate.rate / top) ** 0.5,
        hint=rate_hint(rate),
    )


def remark_on(rate: Rate) -> str:
    """Returns what stands beside a rate; "" of a single seed, as the table's note says it once."""
    return rate_remark(rate, "seed") if rate.runs > 1 else ""


def few_seeds_note(matrix: Matrix) -> str:
    """Returns the sentence below a table in place of limits that so few seeds cannot give; else ""."""
    if matrix.seeds >= UNITS_FROM:
        return ""
    return f" {no_limits_text(matrix.seeds, 'seed')}."


def rate_hint(rate: Rate) -> str:
    """Returns the numbers of events and seeds that a rate rests on, as text."""
    events, seeds = count_text(rate.events, "event"), count_text(rate.runs, "seed")
    return f"{events}, {seeds}"


def mean_table(matrix: Matrix, column: str, meaning: str = "") -> Table:
    """Returns the table of means of `column` over seeds with intervals; what it means stands in its note."""

    def of(group: WeatherGroup | None, config: str) -> Quantity:
        runs = matrix.cell(config) if group is None else matrix.within(config, group)
        return mean_quantity(runs, column)

    said = f"{meaning.capitalize()}. " if meaning else ""
    note = f"{said}Mean over seeds; small: 95 % interval over seeds.{few_seeds_note(matrix)}"
    return by_weather(matrix, of, Format(), METRICS[column].heading.capitalize(), note)


def metric_quantity(runs: pl.DataFrame, column: str) -> Quantity:
    """Returns a metric's mean over seeds, of a column of COUNTS the events per run, with 95 % limits."""
    return (
        rate_quantity(rate_by_seed(runs, column))
        if column in COUNTS
        else mean_quantity(runs, column)
    )


def mean_quantity(runs: pl.DataFrame, column: str) -> Quantity:
    """Returns the mean over seeds, of each the mean of its runs; one seed has no interval."""
    known = per_seed(runs.drop_nulls(column), pl.col(column).cast(pl.Float64)).to_numpy()
    limits = mean_limits(known)
    return Quantity(
        value=float(known.mean()) if known.size else None,
        interval=None if limits is None else possible_part(limits, column, float(known.min())),
        remark=""
        if limits or not known.size
        else _without_limits(known.size, runs["seed"].n_unique()),
        hint=count_text(known.size, "seed") if known.size else "",
    )


def _without_limits(known: int, seeds: int) -> str:
    """Returns why a mean has no limits; "" of so few seeds, as the table's note says it once."""
    if seeds < UNITS_FROM:
        return ""
    return no_limits_text(known, "seed") if known >= UNITS_FROM else f"{known} of {seeds} seeds"


def possible_part(limits: Interval, column: str, least: float) -> Interval:
    """Returns the part of an interval in which the quantity can lie.

    No metric of a run is negative, and no share above 100 %. least: the least value seen.
    """
    low, high = limits
    most = 100.0 if "_pct" in column else float("inf")
    return Interval(max(low, min(0.0, least)), min(high, most))


def kinds_table(matrix: Matrix) -> Table:
    """Returns counts of what put the car back by configuration; roll-overs where there were any."""
    titles = {} if matrix.has_grades else UNGRADED_TITLES
    rolled = any(matrix.cell(config)["roll_overs"].sum() for config in matrix.configs)
    kinds = [
        (kind, titles.get(kind, title), words)
        for kind, title, words in KINDS
        if kind != "roll_overs" or rolled
    ]
    return _counts(matrix, kinds, "What the interventions were: counts, every drive once")


def grades_table(matrix: Matrix) -> Table:
    """Returns counts of how hard the contacts were by configuration, without grades in older results."""
    grades = GRADES if matrix.has_grades else ()
    note = GRADES_NOTE if grades else ""
    caption = "What the contacts were: counts, every drive once"
    return _counts(matrix, (CONTACTS, *grades), caption, note)


def _counts(
    matrix: Matrix, kinds: Sequence[tuple[str, str, str]], caption: str, note: str = ""
) -> Table:
    """Returns a table of total counts over all runs, a column per kind (field, title, meaning)."""

    def name(config: str) -> Cell:
        runs = matrix.cell(config)
        note = f"{count_text(len(runs), 'run')}, {runs['distance_km'].sum():,.0f} km"
        return Cell(config_title(config), note=note)

    def count(kind: str, config: str) -> int:
        return int(matrix.cell(config)[kind].sum())

    columns = [
        Column("configuration", name),
        *(Column[str](title, partial(count, kind), words) for kind, title, words in kinds),
    ]
    return table(columns, matrix.configs, caption, note)


def background_table(matrix: Matrix) -> Table:
    """Returns contacts among background vehicles by weather, over the compared configurations."""

    def total(column: str, group: WeatherGroup) -> float:
        return float(sum(matrix.within(c, group)[column].sum() for c in matrix.comparison_configs))

    def rate(group: WeatherGroup) -> Quantity:
        km, contacts = total("traffic_km", group), int(total("traffic_contacts", group))
        if km <= 0.0:
            return Quantity(value=None)
        return Quantity(
            value=100.0 * contacts / km, interval=poisson_interval(contacts, km / 100.0)
        )

    columns = [
        Column[WeatherGroup]("weather", lambda group: group.title),
        Column[WeatherGroup]("distance", partial(total, "traffic_km"), "of all of them", "km"),
        *(
            Column[WeatherGroup](title, partial(total, column), note, format=Format(".0f"))
            for column, title, note in BACKGROUND
        ),
        Column[WeatherGroup]("per 100 km", rate, "of the contacts, exact 95 % interval"),
    ]
    return table(
        columns, matrix.weather_groups, "Contacts among background vehicles", BACKGROUND_NOTE
    )


def per_weather(matrix: Matrix) -> list[Block]:
    """Returns every metric of every cell, one folded table per configuration (A-256)."""
    return [_metrics_table(matrix, config) for config in matrix.configs]


def _metrics_table(matrix: Matrix, config: str) -> Table:
    """Returns the folded table of a configuration's metrics, a column per group of weathers."""

    def of(group: WeatherGroup, metric: Metric) -> Quantity:
        return replace(metric_quantity(matrix.within(config, group), metric.name), remark="")

    columns = [
        Column[Metric]("metric", lambda m: Cell(m.heading, note=m.meaning)),
        *(
            Column[Metric](g.title, partial(of, g), ", ".join(g.weathers))
            for g in matrix.weather_groups
        ),
    ]
    note = "Means over seeds; small: 95 % interval, none where all seeds are alike."
    metrics = [m for m in matrix.metrics if m.name != SAME_AS_INTERVENTIONS]
    found = table(columns, metrics, config_title(config), note, sortable=False)
    return replace(found, folded=True)
