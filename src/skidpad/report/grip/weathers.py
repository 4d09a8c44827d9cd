"""The weathers of the friction campaign: their parameters and ratios, ours beside the published."""

from __future__ import annotations

from functools import partial
from typing import Any, Literal

import polars as pl

from skidpad.evidence.grip.rain import CELLS, FourCells, four_cells
from skidpad.evidence.grip.study import REDUCED
from skidpad.evidence.statistics import Interval
from skidpad.report.elements.page import Block, Cell
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.grip.data import FIXED, GripCampaign, scenario_title
from skidpad.report.published import Source, published_rows

Row = dict[str, Any]
PARAMETERS = {
    "cloudiness": "cloudiness_pct",
    "precipitation": "precipitation_pct",
    "deposits": "precipitation_deposits_pct",
    "wetness": "wetness_pct",
    "fog": "fog_density_pct",
    "wind": "wind_intensity_pct",
    "ice": "ice_thickness_pct",
}
STATISTICAL = "statistical"


def weather_blocks(campaign: GripCampaign) -> list[Block]:
    """Returns the table of weathers that the source printed; empty where none of them was driven."""
    presets = published_rows(Source.PRESETS, "preset")
    ratios = _ratios(campaign)
    rows = [presets[w] | {"ours": ratios[w]} for w in presets if w in ratios]
    if not rows:
        return []
    columns = [
        Column[Row]("weather", lambda row: row["preset"]),
        *(
            Column[Row](title, partial(_parameter, column), "as published", "%")
            for title, column in PARAMETERS.items()
        ),
        Column[Row]("friction ratio", _ratio, "of dry grip, at standstill", format=Format(".3f")),
    ]
    return [
        table(columns, rows, "Weathers: published parameters and friction ratios", _note(campaign))
    ]


def _ratios(campaign: GripCampaign) -> dict[str, float]:
    """Returns by weather the mean friction ratio of the runs with weather's friction."""
    reduced = campaign.plain.filter(pl.col("friction") == REDUCED).drop_nulls("ratio")
    return dict(reduced.group_by("weather").agg(pl.col("ratio").mean()).rows())


def _parameter(column: str, row: Row) -> float:
    """Returns the value in a row's column as a float."""
    return float(row[column])


def _ratio(row: Row) -> Quantity:
    """Returns our friction ratio beside the published one."""
    return Quantity(value=row["ours"], published=row["friction_ratio_printed"])


def _note(campaign: GripCampaign) -> str:
    """Returns a sentence on what the ratios are, and whether both are of one model."""
    model = campaign.values("model")
    if model == STATISTICAL:
        return (
            "Both are of the statistical model; the source prints two digits, some of them cut off."
        )
    return (
        f"Ours are of the model {model}, the published of the statistical one: they need not agree."
    )


# --- the report's block of four cells: rain on the lens, rain on the road (B-160, B-161)
QUANTITIES = {
    "completion": ("completion, %", 100.0),
    "score": ("score", 1.0),
    "min_cvip_m": ("least distance of centres, m", 1.0),
}
NOTE = (
    "Each seed was driven four times. Visual: drops on the lens alone, against neither; physical: "
    "reduced friction alone; together: what both do beyond the sum of the two. Small: 95 % interval, "
    "paired by seed."
)
Effect = Literal["visual", "physical", "interaction"]
EFFECTS: tuple[tuple[Effect, str], ...] = (
    ("visual", "visual effect"),
    ("physical", "physical effect"),
    ("interaction", "together"),
)


def rain_tables(campaign: GripCampaign) -> list[Block]:
    """Returns one table per quantity; empty unless the campaign drove the four cells."""
    if not campaign.four_cells:
        return []
    tables: list[Block] = []
    for quantity, (title, scale) in QUANTITIES.items():
        cells = list(four_cells(campaign.results, quantity))
        tables += [table(_columns(scale), cells, f"Four cells: {title}", NOTE)] if cells else []
    return tables


def _columns(scale: float) -> list[Column[FourCells]]:
    """Returns the columns of the four cells and their effects, all values multiplied by `scale`."""

    def mean(name: str, cell: FourCells) -> float:
        return scale * cell.means[name]

    def effect(name: Effect, cell: FourCells) -> Quantity:
        c = getattr(cell, name)
        limits = c.interval and Interval(*(scale * end for end in c.interval))
        return Quantity(value=scale * c.mean, interval=limits, kind="" if c.is_clear else "muted")

    return [
        Column("scenario", _name),
        Column("weather", lambda cell: cell.weather),
        Column("seeds", lambda cell: Cell(f"{cell.n}", sort=cell.n)),
        *(Column(name, partial(mean, name), format=Format(".3g")) for name in CELLS),
        *(
            Column(title, partial(effect, name), format=Format("+.3g", "+.3g"))
            for name, title in EFFECTS
        ),
    ]


def _name(cell: FourCells) -> str:
    """Returns the scenario's title, with the variant of the cut-in unless it is the fixed one."""
    variant = "" if cell.cutin == FIXED else f", {cell.cutin}"
    return scenario_title(cell.scenario) + variant
