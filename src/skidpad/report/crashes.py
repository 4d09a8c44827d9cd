"""The crash cards of a campaign: the worst of each cell in the page, the rest in OUT/cards (M-17)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import polars as pl

from skidpad.core.names import slug
from skidpad.evidence.drive.collisions import Crash, find_crashes
from skidpad.evidence.drive.prepared import Drive, prepare
from skidpad.recording.logfiles import read_log
from skidpad.report.cards import crash_card, severity
from skidpad.report.matrix_data import Matrix, config_title, weather_title
from skidpad.report.page import Block, Cards, Page, Section, Text, write_page
from skidpad.roads.bundled import kept_map
from skidpad.roads.queries import RoadMap

CARDS = "cards"
INLINE = 3  # per cell
RUNS_READ = 10  # per cell, those with the hardest impacts
Cell = tuple[str, str]  # configuration, weather
Found = tuple[Crash, Drive, RoadMap, Path]  # Path: of the run


def found_crashes(matrix: Matrix) -> dict[Cell, list[Found]]:
    """The crashes of every cell that has some, hardest first."""
    cells = [(config, weather) for config in matrix.configs for weather in matrix.weathers]
    return {cell: found for cell in cells if (found := _hardest(matrix, *cell))}


def worst_of_each(crashes: dict[Cell, list[Found]]) -> list[Block]:
    """The hardest crash of each configuration, open."""
    worst: dict[str, Found] = {}
    for (config, _), found in crashes.items():
        if config not in worst or severity(found[0][0]) > severity(worst[config][0]):
            worst[config] = found[0]
    if not worst:
        return []
    cards = [
        replace(card, title=f"{config_title(config)}: {card.title}")
        for config, item in worst.items()
        for card in [crash_card(*item)]
    ]
    return [Cards("The worst crash of each configuration", cards, open=True)]


def crash_sections(matrix: Matrix, crashes: dict[Cell, list[Found]]) -> list[Block]:
    """One fold per cell with its worst crashes; pages with all of them beside the report."""
    if not crashes:
        return [Text("No fatal collision.")]
    intro = Text(
        "The three hardest crashes of each cell. Times in a chain count back from the contact. "
        "Every other crash stands on its cell's own page in the folder cards."
    )
    return [intro, *(_cell_block(matrix, *cell, found) for cell, found in crashes.items())]


def _crashed(matrix: Matrix, config: str, weather: str) -> pl.DataFrame:
    return matrix.cell(config, weather).filter(pl.col("fatal_collisions") > 0)


def _hardest(matrix: Matrix, config: str, weather: str) -> list[Found]:
    """Crashes in the runs with the hardest impacts, as far as their logs were kept, hardest first."""
    runs = _crashed(matrix, config, weather).sort(
        "max_impact_kmh", "seed", descending=[True, False], nulls_last=True
    )
    names = matrix.names(runs.head(RUNS_READ))
    found = [crash for name in names if name is not None for crash in _crashes(matrix, name)]
    return sorted(found, key=lambda item: severity(item[0]), reverse=True)


def _crashes(matrix: Matrix, name: str) -> Iterator[Found]:
    run = matrix.folder.log(name)
    if run is not None:
        log = read_log(run)
        road_map = kept_map(matrix.folder.path, log.header.map, log.header.map_hash)
        drive = prepare(log, road_map)
        yield from ((crash, drive, road_map, run) for crash in find_crashes(drive))


def _cell_block(matrix: Matrix, config: str, weather: str, found: list[Found]) -> Cards:
    title = f"{config_title(config)}, {weather_title(weather)}"
    crashed = _crashed(matrix, config, weather)
    inline = [crash_card(*item) for item in found[:INLINE]]
    if len(found) <= INLINE and len(crashed) <= RUNS_READ:
        return Cards(title, inline)
    name = slug(f"{config}_{weather}") + ".html"
    pages = matrix.folder.path / CARDS
    section = Section(title, [Cards(title, [crash_card(*item) for item in found], open=True)])
    write_page(Page("Crashes", title, [section]), pages / name)
    total = int(crashed["fatal_collisions"].sum())
    told = f"{len(found)} of {total} crashes" if len(found) < total else f"all {total} crashes"
    return Cards(title, inline, link=f"{CARDS}/{name}", note=told)
