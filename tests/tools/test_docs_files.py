"""The page of files names every column that a drive or a campaign writes, with its meaning, and no other."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from msgspec import json
from typer.testing import CliRunner

from docs_files import ADDED, PARTS, files_page
from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes import channels, grip
from skidpad.campaign.runs.play import run_to
from skidpad.campaign.workers.worker import Finished
from skidpad.cli.main import app
from skidpad.core.geometry import Pose
from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import LightState, RelocationReason
from skidpad.evidence.channels.monitor import MonitorSettings
from skidpad.live.watch import Timer, watch
from skidpad.recording.run.events import (
    LightChange,
    Notice,
    NoticeSource,
    PutBack,
    Relocation,
    encode_events,
)
from skidpad.report.play.page import write_play_report
from skidpad.scenarios.shipped import FOLDER
from support.channel_worlds import Eyes, World, drive
from support.runs import scenario_run, segment_run

WORLD = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-11.0, 0, 0, 15.5, 0), (50.0, 3.5, 0, 15, 0)]))
EYES = (Eyes("lav", 0.03), Eyes("tfuse", 0.03, blind=(0,)))
STACK = """
from skidpad.core.specs import PointSensorSpec
from skidpad.core.states import VehicleCommand


class Roll:
    def __init__(self, specs, map, settings):
        pass

    def tick(self, frame):
        return VehicleCommand(throttle=0.2)
"""


@dataclass
class Page:
    """What the page says: unit, type and meaning by place and column."""

    places: dict[str, dict[str, tuple[str, str, str]]] = field(default_factory=dict)

    def add(self, line: str) -> None:
        """Takes over a line of the page."""
        if line.startswith("### "):
            self.places[line[4:]] = {}
        elif row := re.match(r"\| `(.+?)` \| (.*?) \| (.*?) \| (.*) \|$", line):
            list(self.places.values())[-1][row[1]] = (row[2], row[3], row[4])


@pytest.fixture(scope="module")
def page() -> Page:
    found = Page()
    text, _, _ = files_page().partition("## Other files")
    for line in text.splitlines():
        found.add(line)
    return found


def here(jobs):
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    """A campaign, a played scenario, a campaign of friction, one of channels, and a monitored drive."""
    out = tmp_path_factory.mktemp("files")
    (out / "roll.py").write_text(STACK)
    call = (
        "adas", "--stack", f"{out / 'roll.py'}:Roll", "--map", "straight", "--vehicles", "0", "--sensors",
        "objects", "--weather", "clear-noon", "--seeds", "2", "--duration", "1", "--workers", "1",
        "--govern", "envelope", "--csv", "--out", str(out / "adas"),
    )  # fmt: skip
    done = CliRunner().invoke(app, call, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    short = scenario_run(FOLDER / "lead_slowdown.xosc", duration=1.0)
    run_to(short, out / "play")
    write_play_report(out / "play")
    Campaign(grip.recipe(), [short]).run(out / "grip", here)
    Campaign(channels.RECIPE, [segment_run(duration=1.0)]).run(out / "channels", here)
    ticks = iter(range(0, 10**12, 1_000_000))
    watch(drive(WORLD, EYES, 12.0), out / "monitor", MonitorSettings(), Timer(lambda: next(ticks)))
    return out


PLACES = (
    ("*/runs/*/ticks.parquet", "RUN/ticks.parquet"),
    ("play/ticks.parquet", "RUN/ticks.parquet"),
    ("*/runs/*/readings.parquet", "RUN/readings.parquet"),
    ("adas/results.*", "OUT/results.parquet of `skidpad adas`"),
    ("adas/timing.*", "OUT/timing.parquet of `skidpad adas`"),
    ("grip/results.*", "OUT/results.parquet of `skidpad grip`, and `skidpad play` of a folder"),
    ("grip/timing.*", "OUT/timing.parquet of `skidpad grip`, and `skidpad play` of a folder"),
    ("grip/series/*/*", "OUT/series/CELL/SEED.parquet"),
    ("grip/stopping.parquet", "OUT/stopping.parquet"),
    ("channels/results.*", "OUT/results.parquet of `skidpad channels drive`"),
    ("channels/timing.*", "OUT/timing.parquet of `skidpad channels drive`"),
    ("monitor/indicators.parquet", "OUT/indicators.parquet"),
    ("monitor/timing.parquet", "OUT/timing.parquet of `skidpad monitor --timing`"),
    ("monitor/hazards.jsonl", "OUT/hazards.jsonl"),
    ("*/ledger.jsonl", "OUT/ledger.jsonl"),
    ("**/pairs.csv", "RUN/pairs.csv"),
    ("**/trajectories.csv", "RUN/trajectories.csv"),
    ("**/storyboard.csv", "RUN/storyboard.csv"),
    ("play/results.csv", "OUT/results.csv"),
)


def columns_of(path: Path) -> dict[str, str]:
    """Returns the columns of a file with their types; "" where the file does not say it."""
    if path.suffix == ".parquet":
        schema = pl.read_parquet_schema(path)
        known = {n: str(t).split("(")[0] for n, t in schema.items()}
        if path.name == "readings.parquet":
            added = {t for n, t in known.items() if n != "tick"}
            assert added == {"Float64"}
            return {"tick": known["tick"], ADDED: "Float64"}
        return known
    lines = path.read_text(encoding="utf-8").splitlines()
    if path.suffix == ".csv":
        return dict.fromkeys(next(csv.reader(lines)), "")
    row = json.decode(lines[0])
    row.pop("sum", None)  # of the line, in a ledger
    return dict.fromkeys(row, "")


def test_columns_of_fresh_files_are_those_of_the_page(page: Page, written: Path) -> None:
    seen = set()
    for pattern, place in PLACES:
        files = sorted(written.glob(pattern))
        assert files, pattern
        for file in files:
            columns = columns_of(file)
            assert set(columns) == set(page.places[place]), file.name
            for name, dtype in columns.items():
                assert not dtype or page.places[place][name][1] == dtype, (file.name, name)
        seen.update(files)
    tables = {p for ending in ("parquet", "csv", "jsonl") for p in written.rglob(f"*.{ending}")}
    assert {p.name for p in tables - seen} <= {"events.jsonl"}


def test_lines_of_events_have_the_keys_of_the_page(page: Page) -> None:
    events = (
        LightChange(0, 4, LightState.RED),
        ContactEvent(3, 1, "", 100.0, 2.0, 5.0, 6.0),
        Relocation(4, RelocationReason.STUCK, 2.0, Pose(0.0, 0.0), Pose(1.0, 0.0)),
        Notice(5, NoticeSource.STACK, "it failed"),
        PutBack(6, 2),
    )
    for line in encode_events(events).splitlines():
        event = json.decode(line)
        kind = event.pop("event")
        assert set(event) == set(page.places[f'RUN/events.jsonl, "event": "{kind}"'])


def test_every_column_has_a_meaning_without_ids(page: Page) -> None:
    assert len(page.places) == sum(len(list(entries())) for _, entries in PARTS.values())
    for place, columns in page.places.items():
        assert columns, place
        for name, (_, _, meaning) in columns.items():
            assert len(meaning) > 2, f"{place}: {name}"
            assert not re.search(r"\b[A-Z]{1,2}-\d", meaning), f"{place}: {name}"
