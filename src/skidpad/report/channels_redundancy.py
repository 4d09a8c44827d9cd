"""Whether redundancy pays: the same seeds driven by one channel and by the arbiter (decision C-9)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import polars as pl

from skidpad.evidence.findings import paired
from skidpad.evidence.statistics import interval_text, p_text
from skidpad.report.page import Block, Cell, Table, Text

ARBITER = "arbiter"
OUTCOMES = (
    ("collisions", "collisions"), ("red_lights_run", "red lights run"), ("stalls", "stalls"),
    ("distance_m", "distance, m"),
)  # fmt: skip


def redundancy(folder: Path) -> list[Block]:
    """Outcomes per driver, and each channel alone less the arbiter at equal seeds."""
    table = outcomes(folder)
    if table is None or table["drive_by"].n_unique() < 2:
        return [
            Text(
                "Not shown: it needs the same seeds driven by the arbiter and by a channel alone "
                "(`skidpad channels drive --drive-by NAME` into a folder below this one).",
                tone="note",
            )
        ]
    rows = []
    for (driver,), group in table.group_by("drive_by", maintain_order=True):
        cells = [Cell(f"{group[c].sum():.0f}", float(group[c].sum())) for c, _ in OUTCOMES]
        rows.append([Cell(str(driver)), Cell(f"{len(group)}", float(len(group))), *cells])
    heads = [("driven by", ""), ("segments", ""), *[(title, "") for _, title in OUTCOMES]]
    return [Table(heads, rows, caption="Outcomes by driver"), Text(_compared(table))]


def outcomes(folder: Path) -> pl.DataFrame | None:
    """One row per driven segment below `folder`, from the files beside the recordings."""
    rows = []
    for path in sorted(folder.rglob("*.json")):
        if not path.with_suffix(".mcap").exists():
            continue
        try:
            record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            row: dict[str, float | str] = {
                name: float(record["outcome"][name]) for name, _ in OUTCOMES
            }
            row |= {k: str(record["outcome"][k]) for k in ("route", "seed")}
            rows.append(row | {"drive_by": str(record["plan"]["drive_by"])})
        except (ValueError, KeyError, TypeError, OSError):
            continue
    return pl.DataFrame(rows) if rows else None


def _compared(table: pl.DataFrame) -> str:
    arbiter = table.filter(pl.col("drive_by") == ARBITER)
    said = []
    for driver in sorted(set(table["drive_by"].to_list()) - {ARBITER}):
        alone = table.filter(pl.col("drive_by") == driver)
        both = alone.join(arbiter, on=["route", "seed"], suffix="_arbiter")
        for name, title in OUTCOMES:
            if not len(both):
                continue
            c = paired(title, (both[name] - both[f"{name}_arbiter"]).to_numpy(), 0.0)
            p = p_text(min(1.0, 2.0 * min(c.p_claimed, c.p_reversed)))
            said.append(
                f"{driver} alone less the arbiter, {title} per segment: {c.mean:+.3g} "
                f"({interval_text(c.interval)}, {p}, {c.units} pairs)"
            )
    return "; ".join(said) + "." if said else "No seeds are common to the drivers."
