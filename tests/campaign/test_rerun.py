import re
import shutil
from dataclasses import replace
from functools import partial

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.driving.loop import Sink
from skidpad.campaign.driving.pace import Pace
from skidpad.campaign.recipes.matrix import RECIPE, drive_one
from skidpad.campaign.runs.run import run
from skidpad.campaign.runs.stored import read_run
from skidpad.campaign.runs.views import SIZE, twelve_views
from skidpad.campaign.workers.pool import local
from skidpad.cli.main import app
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.campaign.results import read_results
from support.runs import adas_run


def cell(sensors=SensorLevel.OBJECTS, duration=6.0, **changes):
    named = {"profile": "thesis_text", "settings": {"mu_ref": 0.8}, "seed": 3}
    return adas_run(2, "rain-noon", sensors=sensors, duration=duration, **{**named, **changes})


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    cells = [cell(), cell(SensorLevel.PIXELS, 2.0, seed=4)]
    Campaign(RECIPE, cells).run(folder, local(1))
    return folder


@pytest.mark.req("A-139", "A-260", "A-261")
def test_a_run_can_be_driven_again_from_what_it_left_behind(campaign):
    run = campaign / "runs" / "2_rain-noon-003"
    assert read_run(run) == cell()
    done = CliRunner().invoke(app, ["rerun", str(run), "--from", "1", "--to", "3"])
    assert done.exit_code == 0, done.output
    assert "the same drive" in done.output
    assert re.search(r"^ +1\.00 s  CRUISE \[LCA on\] +NO_TARGET$", done.output, re.MULTILINE)
    assert len(list((run / "rerun").glob("*.png"))) == 40


def test_a_stretch_is_driven_from_the_nearest_checkpoint(campaign, tmp_path):
    run, pictures = tmp_path / "run", []
    shutil.copytree(campaign / "runs" / "2_rain-noon-003", run)
    call = ["rerun", str(run), "--from", "3", "--to", "4"]
    for more in ([], ["--checkpoints", "1.5"], []):
        shutil.rmtree(run / "rerun", ignore_errors=True)
        done = CliRunner().invoke(app, [*call, *more])
        assert done.exit_code == 0, done.output
        assert "the same drive" in done.output
        pictures.append({p.name: p.read_bytes() for p in (run / "rerun").glob("*.png")})
    assert "driven from the checkpoint at 1.50 s on" in done.output
    assert len(pictures[0]) == 20
    assert pictures[0] == pictures[2]
    (run / "checkpoints" / "0000030.state").write_bytes(b"what is this")
    done = CliRunner().invoke(app, call)
    assert "driven from the beginning" in done.stderr
    assert "is no checkpoint of Skidpad" in done.stderr
    assert done.exit_code == 0


def test_a_campaign_keeps_checkpoints(tmp_path):
    recipe = replace(RECIPE, drive=partial(drive_one, checkpoints_s=0.5))
    Campaign(recipe, [cell(duration=1.2)]).run(tmp_path, local(1))
    found = sorted(p.name for p in tmp_path.glob("runs/*/checkpoints/*"))
    assert found == ["0000010.state", "0000020.state"]


def test_a_changed_log_is_noticed(campaign, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(campaign / "runs" / "2_rain-noon-003", run)
    text = (run / "config.yaml").read_text()
    (run / "config.yaml").write_text(text.replace("seed: 3", "seed: 5"))
    done = CliRunner().invoke(app, ["rerun", str(run), "--from", "1", "--to", "2"])
    assert done.exit_code == 1


@pytest.mark.parametrize("stretch", [("3", "2"), ("100", "101")])
def test_a_stretch_outside_the_run_is_refused(campaign, stretch):
    run = campaign / "runs" / "2_rain-noon-003"
    done = CliRunner().invoke(app, ["rerun", str(run), "--from", stretch[0], "--to", stretch[1]])
    assert done.exit_code != 0
    assert "--from" in str(done.exception)


def test_a_film_shows_every_tick(campaign, tmp_path):
    import cv2

    run, film = campaign / "runs" / "2_rain-noon-004", tmp_path / "film.mp4"
    call = ["rerun", str(run), "--from", "0.5", "--to", "1.0", "--video", str(film)]
    assert CliRunner().invoke(app, call).exit_code == 0
    assert int(cv2.VideoCapture(str(film)).get(cv2.CAP_PROP_FRAME_COUNT)) == 10


@pytest.mark.req("A-246")
def test_wall_times_stand_apart_from_results(campaign):
    timing = pl.read_parquet(campaign / "timing.parquet")
    assert (timing["rtf"] > 0.0).all()
    assert timing["rtf_below_0_9_pct"].is_between(0.0, 100.0).all()
    reasons = timing["why_not_quick"].to_list()
    quick = timing["quick_pct"].to_list()
    assert all((share > 0.0) == (why is None) for share, why in zip(quick, reasons, strict=True))
    assert timing["story_table_pct"].to_list() == [None] * len(timing)  # it plays no story
    assert not {"rtf", "wall_s"} & set(read_results(campaign).columns)


@pytest.mark.req("A-246")
def test_slow_ticks_are_those_below_0_9_of_real_time(monkeypatch):
    clock = iter([0.0, 0.05, 0.105, 0.165])
    monkeypatch.setattr("skidpad.campaign.driving.pace.perf_counter", lambda: next(clock))
    pace = Pace(0.05)
    for _ in range(3):
        pace.see(None)
    assert pace.slow_pct == pytest.approx(100.0 / 3.0)  # factors 1.0, 0.91, 0.83


def test_the_picture_of_a_moment_has_all_views():
    seen = []

    class Eye(Sink):
        def see(self, moment):
            if moment.frame.tick == 3:
                seen.append(twelve_views(moment, 0.05))

    run(cell(SensorLevel.PIXELS, 0.4), sinks=(Eye(),))
    (picture,) = seen
    assert picture.shape == (*SIZE, 3)
    assert picture[300:560, 20:780].std() > 10.0  # the front camera
    assert picture[200:440, 1220:1580].std() > 10.0  # classes
