"""Tables of the matrix report (A-256, A-258)."""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import differences
from skidpad.evidence.statistics import Interval, Rate, bootstrap_interval, compare_pairs, p_text
from skidpad.recording.results import definitions
from skidpad.report.matrix_data import (
    Matrix,
    PublishedCell,
    config_title,
    published_cells,
    weather_title,
)
from skidpad.report.page import Block, Cell, Table, Text

STEPS = (("0", "1"), ("1", "2"), ("2", "3"), ("3", "4"), ("2", "4"))
STEP_COLUMNS = (
    "fatal_collisions",
    "lane_invasions",
    "mean_speed_kmh",
    "dropout_pct",
    "ttc_below_1_5_s",
)
BY_RUN = ("weather", "seed")


def collisions(matrix: Matrix) -> list[Block]:
    """Fatal collisions, and what they were."""
    blocks: list[Block] = [
        count_table(
            matrix, "fatal_collisions", "Fatal collisions per run", "published count of one run"
        ),
        count_table(matrix, "collisions_vehicle", "Of these with vehicles, per run", ""),
        kinds_table(matrix),
    ]
    return blocks


def others(matrix: Matrix) -> list[Block]:
    """Lane invasions, dropouts and radar errors."""
    return [
        count_table(matrix, "lane_invasions", "Solid markings crossed per run", "published count"),
        mean_table(matrix, "dropout_pct", "Dropout: ticks without a target or persisting, %"),
        mean_table(matrix, "headway_variance_m2", "Variance of the distance error, m²"),
        mean_table(matrix, "mean_error_m", "Mean distance error, m"),
        mean_table(matrix, "radar_fpr_pct", "Radar false positive rate after the lane check, %"),
        mean_table(matrix, "radar_fnr_pct", "Radar false negative rate after the lane check, %"),
        mean_table(matrix, "mean_speed_kmh", "Mean speed, km/h"),
    ]


def count_table(matrix: Matrix, column: str, caption: str, published_hint: str) -> Table:
    """Events per run with intervals; the last column adds up each drive once."""
    said = published_cells()
    rates = {(c, w): matrix.rate(column, c, w) for c in matrix.configs for w in matrix.weathers}
    top = max((r.rate for r in rates.values() if r), default=0.0) or 1.0
    rows = [
        [
            Cell(config_title(c)),
            *(
                _rate_cell(rates[c, w], top, said.get((c, w)), column, published_hint)
                for w in matrix.weathers
            ),
            _rate_cell(matrix.rate(column, c), None, None, column, ""),
        ]
        for c in matrix.configs
    ]
    columns = [
        ("configuration", ""),
        *((weather_title(w), w) for w in matrix.weathers),
        ("all", "every drive once"),
    ]
    note = (
        f"Per run of {matrix.duration:g} s; small: 95 % interval, and the published value, "
        "of one run of 500 s, where there is one."
    )
    return Table(columns, rows, caption=caption, note=note)


def _rate_cell(
    rate: Rate | None, top: float | None, said: PublishedCell | None, column: str, hint: str
) -> Cell:
    if rate is None:
        return Cell("no run", kind="muted")
    note = interval(rate.interval)
    published = said.get(column) if said else None
    if published is not None:
        note += f"\npublished {published:g}"
    return Cell(
        f"{rate.rate:.2f}",
        sort=rate.rate,
        note=note,
        heat=None if top is None else (rate.rate / top) ** 0.5,
        hint=f"{rate.events} events in {rate.runs} runs, {rate.method.value}"
        + (f"; {hint}" if published is not None else ""),
    )


def mean_table(matrix: Matrix, column: str, caption: str) -> Table:
    """Means over seeds with bootstrap intervals."""
    said = published_cells()
    rows = []
    for c in matrix.configs:
        cells = [
            _mean_cell(matrix.cell(c, w)[column], said.get((c, w)), column) for w in matrix.weathers
        ]
        rows.append(
            [Cell(config_title(c)), *cells, _mean_cell(matrix.cell(c)[column], None, column)]
        )
    columns = [
        ("configuration", ""),
        *((weather_title(w), w) for w in matrix.weathers),
        ("all", "every drive once"),
    ]
    return Table(
        columns,
        rows,
        caption=caption,
        note="Mean over seeds; small: 95 % interval over seeds, and the published value.",
    )


def _mean_cell(values: pl.Series, said: PublishedCell | None, column: str) -> Cell:
    values = values.drop_nulls()
    published = said.get(column) if said else None
    told = f"published {published:g}" if published is not None else ""
    if not len(values):
        return Cell("none", note=told, kind="muted")
    notes = [interval(bootstrap_interval(values.to_numpy()))] if len(values) > 1 else []
    mean = float(values.mean())  # type: ignore[arg-type]
    return Cell(
        _number(mean),
        sort=mean,
        note="\n".join([*notes, told]),
        hint=f"{len(values)} runs",
    )


def kinds_table(matrix: Matrix) -> Table:
    """What the collisions of each configuration were."""
    kinds = [
        ("collisions_vehicle", "vehicles", "recoveries after hitting or being hit by a vehicle"),
        ("rear_ended", "of these struck from behind", "another vehicle drove into the ego"),
        (
            "collisions_static",
            "barriers and posts",
            "recoveries after hitting anything that stands",
        ),
        ("bend_exits", "of these in bends without a lead", "speed alone was too much for the bend"),
        ("wrong_way", "wrong-way corrections", ""),
        ("stuck_relocations", "stuck, put back", "not fatal"),
        ("contacts", "contacts in all", "also those within the cool-down of a recovery"),
    ]
    rows = []
    for c in matrix.configs:
        runs = matrix.cell(c)
        rows.append(
            [
                Cell(
                    config_title(c), note=f"{len(runs)} runs, {runs['distance_km'].sum():,.0f} km"
                ),
                *(Cell(str(int(runs[k].sum())), sort=int(runs[k].sum())) for k, _, _ in kinds),
            ]
        )
    return Table(
        [("configuration", ""), *((n, h) for _, n, h in kinds)],
        rows,
        caption="What the collisions were: counts over all runs",
    )


def pairs(matrix: Matrix) -> list[Block]:
    """Neighbouring configurations, paired by weather and seed."""
    intro = Text(
        "The difference that each step makes, paired by weather and seed: second minus first "
        "configuration. The step from 2 to 4 adds light assist, resume protocol and limiter at once."
    )
    rows = []
    for a, b in STEPS:
        if a in matrix.configs and b in matrix.configs:
            cells = [_step_cell(matrix, a, b, column) for column in STEP_COLUMNS]
            rows.append([Cell(f"{a} to {b}", note=f"{config_title(b)[4:]}"), *cells])
    meanings = {name: meaning for name, meaning, _ in definitions()}
    columns = [("step", ""), *((c, meanings[c]) for c in STEP_COLUMNS)]
    return [intro, Table(columns, rows, caption="Paired differences per run")] if rows else []


def _step_cell(matrix: Matrix, a: str, b: str, column: str) -> Cell:
    more, less = pl.col("config") == b, pl.col("config") == a
    values, _ = differences(matrix.finished, more, less, BY_RUN, column)
    if not len(values):
        return Cell("no pairs", kind="muted")
    c = compare_pairs(values.to_numpy())
    worse = column in ("fatal_collisions", "lane_invasions", "ttc_below_1_5_s", "dropout_pct")
    clear = c.interval.low > 0.0 or c.interval.high < 0.0
    kind = (
        ("bad" if (c.mean > 0) == worse else "good") if clear and column != "mean_speed_kmh" else ""
    )
    return Cell(
        f"{c.mean:+.2f}",
        sort=c.mean,
        note=f"{interval(c.interval)}, {p_text(c.p)}",
        kind=kind,
        hint=f"{c.n} pairs",
    )


def per_weather(matrix: Matrix) -> list[Block]:
    """Every metric of every cell, one table per configuration (A-256)."""
    blocks: list[Block] = []
    for c in matrix.configs:
        rows = []
        for name, meaning, source in definitions():
            cells = [_mean_cell(matrix.cell(c, w)[name], None, name) for w in matrix.weathers]
            rows.append([Cell(name, hint=f"{meaning} ({source})"), *cells])
        columns = [("metric", ""), *((weather_title(w), w) for w in matrix.weathers)]
        blocks.append(Table(columns, rows, caption=config_title(c), sortable=False))
    return blocks


def interval(limits: Interval) -> str:
    """`[0.1, 1.46]`."""
    return f"[{_number(limits.low)}, {_number(limits.high)}]"


def _number(value: float) -> str:
    if value == int(value) and abs(value) < 1e6:
        return f"{value:.0f}"
    return f"{value:.2f}" if abs(value) < 100 else f"{value:.0f}"
