"""Results appear complete or not at all; earlier ones survive bad input (item 2)."""

import hashlib
import os

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.campaign.runs.rerun import Film
from skidpad.cli.main import app
from skidpad.core.errors import ConfigError, OutputError
from skidpad.evidence.channels.monitor import MonitorSettings
from skidpad.live.watch import watch_whole
from skidpad.recording.channels.mcap_files import ChannelWriter
from skidpad.recording.files import write_atomically, write_bytes
from skidpad.recording.folders import ResultKind, prepare_files, require_kind
from support.channel_worlds import Eyes, World, drive

WORLD = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(50.0, 3.5, 0, 15, 0)]))
EYES = (Eyes("left", 0.03), Eyes("right", 0.03))


def record(path, seconds):
    listed = drive(WORLD, EYES, seconds)
    with ChannelWriter(path, listed.channels) as writer:
        for channel, item in listed.rows:
            if channel is not None:
                writer.add(item, channel)
    return path


def content(folder):
    """Hash of every file below a folder, by name."""
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def monitor(file, out):
    return CliRunner().invoke(app, ["monitor", str(file), "--out", str(out)])


def test_monitor_leaves_an_earlier_result_alone_unless_it_has_a_whole_new_one(tmp_path):
    good, other = record(tmp_path / "good.mcap", 3.0), record(tmp_path / "other.mcap", 2.0)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(good.read_bytes()[:60])
    out = tmp_path / "out"
    assert monitor(good, out).exit_code == 0
    before = content(out)
    assert {"monitor.json", "hazards.txt", "indicators.parquet", "report.html"} <= set(before)
    for bad, says in ((cut, "cut.mcap"), (other, "another recording")):
        failed = monitor(bad, out)
        assert isinstance(failed.exception, (OutputError, ValueError))
        assert says in str(failed.exception)
        assert content(out) == before
    assert monitor(good, out).exit_code == 0  # the same recording again
    assert content(out) == before
    empty = tmp_path / "empty"
    assert monitor(cut, empty).exit_code != 0
    assert not empty.exists()


def test_monitor_does_not_mix_its_files_into_another_result(tmp_path):
    good = record(tmp_path / "good.mcap", 2.0)
    (tmp_path / "campaign").mkdir()
    (tmp_path / "campaign" / "campaign.json").write_text("{}")
    with pytest.raises(OutputError, match="holds a campaign"):
        watch_whole(drive(WORLD, EYES, 2.0), tmp_path / "campaign", MonitorSettings())
    assert [p.name for p in (tmp_path / "campaign").iterdir()] == ["campaign.json"]
    failed = monitor(good, good)
    assert isinstance(failed.exception, OutputError)


@pytest.mark.parametrize("kind", ResultKind)
def test_folders_of_one_kind_are_known_by_their_marks(tmp_path, kind):
    from skidpad.recording.folders import MARKS

    (tmp_path / MARKS[kind][0]).touch()
    require_kind(tmp_path, kind)
    for other in set(ResultKind) - {kind}:
        with pytest.raises(OutputError, match=f"holds {kind.value}"):
            require_kind(tmp_path, other)


def on_a_full_disk(folder):
    with prepare_files(folder, ("a", "mark")) as part:
        (part / "a").write_text("second")
        raise OSError(28, os.strerror(28))


def test_files_of_one_result_appear_together_and_stale_ones_go(tmp_path):
    folder = tmp_path / "out"
    with prepare_files(folder, ("a", "b", "mark")) as part:
        for name in ("a", "b", "mark"):
            (part / name).write_text("first")
    with pytest.raises(OutputError, match="disk is full"):
        on_a_full_disk(folder)
    assert {p.name: p.read_text() for p in folder.iterdir()} == dict.fromkeys("ab", "first") | {
        "mark": "first"
    }
    with prepare_files(folder, ("a", "b", "mark")) as part:
        (part / "mark").write_text("third")
    assert {p.name: p.read_text() for p in folder.iterdir()} == {"mark": "third"}


def test_a_file_in_place_of_a_folder_is_one_sentence(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot write"):
        write_bytes(tmp_path / "file" / "x", b"1")
    with pytest.raises(OutputError, match="no memory for it"):
        write_atomically(
            tmp_path / "x", lambda part: (_ for _ in ()).throw(OSError("no memory for it"))
        )
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_film_is_in_place_only_when_it_is_finished(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"earlier")
    film = Film(path)
    film.close()
    assert path.read_bytes() == b"earlier"
    film = Film(path)
    film.finish()
    film.close()
    assert path.read_bytes() != b"earlier"
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]
    with pytest.raises(ConfigError, match=r"\.mp4"):
        Film(tmp_path / "a.avi")


@pytest.mark.parametrize("where", ["no/folder/file/x.png", "x.tiff", "x"])
def test_pictures_that_cannot_be_written_are_one_sentence(tmp_path, where):
    (tmp_path / "no").touch()
    before = content(tmp_path)
    for command in (["map", "info", "figure8", "--png"], ["friction", "--plot"]):
        failed = CliRunner().invoke(app, [*command, str(tmp_path / where)])
        assert isinstance(failed.exception, (ConfigError, OutputError)), failed.exception
    assert content(tmp_path) == before
