"""Pixels against objects: the same runs at both levels of the sensors, seed for seed."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import polars as pl

from skidpad.core.errors import FileError
from skidpad.core.text.wording import count_text
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.matrix import PIXELS, MatrixEntry
from skidpad.report.elements.figures import POINTS, Chart, Curve, curves
from skidpad.report.elements.page import Block, Cell, Figure, Text
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.data import (
    BASELINE,
    EVENTS,
    Matrix,
    WeatherGroup,
    config_list,
    config_title,
)
from skidpad.report.matrix.tables import METRICS

COMPARED = tuple(
    METRICS[column]
    for column in (
        "mean_speed_kmh",
        "dropout_pct",
        "mean_error_m",
        "radar_fpr_pct",
        "radar_fnr_pct",
    )
)


class Twin(NamedTuple):
    """A run on pixels and its twin on objects, as rows by column."""

    pixels: dict[str, object]
    objects: dict[str, object]
    weathers: tuple[str, ...]  # in which both moved so


class Parity:
    """Pairs the runs of a campaign with those that were driven on pixels too."""

    def __init__(self, matrix: Matrix, pixels: Matrix) -> None:
        self.matrix, self.pixels = matrix, pixels

    @cached_property
    def twins(self) -> list[Twin]:
        """Returns every pair in the order of configurations and weathers.

        What moved alike at both levels in several weathers is one pair (decision T-3).
        """
        found: dict[tuple[object, ...], Twin] = {}
        for config in self.matrix.configs:
            for weather in self.matrix.weathers:
                objects = {r["seed"]: r for r in self.matrix.cell(config, weather).to_dicts()}
                cell = self.pixels.finished.filter(
                    (pl.col("config") == config) & (pl.col("weather") == weather)
                )
                for row in cell.sort("seed").to_dicts():
                    if row["seed"] in objects:
                        self._add(found, Twin(row, objects[row["seed"]], (weather,)))
        return list(found.values())

    def _add(self, found: dict[tuple[object, ...], Twin], twin: Twin) -> None:
        """Adds a pair to `found`, or its weather to the pair that moved alike."""
        moved = (
            twin.pixels[self.pixels.drive_column],
            twin.objects[self.matrix.drive_column],
        )
        apart = twin.weathers if None in moved else ()  # unknown hashes are of no other drive
        key = (twin.pixels["config"], twin.pixels["seed"], *moved, apart)
        known = found.get(key)
        weathers = (*(known.weathers if known else ()), *twin.weathers)
        found[key] = (known or twin)._replace(weathers=weathers)


def load_parity(matrix: Matrix) -> Parity | None:
    """Reads the pixel runs below a campaign's folder; None where there are none yet."""
    folder: Path = matrix.folder.path / PIXELS
    try:
        pixels = Matrix(CampaignFolder(folder, MatrixEntry))
        assert len(pixels.results)
    except FileError:
        return None
    return Parity(matrix, pixels)


def parity_section(parity: Parity | None) -> list[Block]:
    """Returns a text, a figure and a table on what the pixel level changes; empty without pairs."""
    if parity is None or not parity.twins:
        return []
    return [Text(parity_text(parity)), _figure(parity), _table(parity)]


def parity_text(parity: Parity) -> str:
    """Returns a text on crashes at both levels, and on how many drives moved alike."""
    drives = _by_objects(parity)
    on_objects = sum(int(d[0].objects[EVENTS] or 0) for d in drives)  # type: ignore[call-overload]
    on_pixels = sum(sum(_number(t.pixels, EVENTS) or 0.0 for t in d) / len(d) for d in drives)
    alike = [d for d in drives if all(_is_same_drive(t) for t in d)]
    seeds = count_text(len({d[0].pixels["seed"] for d in drives}), "seed")
    same = f"{len(alike)} moved alike to the last bit at both levels"
    if alike:
        drivers = list(dict.fromkeys(str(d[0].pixels["config"]) for d in alike))
        same += f", with {config_list(drivers)}"
    several = [d for d in drives if len(d) > 1]
    mean = (
        " Where one drive on objects has several on pixels, as images differ between times of day, "
        "their mean counts."
    )
    return (
        f"This page is about the object level: sensors from boxes, without images. {seeds} of it "
        f"drove once more on camera images. {count_text(len(drives), 'different drive')} of the "
        f"compared configurations had {count_text(on_objects, 'crash', 'crashes')} on objects and "
        f"{on_pixels:.3g} on pixels; {same}.{mean if several else ''} One seed shows how the levels "
        "differ and not how often."
    )


def _by_objects(parity: Parity) -> list[list[Twin]]:
    """Returns the pairs without the baseline, those together that share their drive on objects."""
    found: dict[tuple[object, ...], list[Twin]] = {}
    for twin in parity.twins:
        if twin.pixels["config"] == BASELINE:
            continue
        drive = twin.objects[parity.matrix.drive_column]
        apart = twin.weathers if drive is None else ()
        key = (twin.pixels["config"], twin.pixels["seed"], drive, apart)
        found.setdefault(key, []).append(twin)
    return list(found.values())


def _is_same_drive(twin: Twin) -> bool:
    """Returns True when both runs of a twin have the same known motion hash."""
    return twin.pixels["motion_hash"] == twin.objects["motion_hash"] is not None


def _number(row: dict[str, object], column: str) -> float | None:
    """Returns a row's value in the column as a float; None where it is null."""
    value = row[column]
    return None if value is None else float(value)  # type: ignore[arg-type]


def _both(column: str, twin: Twin) -> Quantity:
    """Returns the value of `column` on pixels, with that on objects as a line below it."""
    there, here = (_number(row, column) for row in (twin.pixels, twin.objects))
    lines = () if here is None else (f"objects {here:.2f}",)
    return Quantity(value=there, lines=lines)


def _table(parity: Parity) -> Block:
    """Returns the table of twins, their quantities on pixels beside those on objects."""

    def name(twin: Twin) -> Cell:
        return Cell(
            config_title(str(twin.pixels["config"])),
            note=f"{WeatherGroup(twin.weathers).title}, seed {twin.pixels['seed']}",
        )

    def of(column: str) -> Column[Twin]:
        metric = METRICS.get(column)
        title, unit = (metric.title, metric.unit) if metric else (column, "")
        return Column(title, lambda twin: _both(column, twin), unit=unit, format=Format(".2f"))

    columns = [Column("run", name), of(EVENTS), *(of(metric.name) for metric in COMPARED)]
    note = "Large: on pixels; small: on objects, same seed. What moved alike is one row."
    return table(columns, parity.twins, "The same runs on pixels and on objects", note)


def _figure(parity: Parity) -> Figure:
    """Returns the figure of the first three compared quantities, on pixels over on objects."""
    charts = []
    for column, title, unit in ((m.name, m.title, m.unit) for m in COMPARED[:3]):
        pairs = [
            (str(t.pixels["config"]), x, y)
            for t in parity.twins
            if (x := _number(t.objects, column)) is not None
            and (y := _number(t.pixels, column)) is not None
            and t.pixels["config"] in parity.matrix.comparison_configs
        ]
        most = max((max(x, y) for _, x, y in pairs), default=1.0)
        clouds = [Curve("equal", [0.0, most], [0.0, most], colour=5, style={"linewidth": 0.8})]
        for k, config in enumerate(parity.matrix.comparison_configs):
            mine = [(x, y) for c, x, y in pairs if c == config]
            if mine:
                xs, ys = zip(*mine, strict=True)
                clouds.append(Curve(config_title(config), xs, ys, colour=k, style=POINTS))
        charts.append(Chart(clouds, f"{title} on objects, {unit}", f"on pixels, {unit}"))
    caption = "Each point is one run at both levels; on the line they agree."
    return Figure(curves(charts, width=10.0, height=3.4), caption)
