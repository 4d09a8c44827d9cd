"""The commands that read channel recordings: what they write, print, and how they fail."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import numpy as np
import polars as pl
import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.cli.main import app, main
from skidpad.core.channels import Context
from skidpad.core.errors import ConfigError
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.timing import time_by_objects, timing_statistics
from skidpad.recording.channels.mcap_files import ChannelWriter
from skidpad.recording.hazards.records import read_hazards
from support.channel_worlds import Eyes, World, drive

runner = CliRunner(env={"COLUMNS": "200"})
WORLD = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-11.0, 0, 0, 15.5, 0), (50.0, 3.5, 0, 15, 0)]))
EYES = (Eyes("lav", 0.03), Eyes("tfuse", 0.03, blind=(0,)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    source = drive(WORLD, EYES, 12.0)
    with ChannelWriter(folder / "one.mcap", source.channels) as writer:
        writer.add(Context(0.0, {"route": "ring"}))
        for channel, item in source.rows:
            writer.add(item, channel)
    return folder


@pytest.fixture(scope="module")
def monitored(folder):
    done = runner.invoke(app, ["monitor", str(folder / "one.mcap"), "--out", str(folder / "out")])
    assert done.exit_code == 0, done.output
    return folder / "out"


def invoke(*args):
    return runner.invoke(app, [str(a) for a in args], catch_exceptions=False)


def failing(monkeypatch, capsys, *args):
    monkeypatch.setattr(sys, "argv", ["skidpad", *map(str, args)])
    with pytest.raises(SystemExit) as stop:
        main()
    return stop.value.code, capsys.readouterr().err


@pytest.mark.req("C-032", "C-213")
def test_monitor_writes_every_indicator_of_every_cycle(monitored):
    table = pl.read_parquet(monitored / "indicators.parquet")
    assert table.columns == [
        "cycle", "t", "subject", "indicator", "value", "evaluated", "threshold", "violated", "claim"
    ]  # fmt: skip
    assert set(table["indicator"]) == {i.value for i in Indicator}
    assert table["cycle"].n_unique() == 121
    assert table.filter(pl.col("evaluated") == pl.col("value").is_null()).is_empty()
    low = table.filter(pl.col("threshold").is_not_null() & pl.col("evaluated"))
    variance = Indicator.EGO_LOCATION_VARIANCE.value
    expected = (
        pl.when(pl.col("indicator") == variance)
        .then(pl.col("value") > pl.col("threshold"))
        .otherwise(pl.col("value") < pl.col("threshold"))
    )
    assert low.filter(expected != pl.col("violated")).is_empty()
    scores = table.filter(pl.col("claim").is_not_null() & pl.col("evaluated"))
    scores = scores.filter(~pl.col("indicator").str.contains("variance|shift|left"))
    assert scores["value"].is_between(0.0, 1.0).all()
    summary = json.loads((monitored / "monitor.json").read_text())
    found = ["ego_tailgated", "unseen_by_a_channel"]  # one channel is blind to the rear
    assert [h["name"] for h in summary["hazards"]] == found
    assert summary["rules"] == "tracked"


@pytest.mark.req("C-009")
def test_hazards_are_listed_shown_and_exported(monitored):
    """From unknown to known: what was met becomes a scenario that can be tested again."""
    assert "ego_tailgated" in invoke("hazards", "list", monitored).output
    shown = json.loads(invoke("hazards", "show", monitored, "--id", "h0001").output)
    assert shown["context"] == {"route": "ring"}
    done = invoke("hazards", "export", monitored, "--osc", "1.0", "--world", "lav")
    assert done.exit_code == 0
    scenario = next((monitored / "scenarios").glob("*.xosc"))
    assert etree.parse(str(scenario)).getroot().find("FileHeader").get("revMinor") == "0"
    assert [h.type.value for h in read_hazards(monitored)] == [
        "ego_tailgated",
        "unseen_by_a_channel",
    ]


@pytest.mark.req("C-033", "C-034")
def test_the_safety_case_prints_evidence_for_every_statement(monitored):
    output = invoke("safety-case", monitored).output
    assert re.findall(r"\b(S\d+) ", output) == [f"S{k}" for k in range(1, 11)]
    assert "challenged" in output or "supported" in output
    assert "not evaluated in" in output


@pytest.mark.req("C-105", "C-214")
def test_evaluate_and_compare(folder, monitored):
    done = invoke("channels", "evaluate", folder, "--curve", "gap_signed")
    assert done.exit_code == 0
    table = json.loads((folder / "evaluation.json").read_text())
    (row,) = [
        r for r in table["results"]
        if (r["rules"], r["truth"], r["tolerance_s"]) == ("practical", "sim", 1.0)
    ]  # fmt: skip
    assert row["hazards"]["ego_tailgated"]["recall"] == 1.0
    assert list(table["by_route"]["practical/sim"]) == ["ring"]
    curve = table["curve"]["sim"]
    assert curve["1.0"]["ego_tailgated"] == [1, 0, 0]
    assert curve["2.0"]["ego_tailgated"] == [0, 0, 1]  # one unseen vehicle gives at most 0.5
    kept = folder / "one.judged"
    first = kept.stat().st_mtime_ns
    again = invoke("channels", "evaluate", folder, "--curve", "gap_signed", "--model", "bundled")
    assert again.exit_code == 0
    assert kept.stat().st_mtime_ns == first  # judged once
    table = json.loads((folder / "evaluation.json").read_text())
    assert {r["rules"] for r in table["results"]} >= {"practical", "learned on world truth"}
    assert table["model"]["hours"] > 1.0
    done = invoke("channels", "compare", monitored, monitored)
    assert "ego_location_similarity (lav+tfuse): +0.0000" in done.output


def test_info_says_what_a_recording_holds_and_what_it_lost(folder, tmp_path):
    output = invoke("channels", "info", folder / "one.mcap").output
    assert "/channels/lav (skidpad.Channel): 121 messages" in output
    cut = tmp_path / "cut.mcap"
    whole = (folder / "one.mcap").read_bytes()
    cut.write_bytes(whole[: int(0.6 * len(whole))])
    done = invoke("channels", "info", cut)
    assert done.exit_code == 0
    assert "cut short" in done.output


@pytest.mark.req("C-232", "C-233", "C-234", "C-237", "C-238")
def test_timing_gives_the_table_and_the_total_is_the_sum_of_its_parts(folder, tmp_path):
    done = invoke("monitor", folder / "one.mcap", "--out", tmp_path, "--timing")
    assert "motion_prediction" in done.output
    told = done.output.splitlines()
    assert [line for line in told if len(line) > 80 and not line.startswith("Next: ")] == []
    assert told[-1].startswith("Next: "), "the answer and the next command come last"
    heads = told[told.index("times per cycle, ms, and shares of cycles, %") + 1].split("  ")
    assert [h.strip() for h in heads if h.strip()][:3] == ["module", "mean", "most"]
    t = pl.read_parquet(tmp_path / "timing.parquet")
    parts = ["prepare", "comfort", "similarity", "motion_prediction", "risk", "hazards"]
    assert t["total"].to_list() == pytest.approx(t.select(pl.sum_horizontal(parts)).to_series())
    assert t["objects"].to_list() == [3] * 121
    table = timing_statistics(t)
    means = dict(zip(table["module"], table["mean_ms"], strict=True))
    assert means["total"] == pytest.approx(sum(means[p] for p in parts))
    by_objects = time_by_objects(t)
    assert by_objects["cycles"].to_list() == [121]
    assert by_objects["total"][0] == pytest.approx(means["total"])


@pytest.mark.req("C-233", "C-234")
def test_shares_of_the_timing_table_by_hand():
    total = [1.0, 12.4, 12.5, 22.5, 25.0, 26.0, 2.0, 3.0, 4.0, 5.0]
    names = ["prepare", "comfort", "similarity", "motion_prediction", "risk", "hazards", "writing"]
    row = timing_statistics(pl.DataFrame({"total": total} | dict.fromkeys(names, total)))
    first, second = row.row(0, named=True), row.row(1, named=True)
    assert (first["breaches_pct"], first["within_90_pct"], first["under_50_pct"]) == (10, 20, 60)
    assert (second["breaches_pct"], second["within_90_pct"]) == (0.0, 20.0)  # of its own maximum


def test_gates_exit_with_1_and_write_junit(folder, tmp_path):
    junit = tmp_path / "verdict.xml"
    args = ["monitor", folder / "one.mcap", "--out", tmp_path, "--junit", junit]
    done = invoke(*args, "--fail-if", "ego_tailgated", "--fail-if", "ELSS")
    assert done.exit_code == 1
    suite = etree.parse(str(junit)).getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    assert [c.get("name") for c in suite if c.find("failure") is not None] == ["ego_tailgated"]
    assert invoke(*args, "--fail-if", "ELSS").exit_code == 0


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("monitor", "missing.mcap", "--out", "o"), "missing.mcap: no such file"),
        (("monitor", ".", "--out", "o"), "--mapping"),
        (("hazards", "list", "nowhere"), "skidpad monitor"),
        (("safety-case", "nowhere"), "no file nowhere"),
        (("channels", "evaluate", "nowhere"), "holds no .mcap"),
        (("channels", "info", "text.mcap"), "is not an MCAP file"),
    ],
)
def test_unusable_input_is_one_sentence_and_exit_code_2(monkeypatch, capsys, tmp_path, args, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.mcap").write_text("hello, this is no recording")
    code, error = failing(monkeypatch, capsys, *args)
    assert code == 2
    assert words in error
    assert error.count("\n") == 1


def test_a_gate_on_an_unknown_name_lists_the_known_ones(monkeypatch, capsys, folder, tmp_path):
    code, error = failing(
        monkeypatch, capsys, "monitor", folder / "one.mcap", "--out", tmp_path, "--fail-if", "speed"
    )
    assert code == 2
    assert "ego_tailgated" in error
    assert "ELSS" in error


def test_help_does_not_load_numba():
    text = "import sys; from skidpad.cli.main import app; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.req("C-15")
def test_the_bundled_model_judges_a_recording(folder, tmp_path):
    args = ["monitor", folder / "one.mcap", "--out", tmp_path / "out", "--identifier", "learned"]
    assert invoke(*args).exit_code == 0
    assert json.loads((tmp_path / "out" / "monitor.json").read_text())["identifier"] == "learned"
    done = runner.invoke(app, [str(a) for a in (*args, "--model", tmp_path / "none.npz")])
    assert "none.npz: cannot be read" in str(done.exception)


def test_outcomes_of_a_folder_without_drives_are_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "other.json").write_text("{}")
    code, said = failing(monkeypatch, capsys, "channels", "outcomes", tmp_path)
    assert code == 2
    assert f"no driven segments below {tmp_path}" in " ".join(said.split())


@pytest.mark.req("C-001", "C-004")
def test_a_drive_with_its_monitor_says_what_it_found_how_late_and_draws_it(tmp_path):
    out = tmp_path / "driven"
    words = ("--route", "route-4", "--hours", 2.0 / 3600.0, "--workers", 1, "--out", out)
    done = invoke("channels", "drive", *words, "--monitor")
    assert done.exit_code == 0, done.output
    said = done.output.replace("\n", " ")
    assert re.search(
        r"1 segment, 0\.00 h, .* 0 collisions, .* Next: skidpad monitor \S+\.mcap", said
    )
    assert re.search(r"route-4-00000\.monitor: 20 cycles; complete; judged [\d.]+ ms after", said)
    (page,) = out.glob("*/*.monitor/report.html")
    assert "<html" in page.read_text(encoding="utf-8")
    refused = invoke_failing(tmp_path)
    assert refused == {
        "--pin gives the monitor a processor and needs --monitor",
        "unknown --publish 'ros1'; choose one of: ros2, foxglove; did you mean 'ros2'?",
        "--listen needs --mapping FILE, which says which topics are what",
        "monitor takes a FILE or --listen ros2, and one of them",
    }


def invoke_failing(folder):
    """The sentences of commands that ask for what does not go together."""
    calls = (
        ("channels", "drive", "--pin", 0),
        ("channels", "drive", "--publish", "ros1"),
        ("monitor", "--listen", "ros2"),
        ("monitor",),
    )
    sentences = set()
    for call in calls:
        with pytest.raises(ConfigError) as refused:
            invoke(*call, "--out", folder / "never")
        sentences.add(str(refused.value))
    assert not (folder / "never").exists()
    return sentences
