"""Tables of the matrix report (A-256, A-258)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import polars as pl

from skidpad.evidence.contrasts import paired_runs, per_seed
from skidpad.evidence.statistics import (
    Rate,
    compare_pairs,
    mean_limits,
    p_text,
    poisson_interval,
)
from skidpad.recording.matrix import Metrics
from skidpad.report.campaign import Metric, metrics_of
from skidpad.report.matrix_data import Matrix, config_title, published_value, weather_title
from skidpad.report.page import Block, Cell, Table, Text
from skidpad.report.tables import Column, Format, Quantity, table

STEPS = (("0", "1"), ("1", "2"), ("2", "3"), ("3", "4"), ("2", "4"))
WORSE_UP = ("fatal_collisions", "lane_invasions", "dropout_pct", "ttc_below_1_5_s")
STEP_COLUMNS = (
    "fatal_collisions",
    "lane_invasions",
    "mean_speed_kmh",
    "dropout_pct",
    "ttc_below_1_5_s",
)
BY_RUN = ("weather", "seed")
TOO_FEW = "too few"
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
    ("bend_exits", "of these two in bends without a lead", "speed alone was too much for the bend"),
    ("wrong_way", "wrong-way corrections", ""),
    ("stuck_relocations", "stuck, put back", "not fatal"),
    ("contacts", "contacts in all", "also those within the cool-down of a recovery"),
)


BACKGROUND = (
    ("traffic_contacts", "contacts", "of two background vehicles, first touch"),
    ("traffic_contacts_after_ego", "soon after the ego's", "within 20 s of a contact of the ego"),
    ("traffic_put_back", "put back", "stood without a cause or left the lane for 10 s"),
)


def collisions(matrix: Matrix) -> list[Block]:
    """Fatal collisions, and what they were."""
    return [
        count_table(matrix, "crashes_vehicle", "Crashes with vehicles per run"),
        count_table(matrix, "road_departures", "Departures from the road per run"),
        count_table(matrix, "fatal_collisions", "Both: fatal events per run"),
        count_table(matrix, "fatal_first", "Of these the first of their chain, per run"),
        kinds_table(matrix),
        background_table(matrix),
    ]


def others(matrix: Matrix) -> list[Block]:
    """Lane invasions, dropouts and radar errors."""
    return [
        count_table(matrix, "lane_invasions", "Solid markings crossed per run"),
        *(mean_table(matrix, column, caption) for column, caption in MEANS),
    ]


def by_weather(
    matrix: Matrix,
    of: Callable[[str | None, str], Quantity],
    format: Format,
    caption: str,
    note: str,
) -> Table:
    """One row per configuration, one column per weather, and one in which each drive counts once."""
    columns = [
        Column[str]("configuration", config_title),
        *(Column[str](weather_title(w), partial(of, w), w, format=format) for w in matrix.weathers),
        Column[str]("all", partial(of, None), "every drive once", format=format),
    ]
    return table(columns, matrix.configs, caption, note)


def count_table(matrix: Matrix, column: str, caption: str) -> Table:
    """Events per run with intervals."""
    rates = {(c, w): matrix.rate(column, c, w) for c in matrix.configs for w in matrix.weathers}
    top = max((r.rate for r in rates.values() if r), default=0.0) or 1.0

    def of(weather: str | None, config: str) -> Quantity:
        if weather is None:
            return rate_quantity(matrix.rate(column, config))
        said = published_value(column, config, weather)
        return rate_quantity(rates[config, weather], said, top)

    note = (
        f"Per run of {matrix.duration:g} s; small: 95 % interval, and the published value, "
        "of one run of 500 s, where there is one."
    )
    return by_weather(matrix, of, RATE, caption, note)


def rate_quantity(
    rate: Rate | None, published: float | None = None, top: float | None = None
) -> Quantity:
    """Events per run; shaded against the rate `top`."""
    if rate is None:
        return Quantity(value=None)
    return Quantity(
        value=rate.rate,
        interval=rate.interval,
        remark=TOO_FEW if rate.interval is None else "",
        published=published,
        heat=None if top is None else (rate.rate / top) ** 0.5,
        hint=f"{rate.events} events, {rate.runs} seeds, {rate.method.value}",
    )


def mean_table(matrix: Matrix, column: str, caption: str) -> Table:
    """Means over seeds with intervals."""

    def of(weather: str | None, config: str) -> Quantity:
        said = None if weather is None else published_value(column, config, weather)
        return mean_quantity(matrix.cell(config, weather)[column], said)

    note = "Mean over seeds; small: 95 % interval over seeds, and the published value."
    return by_weather(matrix, of, Format(), caption, note)


def mean_quantity(values: pl.Series, published: float | None = None) -> Quantity:
    """Mean over runs; one run has no interval."""
    known = values.drop_nulls().cast(pl.Float64).to_numpy()
    limits = mean_limits(known)
    return Quantity(
        value=float(known.mean()) if known.size else None,
        interval=limits,
        remark=TOO_FEW if limits is None and known.size > 1 else "",
        published=published,
        hint=f"{known.size} runs" if known.size else "",
    )


def kinds_table(matrix: Matrix) -> Table:
    """What the collisions of each configuration were."""

    def name(config: str) -> Cell:
        runs = matrix.cell(config)
        note = f"{len(runs)} runs, {runs['distance_km'].sum():,.0f} km"
        return Cell(config_title(config), note=note)

    def count(kind: str, config: str) -> int:
        return int(matrix.cell(config)[kind].sum())

    columns = [
        Column("configuration", name),
        *(
            Column[str](title, partial(count, kind), definition)
            for kind, title, definition in KINDS
        ),
    ]
    return table(columns, matrix.configs, "What the collisions were: counts over all runs")


def background_table(matrix: Matrix) -> Table:
    """How whole the background stayed in each weather, over all configurations."""

    def total(column: str, weather: str) -> float:
        return float(sum(matrix.cell(c, weather)[column].sum() for c in matrix.configs))

    def rate(weather: str) -> Quantity:
        km, contacts = total("traffic_km", weather), int(total("traffic_contacts", weather))
        if km <= 0.0:
            return Quantity(value=None)
        return Quantity(
            value=100.0 * contacts / km, interval=poisson_interval(contacts, km / 100.0)
        )

    columns = [
        Column[str]("weather", weather_title),
        Column[str]("distance", partial(total, "traffic_km"), "of all of them", "km"),
        *(
            Column[str](title, partial(total, column), note, format=Format(".0f"))
            for column, title, note in BACKGROUND
        ),
        Column[str]("per 100 km", rate, "of the contacts, exact 95 % interval"),
    ]
    return table(columns, matrix.weathers, "Contacts among background vehicles")


def pairs(matrix: Matrix) -> list[Block]:
    """Neighbouring configurations, paired by weather and seed."""
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


def step_quantity(matrix: Matrix, column: str, step: tuple[str, str]) -> Quantity:
    """The second configuration less the first, paired; a clear sign is marked better or worse."""
    less, more = (pl.col("config") == config for config in step)
    pairs, _ = paired_runs(matrix.finished, more, less, BY_RUN, column)
    if not len(pairs):
        return Quantity(value=None)
    c = compare_pairs(per_seed(pairs, pl.col("difference")))
    judged = column in WORSE_UP and (c.interval.low > 0.0 or c.interval.high < 0.0)
    return Quantity(
        value=c.mean,
        interval=c.interval,
        remark=p_text(c.p),
        kind=("bad" if c.mean > 0 else "good") if judged else "",
        hint=f"{c.n} pairs",
    )


def per_weather(matrix: Matrix) -> list[Block]:
    """Every metric of every cell, one table per configuration (A-256)."""
    return [_metrics_table(matrix, config) for config in matrix.configs]


def _metrics_table(matrix: Matrix, config: str) -> Table:
    def of(weather: str, metric: Metric) -> Quantity:
        return mean_quantity(matrix.cell(config, weather)[metric.name])

    columns = [
        Column[Metric]("metric", lambda m: Cell(m.heading, note=m.meaning)),
        *(
            Column[Metric](
                weather_title(w),
                partial(of, w),
                w,
            )
            for w in matrix.weathers
        ),
    ]
    return table(columns, metrics_of(Metrics), config_title(config), sortable=False)
