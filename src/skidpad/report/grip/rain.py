"""The report's block of four cells: rain on the lens, rain on the road (B-160, B-161)."""

from __future__ import annotations

from functools import partial
from typing import Literal

from skidpad.evidence.grip.rain import CELLS, FourCells, four_cells
from skidpad.evidence.statistics import Interval
from skidpad.report.elements.page import Block, Cell
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.grip.data import FIXED, GripCampaign, scenario_title

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
    """One table per quantity; none unless the campaign drove the four cells."""
    if not campaign.four_cells:
        return []
    tables: list[Block] = []
    for quantity, (title, scale) in QUANTITIES.items():
        cells = list(four_cells(campaign.results, quantity))
        tables += [table(_columns(scale), cells, f"Four cells: {title}", NOTE)] if cells else []
    return tables


def _columns(scale: float) -> list[Column[FourCells]]:
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
    variant = "" if cell.cutin == FIXED else f", {cell.cutin}"
    return scenario_title(cell.scenario) + variant
