"""The evaluation of the channels as one command, and the tables that are made of its results."""

from __future__ import annotations

import json

import numpy as np
import pytest

import channels_campaign as campaign
import channels_tables as tables
from skidpad.evidence.channels.judging.evaluation import Evaluation
from skidpad.evidence.channels.judging.segments import judge
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive

EYES = (Eyes("a", 0.02), Eyes("b", 0.02, blind=(0,)))


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A folder as a campaign leaves it, of two drives."""
    out = tmp_path_factory.mktemp("campaign")
    segments = []
    for stratum in ("natural", "risky"):
        world = World((0, 0, 0, 15.0, 0), np.array([(-10.5, 0, 0, 15.7, 0)]))
        source = drive(world, EYES, 8.0)
        context = {"stratum": stratum, "weights": json.dumps({"0": [0.25, 1.0]}), "seed": "1"}
        segments.append(
            judge("s", "route-1", source.channels, list(cycles(source)), context=context)
        )
    table = Evaluation(segments).as_dict() | {"model": None}
    for name in campaign.JUDGED:
        (out / name).mkdir()
        (out / name / "evaluation.json").write_text(json.dumps(table, allow_nan=False))
    return out


@pytest.fixture
def published(driven, tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text("By hand.\n<!-- table: missed -->\nold\n<!-- end -->\nBy hand too.\n")
    monkeypatch.setattr(tables, "PAGES", (page,))
    monkeypatch.setattr(tables, "RESULTS", tmp_path / "results")
    for part in (campaign.HAZARDS, campaign.REDUNDANCY):
        campaign.publish(driven, 1.0, tmp_path / "results", part)
    return tmp_path / "results"


def test_the_committed_pages_are_what_is_made_of_the_committed_results():
    assert tables.main(["--check"]) == 0


def test_every_table_has_its_place_on_one_page():
    places = [m[2] for page in tables.PAGES for m in tables.SLOT.finditer(page.read_text())]
    assert sorted(places) == sorted(tables.TABLES)


@pytest.mark.req("C-210", "C-2")
def test_a_page_is_filled_and_what_is_written_by_hand_stays(published):
    (page,) = tables.PAGES
    text = page.read_text()
    assert text.startswith("By hand.\n")
    assert text.endswith("<!-- end -->\nBy hand too.\n")
    (row,) = [x for x in text.splitlines() if x.startswith("| tracked | ego tailgated")]
    assert row == "| tracked | ego tailgated | 1 | 1 | 100.0 [2.5, 100.0] | 1, too few |"
    assert tables.main(["--check"]) == 0
    page.write_text(text.replace("| 1 | 1 |", "| 1 | 2 |"))
    assert tables.main(["--check"]) == 1


def test_every_table_says_what_it_holds(published):
    said = {name: make(published) for name, make in tables.TABLES.items()}
    assert "0.00 h among natural drivers (1 segment)" in said["driven"]
    assert "seeds from 6300000" in said["driven"]
    assert "| tracked | ego tailgated | 1 | 0 | 0 | 100.0 " in said["scores"]
    assert "| natural | tracked | ego tailgated |" in said["curves"]
    assert said["redundancy"] == "Not driven.\n"


def test_without_results_a_page_stays_as_it_is(tmp_path):
    assert tables.filled("<!-- table: missed -->\nold\n<!-- end -->", tmp_path).count("old") == 1


@pytest.mark.req("C-210")
def test_parts_share_no_seed_and_are_driven_in_every_condition_and_stratum(monkeypatch, tmp_path):
    calls, hours_of_rules = [], []
    monkeypatch.setattr(campaign, "_skidpad", lambda *words: calls.append([*map(str, words)]))
    drive_rules = lambda out, parts, workers, stop: bool(hours_of_rules.extend(parts))  # noqa: E731
    monkeypatch.setattr(campaign.monitor_drives, "drive", drive_rules)
    code = campaign.main(["--out", str(tmp_path), "--hours", "10", "--workers", "1"])
    assert code == campaign.UNFINISHED  # of the rules nothing was driven
    assert sum(part.hours for part in hours_of_rules) == pytest.approx(10.0)
    drives = [c for c in calls if c[:2] == ["channels", "drive"]]
    seeds = {c[c.index("--seed") + 1] for c in drives}
    assert len(seeds) == 5
    assert len(drives) == 4 + 3
    told = [[c[c.index(w) + 1] for w in ("--conditions", "--strata")] for c in drives[:4]]
    assert told[:2] == 2 * [["own,day,night,rain,ice", "natural,risky"]]
    assert told[2:] == [["own,day,night,rain", "natural,risky"], ["ice", "natural"]]
    hours = [float(c[c.index("--hours") + 1]) for c in drives]
    assert sum(hours[:4]) == pytest.approx(10.0)
    assert hours[4:] == 3 * [campaign.HOURS_EACH]
    assert all("--resume" in c for c in drives)
    order = [c[1] for c in calls]
    assert order.index("train") < order.index("evaluate")


@pytest.mark.req("C-210")
def test_one_of_the_two_parts_can_be_driven_and_published_alone(monkeypatch, tmp_path, published):
    calls = []
    monkeypatch.setattr(campaign, "_skidpad", lambda *words: calls.append([*map(str, words)]))
    asked = ["--out", str(tmp_path), "--workers", "1", "--only"]
    campaign.main([*asked, "redundancy"])
    assert [c[c.index("--drive-by") + 1] for c in calls] == list(campaign.DRIVERS)
    before = (published / "run.json").read_bytes()
    campaign.publish(tmp_path, 1.0, published, only="redundancy")
    assert (published / "run.json").read_bytes() == before
    assert json.loads((published / "redundancy.json").read_text())["first_seed"] == 6500000
    calls.clear()
    campaign.main([*asked, "hazards"])
    assert not any("--drive-by" in c for c in calls)


def test_hours_registered_for_one_variant_are_driven_whole_and_have_a_table_of_their_own(
    monkeypatch, tmp_path
):
    driven = []
    drive = lambda out, parts, workers, stop: driven.append((out, parts)) or True  # noqa: E731
    monkeypatch.setattr(campaign.monitor_drives, "drive", drive)
    asked = ["--out", str(tmp_path), "--only", "rules", "--table", "further", "--hours", "50"]
    assert campaign.main(asked) == 0
    ((folder, parts),) = driven
    assert folder == tmp_path / "further"
    assert [p.hours for p in parts] == [2.0, 2.0, 2.0]
    results = tmp_path / "results"
    monkeypatch.setattr(campaign.monitor_drives, "read_rows", lambda file: [file.parent.name])
    monkeypatch.setattr(campaign.monitor_drives, "summary", lambda parts, rows: {"rows": rows})
    monkeypatch.setattr(tables, "main", lambda words: 0)
    campaign.publish(tmp_path, 50.0, results, only="rules", table="further")
    assert json.loads((results / "further.json").read_text())["rows"] == ["further"]
    assert not (results / "ways.json").exists()


def test_tables_of_rules_do_not_overwrite_those_of_hazards(monkeypatch, driven, tmp_path):
    monkeypatch.setattr(campaign.monitor_drives, "summary", lambda parts, rows: {"rows": 1})
    monkeypatch.setattr(campaign.monitor_drives, "ways", lambda parts, rows: {})
    monkeypatch.setattr(tables, "main", lambda words: 0)
    campaign.publish(driven, 1.0, tmp_path)
    assert json.loads((tmp_path / "rules.json").read_text())["rows"] == 1
    assert "strata" in json.loads((tmp_path / "ice.json").read_text())
