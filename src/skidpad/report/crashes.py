"""The crash cards of a campaign: the worst of each cell in the page, the rest in OUT/cards (M-17)."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from skidpad.evidence.drive.collisions import Crash, find_crashes
from skidpad.evidence.drive.prepared import Drive, prepare
from skidpad.recording.logfiles import TICKS, read_log
from skidpad.report.cards import crash_card, severity
from skidpad.report.matrix_data import Matrix, config_title, weather_title
from skidpad.report.page import Block, Cards, Page, Section, Text, write_page
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap

RUNS, CARDS = "runs", "cards"
INLINE = 3  # per cell
RUNS_READ = 10  # per cell, those with the hardest impacts


def crash_sections(matrix: Matrix, folder: Path) -> list[Block]:
    """One fold per cell with its worst crashes; pages with all of them beside the report."""
    blocks: list[Block] = []
    for config in matrix.configs:
        for weather in matrix.weathers:
            cell = _cell_block(matrix, folder, config, weather)
            if cell is not None:
                blocks.append(cell)
    if not blocks:
        return [Text("No fatal collision.")]
    intro = Text(
        "The three hardest crashes of each cell. Times in a chain count back from the contact. "
        "Every other crash stands on its cell's own page in the folder cards."
    )
    return [intro, *blocks]


def _cell_block(matrix: Matrix, folder: Path, config: str, weather: str) -> Cards | None:
    crashed = matrix.cell(config, weather).filter(pl.col("fatal_collisions") > 0)
    hardest = crashed.sort("max_impact_kmh", "seed", descending=[True, False], nulls_last=True)
    runs = [run_folder(folder, config, weather, s) for s in hardest["seed"].head(RUNS_READ)]
    found = [item for run in runs if (run / TICKS).exists() for item in _crashes(run)]
    if not found:
        return None
    found.sort(key=lambda item: severity(item[0]), reverse=True)
    title = f"{config_title(config)}, {weather_title(weather)}"
    inline = [crash_card(*item) for item in found[:INLINE]]
    if len(found) <= INLINE and len(crashed) <= RUNS_READ:
        return Cards(title, inline)
    name = "".join(c if c.isalnum() else "-" for c in f"{config}_{weather}") + ".html"
    (folder / CARDS).mkdir(exist_ok=True)
    section = Section(title, [Cards(title, [crash_card(*item) for item in found], open=True)])
    write_page(Page("Crashes", title, [section]), folder / CARDS / name)
    total = int(crashed["fatal_collisions"].sum())
    told = f"{len(found)} of {total} crashes" if len(found) < total else f"all {total} crashes"
    return Cards(title, inline, link=f"{CARDS}/{name}", note=told)


def _crashes(run: Path) -> list[tuple[Crash, Drive, RoadMap, Path]]:
    log = read_log(run)
    road_map = load_map(log.header.map)
    drive = prepare(log, road_map)
    return [(crash, drive, road_map, run) for crash in find_crashes(drive)]


def run_folder(folder: Path, config: str, weather: str, seed: int) -> Path:
    """Where a run stands; the name is made by `campaign.cells.Cell.name`."""
    driver = "".join(c if c.isalnum() else "-" for c in config)
    return folder / RUNS / f"{driver}_{weather}-{seed:03d}"
