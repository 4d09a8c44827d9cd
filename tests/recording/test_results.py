from __future__ import annotations

import dataclasses
import os
import re
import signal
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from skidpad.core.errors import FileError, OutputError
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign import ledger as ledger_module
from skidpad.recording.campaign.added_metrics import METRICS_FILE, read_added_metrics
from skidpad.recording.campaign.ledger import (
    CAMPAIGN,
    LEDGER,
    Entry,
    FolderState,
    Ledger,
    campaign_command,
    common_configuration,
    encode_identity,
    fingerprints,
    folder_state,
    latest,
    read_ledger,
)
from skidpad.recording.campaign.matrix import MATRIX, MatrixEntry, Metrics, RunKey
from skidpad.recording.campaign.results import Timing, definitions_of, read_results
from skidpad.recording.fingerprint import comparison_text, fingerprint, reach_text

IDENTITY = {"configs": [0, 1], "seeds": 2}


def key(config: str = "1", seed: int = 0, **changes: Any) -> RunKey:
    values: dict[str, Any] = {
        "config": config,
        "weather": "rain-noon",
        "precipitation_kind": "rain",
        "time_of_day": "noon",
        "seed": seed,
        "profile": "recommended",
        "map": "figure8",
        "sensors": "pixels",
        "grip": "physical",
        "range": "physical",
        "outcome": "completed",
    }
    return RunKey(**{**values, **changes})


def entry(run: str, outcome: Outcome = Outcome.COMPLETED, collisions: int = 2) -> MatrixEntry:
    timing = Timing(wall_s=9.0, cpu_s=8.0, rtf=50.0)
    return Entry(
        run=run,
        key=key(outcome=outcome.value),
        metrics=Metrics(fatal_collisions=collisions, min_ttc_s=0.25),
        timing=timing,
        fingerprint="abc",
    )


@pytest.mark.req("A-252")
def test_results_keep_the_published_names_and_units() -> None:
    names = set(MATRIX.table([]).columns)
    assert names >= {
        "config", "weather", "precipitation_kind", "time_of_day", "seed", "profile",
        "fatal_collisions", "collisions_vehicle", "collisions_static", "wrong_way",
        "lane_invasions", "min_ttc_s", "radar_fpr_pct", "radar_fnr_pct", "mean_error_m",
        "max_error_m", "headway_variance_m2", "dropout_pct", "mean_speed_kmh", "max_speed_kmh",
        "lateral_mean_m", "lateral_max_m", "lateral_std_m", "samples", "tp", "fp", "tn", "fn",
        "contacts", "rear_ended", "distance_km", "gap_variance_m2", "radar_fpr_pct_pre",
        "radar_fpr_pct_final", "min_ttc_true_s", "max_drac_true", "min_gap_true_m",
    }  # fmt: skip


@pytest.mark.req("A-255")
def test_variances_are_in_square_metres() -> None:
    names = [name for name, _, _ in definitions_of(Metrics) if "variance" in name]
    assert names
    assert all(name.endswith("_m2") for name in names)


def test_rows_come_back_sorted_and_null_stays_null(tmp_path: Path) -> None:
    rows = [(key("2", 1), Metrics(fatal_collisions=3)), (key("1", 5), Metrics(min_ttc_s=0.5))]
    written = MATRIX.write(tmp_path, rows, csv=True)
    table = read_results(tmp_path)
    assert table["config"].to_list() == ["1", "2"]
    assert table["min_ttc_s"].to_list() == [0.5, None]
    assert written == MATRIX.hash(table) == MATRIX.hash(table.reverse())
    assert pl.read_csv(tmp_path / "results.csv")["fatal_collisions"].to_list() == [None, 3]


@pytest.mark.req("A-261")
def test_wall_times_do_not_touch_the_hash(tmp_path: Path) -> None:
    rows = [(key(), Metrics(fatal_collisions=3))]
    slow = Timing(wall_s=506.22, cpu_s=8.0, rtf=0.99)
    fast = dataclasses.replace(slow, wall_s=5.0)
    assert MATRIX.write(tmp_path, rows, [slow]) == MATRIX.write(tmp_path, rows, [fast])
    assert pl.read_parquet(tmp_path / "timing.parquet")["wall_s"].to_list() == [5.0]


def test_every_metric_says_what_it_means() -> None:
    assert all(meaning and source for _, meaning, source in definitions_of(Metrics))


def test_a_second_start_needs_resume_and_then_knows_what_is_done(tmp_path: Path) -> None:
    with Ledger(tmp_path / "out", MatrixEntry, IDENTITY) as ledger:
        ledger.append(entry("1-rain-noon-0"))
        ledger.append(entry("1-rain-noon-1", Outcome.TIMEOUT))
    with pytest.raises(OutputError, match="--resume"):
        Ledger(tmp_path / "out", MatrixEntry, IDENTITY)
    with Ledger(tmp_path / "out", MatrixEntry, IDENTITY, resume=True) as ledger:
        assert ledger.completed_runs() == {"1-rain-noon-0"}
        ledger.append(entry("1-rain-noon-1", collisions=7))
        assert ledger.completed_runs() == {"1-rain-noon-0", "1-rain-noon-1"}
    assert [
        e.metrics.fatal_collisions for e in latest(read_ledger(tmp_path / "out", MatrixEntry))
    ] == [2, 7]
    assert read_ledger(tmp_path / "out", MatrixEntry)[0] == entry("1-rain-noon-0")


def test_a_foreign_folder_is_never_touched(tmp_path: Path) -> None:
    (tmp_path / "thesis.doc").write_text("years of work")
    for resume in (False, True):
        with pytest.raises(OutputError, match="something else"):
            Ledger(tmp_path, MatrixEntry, IDENTITY, resume=resume)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.doc"]
    other = tmp_path / "out"
    Ledger(other, MatrixEntry, IDENTITY).close()
    with pytest.raises(OutputError, match="something else"):
        Ledger(other, MatrixEntry, {"configs": [4]}, resume=True)


def test_two_writers_are_refused(tmp_path: Path) -> None:
    with Ledger(tmp_path / "out", MatrixEntry, IDENTITY) as ledger:
        with pytest.raises(OutputError, match="another process"):
            Ledger(tmp_path / "out", MatrixEntry, IDENTITY, resume=True)
        ledger.append(entry("a"))
    with Ledger(tmp_path / "out", MatrixEntry, IDENTITY, resume=True) as again:
        assert again.completed_runs() == {"a"}


@pytest.mark.parametrize("kept", [1, 20, 200])
def test_a_torn_last_line_costs_that_line_only(tmp_path: Path, kept: int) -> None:
    with Ledger(tmp_path, MatrixEntry, IDENTITY) as ledger:
        ledger.append(entry("a"))
        ledger.append(entry("b"))
    path = tmp_path / LEDGER
    first = path.read_bytes().index(b"\n") + 1
    os.truncate(path, first + kept)
    with Ledger(tmp_path, MatrixEntry, IDENTITY, resume=True) as ledger:
        assert ledger.completed_runs() == {"a"}
        ledger.append(entry("b"))
    assert [e.run for e in read_ledger(tmp_path, MatrixEntry)] == ["a", "b"]


def test_damage_inside_the_ledger_is_named(tmp_path: Path) -> None:
    with Ledger(tmp_path, MatrixEntry, IDENTITY) as ledger:
        ledger.append(entry("a"))
    path = tmp_path / LEDGER
    path.write_bytes(b"garbage\n" + path.read_bytes())
    with pytest.raises(FileError, match="line 1"):
        read_ledger(tmp_path, MatrixEntry)


def test_a_full_disk_loses_no_earlier_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Ledger(tmp_path, MatrixEntry, IDENTITY) as ledger:
        ledger.append(entry("a"))
        whole = os.write
        monkeypatch.setattr(ledger_module.os, "write", lambda file, line: whole(file, line[:10]))
        with pytest.raises(OutputError, match="disk is full"):
            ledger.append(entry("b"))
        monkeypatch.setattr(ledger_module.os, "write", whole)
        assert ledger.completed_runs() == {"a"}
        ledger.append(entry("c"))
    assert [e.run for e in read_ledger(tmp_path, MatrixEntry)] == ["a", "c"]


@pytest.mark.skipif(os.name == "nt", reason="kill -9")
def test_what_was_appended_survives_kill_9(tmp_path: Path) -> None:
    script = textwrap.dedent(f"""
        import os, signal, sys
        sys.path.insert(0, {str(Path(__file__).parent)!r})
        from pathlib import Path
        from test_results import IDENTITY, MatrixEntry, entry
        from skidpad.recording.campaign.ledger import Ledger
        ledger = Ledger(Path({str(tmp_path / "out")!r}), MatrixEntry, IDENTITY)
        ledger.append(entry("a"))
        os.kill(os.getpid(), signal.SIGKILL)
    """)
    done = subprocess.run([sys.executable, "-c", script], check=False)
    assert done.returncode == -signal.SIGKILL
    with Ledger(tmp_path / "out", MatrixEntry, IDENTITY, resume=True) as ledger:
        assert ledger.completed_runs() == {"a"}


def test_folder_state(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert folder_state(out, IDENTITY) is FolderState.EMPTY
    out.mkdir()
    (out / LEDGER).touch()
    assert folder_state(out, IDENTITY) is FolderState.EMPTY
    Ledger(out, MatrixEntry, IDENTITY).close()
    assert folder_state(out, IDENTITY) is FolderState.SAME
    assert folder_state(out, {}) is FolderState.OTHER


def test_fingerprint_is_stable_and_sees_every_part() -> None:
    here = fingerprint()
    assert here == fingerprint()
    changed = {dataclasses.replace(here, **{f.name: "?"}).short for f in dataclasses.fields(here)}
    assert len(changed | {here.short}) == 8
    assert fingerprints([entry("a"), entry("b")]) == {"abc"}


@pytest.mark.req("X-1", "X-2")
def test_rows_say_where_they_were_driven_and_the_hash_does_not_depend_on_it(tmp_path: Path) -> None:
    keys = [dataclasses.replace(entry("a").key, seed=seed) for seed in (3, 1, 2)]
    rows = [(key, entry("a").metrics) for key in keys]
    plain = MATRIX.write(tmp_path / "a", rows)
    placed = MATRIX.write(tmp_path / "b", rows, fingerprints=["x3", "x1", "x2"])
    table = read_results(tmp_path / "b", MATRIX)
    assert dict(zip(table["seed"], table["fingerprint"], strict=True)) == {
        1: "x1",
        2: "x2",
        3: "x3",
    }
    assert placed == plain == MATRIX.hash(table)


@pytest.mark.req("X-2")
def test_a_reader_is_told_whether_hashes_may_be_compared() -> None:
    assert comparison_text({"a"}, {"a"}).startswith("hashes may be compared")
    for a, b in (({"a"}, {"b"}), ({"a", "b"}, {"a"}), (set(), {"a"}), ({"a"}, set())):
        assert comparison_text(a, b).startswith("hashes may not be compared")


@pytest.mark.req("X-2")
@pytest.mark.parametrize(
    ("places", "told"),
    [
        (["x"], "may be compared with .* alone: fingerprint x"),
        (["y", "x"], "may not be compared with another: .* several fingerprints, x and y"),
        ([], "may not be compared with another: its fingerprint was not recorded"),
    ],
)
def test_with_what_a_hash_may_be_compared_is_one_sentence(places: list[str], told: str) -> None:
    assert re.fullmatch(rf"Its hash {told}\.", reach_text(places))


def test_a_folder_says_which_command_wrote_it(tmp_path):
    assert campaign_command(tmp_path) == "adas"
    (tmp_path / CAMPAIGN).write_bytes(encode_identity({"command": "grip"}))
    assert campaign_command(tmp_path) == "grip"
    (tmp_path / CAMPAIGN).write_text("{")
    with pytest.raises(FileError, match="damaged"):
        campaign_command(tmp_path)


def test_what_all_runs_have_in_common_is_found(tmp_path):
    assert common_configuration(tmp_path) == {}
    identity = {"command": "adas", "runs": 2, "common": {"a": 1}}
    (tmp_path / CAMPAIGN).write_bytes(encode_identity(identity))
    assert common_configuration(tmp_path) == {"a": 1}


def test_an_unfinished_campaign_says_how_to_finish_it(tmp_path):
    (tmp_path / "ledger.jsonl").touch()
    with pytest.raises(FileError, match="not finished: finish it with --resume"):
        read_results(tmp_path)


def test_a_file_of_metrics_beyond_its_limit_is_named_once(tmp_path):
    (tmp_path / METRICS_FILE).write_text("[" + " " * 2**20 + "]")
    with pytest.raises(FileError, match="larger than 1048576 bytes") as told:
        read_added_metrics(tmp_path)
    assert str(told.value).count(METRICS_FILE) == 1
