"""The report's block of four cells: rain on the lens, rain on the road (B-160, B-161)."""

from __future__ import annotations

from skidpad.evidence.grip.rain import CELLS, FourCells, four_cells
from skidpad.evidence.statistics import Comparison
from skidpad.report.grip_data import GripCampaign, scenario_title
from skidpad.report.page import Block, Cell, Table

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


def rain_tables(campaign: GripCampaign) -> list[Block]:
    """One table per quantity; none unless the campaign drove the four cells."""
    if campaign.behind_drops is None:
        return []
    blocks: list[Block] = []
    for quantity, (title, scale) in QUANTITIES.items():
        rows = [_row(found, scale) for found in four_cells(campaign.all_runs, quantity)]
        if rows:
            heads = ["scenario", "weather", "seeds", *CELLS, "visual effect", "physical effect"]
            columns = [(name, "") for name in (*heads, "together")]
            blocks.append(Table(columns, rows, caption=f"Four cells: {title}", note=NOTE))
    return blocks


def _row(found: FourCells, scale: float) -> list[Cell]:
    means = [scale * found.means[name] for name in CELLS]
    variant = "" if found.cutin == "fixed" else f", {found.cutin}"
    return [
        Cell(scenario_title(found.scenario) + variant),
        Cell(found.weather),
        Cell(f"{found.n}", sort=found.n),
        *(Cell(f"{m:.3g}", sort=m) for m in means),
        *(_effect(c, scale) for c in (found.visual, found.physical, found.interaction)),
    ]


def _effect(c: Comparison, scale: float) -> Cell:
    low, high = scale * c.interval.low, scale * c.interval.high
    kind = "" if low > 0.0 or high < 0.0 else "muted"
    mean = scale * c.mean
    return Cell(f"{mean:+.3g}", sort=mean, note=f"{low:+.3g} to {high:+.3g}", kind=kind)
