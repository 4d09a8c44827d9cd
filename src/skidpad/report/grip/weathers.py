"""The weathers of the friction campaign: their parameters and ratios, ours beside the published."""

from __future__ import annotations

from functools import partial
from typing import Any

import polars as pl

from skidpad.evidence.grip.study import REDUCED
from skidpad.report.elements.page import Block
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.grip.data import GripCampaign
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
    """One row per weather that the source printed; nothing where none of them was driven."""
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
    """The ratio of the runs with weather's friction, by weather."""
    reduced = campaign.plain.filter(pl.col("friction") == REDUCED).drop_nulls("ratio")
    return dict(reduced.group_by("weather").agg(pl.col("ratio").mean()).rows())


def _parameter(column: str, row: Row) -> float:
    return float(row[column])


def _ratio(row: Row) -> Quantity:
    return Quantity(value=row["ours"], published=row["friction_ratio_printed"])


def _note(campaign: GripCampaign) -> str:
    """What the ratios are, and whether both are of one model."""
    model = campaign.values("model")
    if model == STATISTICAL:
        return (
            "Both are of the statistical model; the source prints two digits, some of them cut off."
        )
    return (
        f"Ours are of the model {model}, the published of the statistical one: they need not agree."
    )
