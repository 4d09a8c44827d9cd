"""`skidpad map` says what a map holds, and refuses what is none."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app, main
from skidpad.roads.bundled import FOLDER, load_map

RUNNER = CliRunner()


def test_list_names_the_bundled_maps() -> None:
    out = RUNNER.invoke(app, ["map", "list"]).output
    assert "figure8" in out
    assert "straight" in out


def test_info_prints_the_grip_that_the_tightest_bend_needs() -> None:
    out = RUNNER.invoke(app, ["map", "info", "figure8"]).output
    row = next(line.split() for line in out.splitlines() if line.split()[3:4] == ["71.8"])
    assert row[4:] == ["60", f"{(80 / 3.6) ** 2 / (71.75 * 9.80665):.2f}", "2.47"]
    assert "warning" not in out
    assert load_map("figure8").content_hash in out


def test_info_warns_of_dead_ends() -> None:
    out = RUNNER.invoke(app, ["map", "info", "straight"]).output
    assert "6 driving lanes lead nowhere" in out


def test_info_names_the_only_road_as_its_file_does(tmp_path: Path) -> None:
    """An id may be a word; the number that stands for it inside is nobody's to read."""
    text = (FOLDER / "straight.xodr").read_text(encoding="utf-8")
    file = tmp_path / "worded.xodr"
    worded = text.replace('id="1" junction', 'id="north" junction')
    file.write_text(worded, encoding="utf-8")
    out = RUNNER.invoke(app, ["map", "info", str(file)]).output
    assert out.splitlines()[2].startswith("1 road, "), out
    assert "driving lanes lead nowhere: road north lane" in out
    assert "road ids: north" in out


def test_bake_writes_a_file_that_loads_as_the_same_map(tmp_path: Path) -> None:
    source = tmp_path / "mine.xodr"
    source.write_bytes((FOLDER / "straight.xodr").read_bytes())
    result = RUNNER.invoke(app, ["map", "bake", str(source)])
    assert result.exit_code == 0
    assert load_map(tmp_path / "mine.npz").content_hash == load_map("straight").content_hash


def test_a_picture_is_written(tmp_path: Path) -> None:
    target = tmp_path / "plan.png"
    assert RUNNER.invoke(app, ["map", "info", "straight", "--png", str(target)]).exit_code == 0
    assert target.read_bytes().startswith(b"\x89PNG")


def test_a_file_that_is_no_map_ends_with_one_sentence_and_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.xodr"
    bad.write_text("<html/>")
    monkeypatch.setattr("sys.argv", ["skidpad", "map", "info", str(bad)])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    assert "not OpenDRIVE" in capsys.readouterr().err
