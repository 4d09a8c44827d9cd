"""Committed pages are what committed results make, and what is planned cannot change unseen."""

from __future__ import annotations

import json
import re
import shlex
import sys
from pathlib import Path

import click
import polars as pl
import pytest
import typer

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import campaigns  # noqa: E402
import result_tables as tables  # noqa: E402
from skidpad.cli.main import app  # noqa: E402
from skidpad.recording.campaign.matrix import Metrics, RunKey  # noqa: E402
from skidpad.recording.campaign.results import schema  # noqa: E402

PLAN = tables.plan()
COMMANDS = {c["name"]: c["command"] for c in PLAN["campaigns"]}


@pytest.mark.parametrize("page", tables.PAGES)
def test_pages_are_what_the_results_make(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert len(tables.BLOCK.findall(text)) == text.count("<!-- results:")
    assert tables.tables_in(text) == text, "run make tables"


@pytest.mark.req("R-7", "X-7")
def test_no_claim_changes_without_an_entry_in_the_pre_registration():
    assert tables.CLAIMS.read_text(encoding="utf-8") == tables.claims_page(), "run make tables"
    entries = PLAN["later_changes"]
    latest = entries[-1]["claims"] if entries else PLAN["claims"]
    assert latest == tables.claims_hash(), "a change of claims needs an entry in later_changes"
    assert all({"date", "why", "claims"} <= set(entry) for entry in entries)


def seeds_of(command: str) -> range:
    words = shlex.split(command)
    n, first = (int(words[words.index(o) + 1]) for o in ("--seeds", "--first-seed"))
    return range(first, first + n)


@pytest.mark.req("X-8")
def test_no_planned_seed_was_driven_before_and_every_campaign_has_its_own_or_shares_all():
    seen = {
        seed
        for span in PLAN["seeds_seen"]
        for a, _, b in [str(span).partition("-")]
        for seed in range(int(a), int(b or a) + 1)
    }
    for name, command in COMMANDS.items():
        assert not seen & set(seeds_of(command)), name


@pytest.mark.parametrize("name", COMMANDS)
def test_every_planned_command_is_one_that_skidpad_knows(name):
    words = campaigns.words_of(COMMANDS[name], Path("/maps"))
    root = typer.main.get_command(app)
    command = root.commands[words[0]]
    try:
        command.make_context(words[0], [*words[1:], "--out", "x", "--workers", "1"])
    except click.UsageError as error:
        pytest.fail(f"{name}: {error.format_message()}")


def results(tmp_path: Path) -> Path:
    """Eight seeds of configurations 0 and 4: 6 fatal ones each, and 0 to 7; two weathers, one drive."""
    kinds = schema(RunKey) | schema(Metrics)
    rows = [
        dict.fromkeys(kinds)
        | {
            "config": config, "weather": weather, "precipitation_kind": "clear", "seed": seed,
            "outcome": "completed", "log_hash": f"{config}{seed}", "distance_km": 10.0,
            "fatal_collisions": 6 if config == "0" else seed - 1, "crashes_vehicle": 1,
            "road_departures": 0, "fatal_first": 1, "off_lanes_pct": 0.0,
            "mean_speed_kmh": 50.0 + seed,
        }
        for config in ("0", "4")
        for weather in ("clear-noon", "clear-night")
        for seed in range(1, 9)
    ]  # fmt: skip
    folder = tmp_path / "matrix-figure8"
    folder.mkdir()
    pl.DataFrame(rows, schema=kinds).write_parquet(folder / "results.parquet")
    told = {"commit": "abc1234", "date": "2026-11-30", "machine": "two cores"}
    (folder / "driven.json").write_text(json.dumps(told))
    return folder


def test_a_table_is_made_of_the_results_and_says_who_drove_them(tmp_path):
    results(tmp_path)
    page = "a\n<!-- results: matrix-figure8 headline -->\nold\n<!-- end -->\nb\n"
    made = tables.tables_in(page, tmp_path)
    assert made.startswith("a\n<!-- results: matrix-figure8 headline -->\nDriven 2026-11-30")
    assert made.endswith("<!-- end -->\nb\n")
    assert "old" not in made
    rows = {line.split("|")[1].strip()[0]: line for line in made.splitlines() if "·" in line}
    assert "| 8 |" in rows["0"], "two weathers of one drive count once"
    assert re.search(r"\| 6\.00 \[[\d.]+, [\d.]+\] \|", rows["0"])
    assert "| 3.50 [" in rows["4"]
    assert "| 0.00, in 0 of 8 |" in rows["0"]
    assert tables.tables_in(made, tmp_path) == made


def test_rates_are_per_run_and_per_distance(tmp_path):
    text = tables.block("matrix-figure8", "headline", results(tmp_path))
    row = next(line for line in text.splitlines() if line.startswith("| 0"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[-2].startswith("60.00 ["), "six in 10 km"
    assert cells[-1] == "54.5"


def test_factors_have_a_row_per_configuration_and_weather(tmp_path):
    text = tables.block("matrix-figure8", "factors", results(tmp_path))
    rows = [line for line in text.splitlines() if "·" in line]
    assert len(rows) == 4
    assert all("| 8 |" in row and row.endswith("| 54.5 |") for row in rows)


def test_levels_are_paired_by_seed_and_few_seeds_have_no_bound(tmp_path):
    objects = results(tmp_path)
    more = pl.read_parquet(objects / "results.parquet").with_columns(
        fatal_collisions=pl.col("fatal_collisions") + pl.col("seed")
    )
    pixels = tmp_path / "matrix-pixels"
    pixels.mkdir()
    more.write_parquet(pixels / "results.parquet")
    (pixels / "driven.json").write_bytes((objects / "driven.json").read_bytes())
    rows = tables.block("matrix-pixels", "against", pixels).splitlines()
    assert any(row.startswith("| all | interventions | 8 | +4.50 | [") for row in rows)
    assert "| all | crashes with vehicles | 8 | +0.00 | no limits |" in rows
    kept = pixels / "objects"  # of the same commit, where the matrix was driven again
    kept.mkdir()
    more.write_parquet(kept / "results.parquet")
    assert "| all | interventions | 8 | +0.00 | no limits |" in tables.block(
        "matrix-pixels", "against", pixels
    )


def test_a_remedy_is_held_against_the_cells_of_its_own_commit(tmp_path):
    base, matrix, remedy = (
        tmp_path / name for name in ("remedy-none", "matrix-figure8", "remedy-esc")
    )
    results(tmp_path).rename(base)
    for folder, more in ((matrix, 1), (remedy, 3)):
        folder.mkdir()
        rows = pl.read_parquet(base / "results.parquet")
        rows = rows.with_columns(pl.col("fatal_collisions") + more)
        rows.write_parquet(folder / "results.parquet")
        (folder / "driven.json").write_bytes((base / "driven.json").read_bytes())
    text = tables.block("remedy-esc", "against", remedy)
    assert "| minus remedy-none |" in text
    assert "| all | interventions | 8 | +3.00 |" in text
    told = json.loads((base / "driven.json").read_text())
    (base / "driven.json").write_text(json.dumps(told | {"commit": "another"}))
    text = tables.block("remedy-esc", "against", remedy)
    assert "| minus matrix-figure8 |" in text
    assert "| all | interventions | 8 | +2.00 |" in text


def test_claims_are_judged_on_the_results(tmp_path):
    text = tables.block("matrix-figure8", "claims", results(tmp_path))
    rows = {line.split("|")[1].strip(): line for line in text.splitlines() if line.startswith("| ")}
    assert "| contradicted |" in rows["A-276"]
    assert "| not testable |" in rows["F-04"]
    assert "F-18" not in rows, "studies have runs of their own"


def test_what_was_not_driven_says_so_with_its_command(tmp_path):
    text = tables.block("study-coast", "claims", tmp_path / "study-coast")
    assert text == f"Not driven yet: `skidpad {COMMANDS['study-coast']}`\n"


def test_frozen_results_are_left_alone_and_foreign_maps_are_asked_for(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(campaigns, "RESULTS", tmp_path)
    (tmp_path / "grip").mkdir()
    assert campaigns.main(["grip", "matrix-foreign"]) == 0
    told = capsys.readouterr().out
    assert "grip: frozen already" in told
    assert "matrix-foreign: left out, it needs --maps DIR" in told


@pytest.fixture
def left(tmp_path, monkeypatch):
    """What a campaign left, and where it is frozen."""
    monkeypatch.setattr(campaigns, "RESULTS", tmp_path / "results")
    (tmp_path / "results").mkdir()
    folder = tmp_path / "out"
    folder.mkdir()
    for file in campaigns.KEPT:
        (folder / file).write_text("{}")
    return folder


def test_what_a_campaign_left_is_frozen_whole(left, tmp_path):
    campaigns.freeze("grip", left)
    frozen = tmp_path / "results" / "grip"
    assert sorted(p.name for p in frozen.iterdir()) == sorted([*campaigns.KEPT, "driven.json"])
    assert set(json.loads((frozen / "driven.json").read_text())) == {
        "commit", "date", "machine", "fingerprint"
    }  # fmt: skip


def test_a_description_that_only_repeats_the_command_is_left_out(left, tmp_path, monkeypatch):
    monkeypatch.setattr(campaigns, "MOST", 1)
    campaigns.freeze("grip-threshold", left)
    frozen = tmp_path / "results" / "grip-threshold"
    assert sorted(p.name for p in frozen.iterdir()) == ["driven.json", "results.parquet"]
