"""The crash cards of a campaign: the worst of each cell in the page, the rest in OUT/cards (M-17)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import polars as pl

from skidpad.core.files.names import slug
from skidpad.core.text.wording import count_text
from skidpad.evidence.contrasts import drive_hash
from skidpad.evidence.drive.collisions import shown_crashes
from skidpad.evidence.drive.prepared import prepare
from skidpad.recording.campaign.folder import snapshot
from skidpad.report.crashes.cards import Found, crash_card, headline, severity, webp_uri
from skidpad.report.elements.page import (
    Block,
    Cards,
    Image,
    Montage,
    Page,
    Section,
    Text,
    write_page,
)
from skidpad.report.matrix.data import Matrix, config_title, weather_title

CARDS = "cards"
INLINE = 3  # per cell
MONTAGE = 60  # pictures of a configuration
THUMBNAIL = 240, 10_000  # px, bytes
RUNS_READ = 10  # per cell, those with the hardest impacts
Cell = tuple[str, str]  # configuration, weather


def found_crashes(matrix: Matrix) -> dict[Cell, list[Found]]:
    """Returns the crashes of every cell that has some, hardest first, as far as logs were kept.

    A drive that moved alike in several weathers stands once, under the first of them (T-3).
    """
    return {
        cell: found
        for cell, runs in crashed_runs(matrix).items()
        if (found := _hardest(matrix, runs))
    }


def crashed_runs(matrix: Matrix) -> dict[Cell, pl.DataFrame]:
    """Returns the runs of each cell that had an intervention, what moved alike in the first cell only."""
    keys = ("config", "seed", "sensors", "moved")
    seen: set[tuple[object, ...]] = set()
    found = {}
    for config in matrix.configs:
        for weather in matrix.weathers:
            runs = matrix.cell(config, weather).filter(pl.col("fatal_collisions") > 0)
            runs = runs.with_columns(moved=drive_hash(runs))
            rows = list(runs.select(keys).rows())
            new = [row[-1] is None or row not in seen for row in rows]
            seen.update(rows)
            found[config, weather] = runs.filter(pl.Series(new, dtype=pl.Boolean))
    return found


def worst_of_each(crashes: dict[Cell, list[Found]]) -> list[Block]:
    """Returns the card of the hardest crash of each configuration, open; empty without crashes."""
    cards = [
        replace(card, title=f"{config_title(config)}: {card.title}", id=worst_id(config))
        for config, item in _worst(crashes).items()
        for card in [crash_card(*item)]
    ]
    return [Cards("The worst crash of each configuration", cards, open=True)] if cards else []


def worst_id(config: str) -> str:
    """Returns the name of the place of a configuration's worst crash in the page."""
    return "worst-" + slug(config)


def _worst(crashes: dict[Cell, list[Found]]) -> dict[str, Found]:
    """Returns the most severe crash per configuration over its weathers; lists come hardest first."""
    worst: dict[str, Found] = {}
    for (config, _), found in crashes.items():
        if config not in worst or severity(found[0][0]) > severity(worst[config][0]):
            worst[config] = found[0]
    return worst


def crash_sections(matrix: Matrix, crashes: dict[Cell, list[Found]]) -> list[Block]:
    """Returns one fold per cell with its worst crashes; writes pages with all of them beside the report.

    The worst of a configuration stands at the top of the page, so its cell leaves it out here.
    """
    if not crashes:
        return [Text("No intervention: no crash and no departure.")]
    intro = Text(
        "The hardest crashes of each cell, without the worst of a configuration, which stands in "
        "the first section. Times count from the contact. Of several contacts at once a card is "
        "about the one that decides the class; tables count the one with the largest impulse. A "
        "drive that moved alike in several weathers stands once, under the first of them. Every "
        "other crash stands on its cell's own page in the folder cards."
    )
    runs, worst = crashed_runs(matrix), _worst(crashes)
    cells = [
        _cell_block(matrix, cell, found, runs[cell], worst[cell[0]])
        for cell, found in crashes.items()
    ]
    return [intro, *montages(matrix, crashes), *(c for c in cells if c.cards)]


def montages(matrix: Matrix, crashes: dict[Cell, list[Found]]) -> list[Block]:
    """Returns the pictures of crashes of each configuration side by side, hardest first, MONTAGE at most."""
    blocks: list[Block] = []
    for config in matrix.configs:
        cells = [(w, f) for (c, w), found in crashes.items() if c == config for f in found]
        cells.sort(key=lambda item: severity(item[1][0]), reverse=True)
        taken = [(w, f, path) for w, f in cells if (path := snapshot(f[3], f[0].t)) is not None]
        images = [
            Image(
                webp_uri(path, *THUMBNAIL), f"{weather_title(w)}, {f[0].t:.0f} s: {headline(f[0])}"
            )
            for w, f, path in taken[:MONTAGE]
        ]
        if images:
            count = count_text(len(cells), "crash", "crashes")
            title = f"Crash pictures of {config_title(config)}: {len(images)} of {count}"
            blocks.append(Montage(title, images))
    return blocks


def _hardest(matrix: Matrix, crashed: pl.DataFrame) -> list[Found]:
    """Returns the crashes in the RUNS_READ runs with the hardest impacts whose logs were kept.

    They come hardest first.
    """
    runs = crashed.sort(
        "max_delta_v_kmh", "max_impact_kmh", "seed", descending=[True, True, False], nulls_last=True
    )
    names = matrix.names(runs.head(RUNS_READ))
    found = [crash for name in names if name is not None for crash in _crashes(matrix, name)]
    return sorted(found, key=lambda item: severity(item[0]), reverse=True)


def _crashes(matrix: Matrix, name: str) -> Iterator[Found]:
    """Yields the crashes in a run's log with drive, map and folder; nothing without the log."""
    run = matrix.folder.log(name)
    if run is not None:
        log, road_map = matrix.log(run)
        drive = prepare(log, road_map)
        yield from ((crash, drive, road_map, run) for crash in shown_crashes(drive))


def _cell_block(
    matrix: Matrix, cell: Cell, found: list[Found], crashed: pl.DataFrame, worst: Found
) -> Cards:
    """Returns a cell's cards, the first INLINE at once; more are on a page that it writes.

    found: crashes, hardest first; crashed: runs with one; worst: shown elsewhere.
    """
    config, weather = cell
    title = f"{config_title(config)}, {weather_title(weather)}"
    others = [item for item in found if item is not worst]
    inline = [crash_card(*item) for item in others[:INLINE]]
    if len(others) <= INLINE and len(crashed) <= RUNS_READ:
        if len(others) == len(found):
            return Cards(title, inline)
        return Cards(title, inline, link=f"#{worst_id(config)}", note="the worst stands above")
    name = slug(f"{config}_{weather}") + ".html"
    pages = matrix.folder.path / CARDS
    section = Section(title, [Cards(title, [crash_card(*item) for item in found], open=True)])
    write_page(Page("Crashes", title, [section]), pages / name)
    total = int(crashed["fatal_collisions"].sum())
    told = f"{len(found)} of" if len(found) < total else "all"
    told += f" {count_text(total, 'crash', 'crashes')}"
    return Cards(title, inline, link=f"{CARDS}/{name}", note=told)
