"""Tables of the matrix report (A-256, A-258)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import polars as pl

from skidpad.core.wording import count_text
from skidpad.evidence.contrasts import paired_runs, per_seed
from skidpad.evidence.statistics import (
    ASSUMED,
    EVER_SIGNIFICANT,
    UNITS_FROM,
    Rate,
    compare_pairs,
    mean_limits,
    no_limits_text,
    p_text,
    poisson_interval,
    rate_remark,
)
from skidpad.recording.matrix import Metrics
from skidpad.report.campaign import Metric, metrics_of
from skidpad.report.matrix_contrasts import ALPHA, BY_RUN
from skidpad.report.matrix_data import (
    EVENTS,
    INTERVENTIONS,
    Matrix,
    WeatherGroup,
    config_title,
    rate_by_seed,
)
from skidpad.report.page import Block, Cell, Table, Text
from skidpad.report.tables import Column, Format, Quantity, table

STEPS = (("1", "2"), ("2", "3"), ("3", "4"), ("2", "4"))
WORSE_UP = (EVENTS, "lane_invasions", "dropout_pct", "ttc_below_1_5_s", "mean_error_m")
STEP_COLUMNS = (
    "fatal_collisions",
    "lane_invasions",
    "mean_speed_kmh",
    "dropout_pct",
    "ttc_below_1_5_s",
    "mean_error_m",
    "headway_variance_m2",
)
RATE = Format(".2f", absent="no run")
MEANS = (
    ("dropout_pct", "Dropout: ticks without a target or persisting, %"),
    ("headway_variance_m2", "Variance of the distance error, m²"),
    ("mean_error_m", "Mean distance error, m"),
    ("radar_fpr_pct", "Radar false positive rate after the lane check, %"),
    ("radar_fnr_pct", "Radar false negative rate after the lane check, %"),
    ("mean_speed_kmh", "Mean speed, km/h"),
)  # fmt: skip
KINDS = (
    ("collisions_vehicle", "vehicles", "recoveries after hitting or being hit by a vehicle"),
    ("rear_ended", "of these struck from behind", "another vehicle drove into the ego"),
    ("collisions_static", "barriers and posts", "recoveries after hitting anything that stands"),
    ("off_road", "off the road", "left all lanes and was put back"),
    (
        "bend_exits",
        "in a bend without a lead",
        "of the two before: speed alone was too much for the bend",
    ),
    ("wrong_way", "wrong-way corrections", ""),
    ("stuck_relocations", "stuck and put back", "no intervention"),
    ("contacts", "contacts", "of the ego, also those within the cool-down of a recovery"),
)
GRADES = (
    ("contacts_light", "below 5 km/h", "of the contacts with road users, by change of speed"),
    ("contacts_medium", "5 to 20", "the same, or slower with a person or two wheels"),
    ("contacts_heavy", "above 20", "the same"),
    ("contacts_vulnerable", "with persons or two wheels", "of these"),
    ("contacts_static", "with what stands", "barriers, posts"),
)

BACKGROUND = (
    ("traffic_contacts", "contacts", "of two background vehicles, first touch"),
    ("traffic_contacts_after_ego", "soon after the ego's", "within 20 s of a contact of the ego"),
    ("traffic_put_back", "put back", "stood without a cause or left the lane for 10 s"),
    ("traffic_moved", "moved", "far from the ego, and entered anew nearer to it"),
)


def collisions(matrix: Matrix) -> list[Block]:
    """Crashes, interventions, and what they were."""
    return [
        count_table(matrix, EVENTS, crash_caption(matrix)),
        *(
            [count_table(matrix, "serious_contacts", "Serious contacts per run")]
            if matrix.has_grades
            else []
        ),
        count_table(matrix, "road_departures", "Departures from the road per run"),
        count_table(matrix, INTERVENTIONS, "Interventions per run (published as collisions)"),
        count_table(
            matrix, "fatal_first", "Interventions per run that are the first of their chain"
        ),
        kinds_table(matrix),
        background_table(matrix),
    ]


def crash_caption(matrix: Matrix) -> str:
    """What a crash is in these results."""
    if matrix.has_grades:
        return "Crashes per run: serious contacts and departures"
    return "Crashes per run: interventions, as these results grade no contact"


def others(matrix: Matrix) -> list[Block]:
    """Lane invasions, dropouts and radar errors."""
    return [
        count_table(matrix, "lane_invasions", "Solid markings crossed per run"),
        *(mean_table(matrix, column, caption) for column, caption in MEANS),
    ]


def by_weather(
    matrix: Matrix,
    of: Callable[[WeatherGroup | None, str], Quantity],
    format: Format,
    caption: str,
    note: str,
) -> Table:
    """One row per configuration, one column per weather, and one in which each drive counts once.

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


def count_table(matrix: Matrix, column: str, caption: str) -> Table:
    """Events per run with intervals."""
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
    return by_weather(matrix, of, RATE, caption, note)


def rate_quantity(rate: Rate | None, top: float | None = None) -> Quantity:
    """Events per run; shaded against the rate `top`."""
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
    """What stands beside a rate; of a single seed nothing, the table's note says it once."""
    return rate_remark(rate, "seed") if rate.runs > 1 else ""


def few_seeds_note(matrix: Matrix) -> str:
    """The sentence that stands once below a table, in place of limits that so few seeds cannot give."""
    if matrix.seeds >= UNITS_FROM:
        return ""
    return f" {no_limits_text(matrix.seeds, 'seed')}."


def rate_hint(rate: Rate) -> str:
    """What a rate rests on."""
    events, seeds = count_text(rate.events, "event"), count_text(rate.runs, "seed")
    return f"{events}, {seeds}"


def mean_table(matrix: Matrix, column: str, caption: str) -> Table:
    """Means over seeds with intervals."""

    def of(group: WeatherGroup | None, config: str) -> Quantity:
        runs = matrix.cell(config) if group is None else matrix.within(config, group)
        return mean_quantity(runs, column)

    note = f"Mean over seeds; small: 95 % interval over seeds.{few_seeds_note(matrix)}"
    return by_weather(matrix, of, Format(), caption, note)


def mean_quantity(runs: pl.DataFrame, column: str) -> Quantity:
    """Mean over seeds, of each the mean of its runs; one seed has no interval."""
    known = per_seed(runs.drop_nulls(column), pl.col(column).cast(pl.Float64)).to_numpy()
    limits = mean_limits(known)
    return Quantity(
        value=float(known.mean()) if known.size else None,
        interval=limits,
        remark=no_limits_text(known.size, "seed")
        if limits is None and known.size >= UNITS_FROM
        else "",
        hint=count_text(known.size, "seed") if known.size else "",
    )


def kinds_table(matrix: Matrix) -> Table:
    """What the collisions of each configuration were."""

    def name(config: str) -> Cell:
        runs = matrix.cell(config)
        note = f"{count_text(len(runs), 'run')}, {runs['distance_km'].sum():,.0f} km"
        return Cell(config_title(config), note=note)

    def count(kind: str, config: str) -> int:
        return int(matrix.cell(config)[kind].sum())

    columns = [
        Column("configuration", name),
        *(
            Column[str](title, partial(count, kind), definition)
            for kind, title, definition in (*KINDS, *(GRADES if matrix.has_grades else ()))
        ),
    ]
    return table(
        columns,
        matrix.configs,
        "What the interventions and contacts were: counts, every drive once",
    )


def background_table(matrix: Matrix) -> Table:
    """How whole the background stayed in each weather, over the compared configurations."""

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
    return table(columns, matrix.weather_groups, "Contacts among background vehicles")


def pairs(matrix: Matrix) -> list[Block]:
    """Neighbouring configurations, paired by weather and seed."""
    if matrix.seeds < EVER_SIGNIFICANT:
        return [Text(few_seeds_text(matrix.seeds))]
    intro = Text(
        "The difference that each step makes, paired by weather and seed: second minus first "
        "configuration. The step from 2 to 4 adds light assist, resume protocol and limiter at once."
    )
    metrics = {m.name: m for m in metrics_of(Metrics)}
    columns = [
        Column[tuple[str, str]](
            "step", lambda step: Cell(" to ".join(step), note=config_title(step[1])[4:])
        ),
        *(
            Column[tuple[str, str]](
                metrics[name].title,
                partial(step_quantity, matrix, name),
                metrics[name].meaning,
                metrics[name].unit,
                format=Format("+.2f", absent="no pairs"),
            )
            for name in STEP_COLUMNS
        ),
    ]
    there = [step for step in STEPS if {*step} <= {*matrix.configs}]
    return [intro, table(columns, there, "Paired differences per run")] if there else []


def few_seeds_text(seeds: int) -> str:
    """The line that stands in place of what so few seeds cannot fill."""
    return (
        f"{count_text(seeds, 'seed')} per cell cannot show what a step changes: fewer than "
        f"{EVER_SIGNIFICANT} pairs allow no test."
    )


def step_quantity(matrix: Matrix, column: str, step: tuple[str, str]) -> Quantity:
    """The second configuration less the first, paired; a clear sign is marked better or worse."""
    less, more = (pl.col("config") == config for config in step)
    pairs, _ = paired_runs(matrix.finished, more, less, BY_RUN, column)
    if not len(pairs):
        return Quantity(value=None)
    c = compare_pairs(per_seed(pairs, pl.col("difference")))
    judged = column in WORSE_UP and c.p is not None and c.p < ALPHA
    return Quantity(
        value=c.mean,
        interval=c.interval,
        remark=p_text(c.p),
        kind=("bad" if c.mean > 0 else "good") if judged else "",
        hint=count_text(c.n, "seed"),
    )


def per_weather(matrix: Matrix) -> list[Block]:
    """Every metric of every cell, one table per configuration (A-256)."""
    return [_metrics_table(matrix, config) for config in matrix.configs]


def _metrics_table(matrix: Matrix, config: str) -> Table:
    def of(group: WeatherGroup, metric: Metric) -> Quantity:
        return mean_quantity(matrix.within(config, group), metric.name)

    columns = [
        Column[Metric]("metric", lambda m: Cell(m.heading, note=m.meaning)),
        *(
            Column[Metric](g.title, partial(of, g), ", ".join(g.weathers))
            for g in matrix.weather_groups
        ),
    ]
    return table(columns, metrics_of(Metrics), config_title(config), sortable=False)
