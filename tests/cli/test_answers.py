"""Commands end with the answer and the next command."""

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.cli.campaigns.adas import answer
from skidpad.cli.campaigns.grip import answer_text, next_text
from skidpad.cli.main import app
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.matrix import MATRIX, Metrics, RunKey
from skidpad.report.matrix.data import Matrix


def rows(*cells):
    names = ("scenario", "weather", "friction", "outcome")
    return pl.DataFrame([dict(zip(names, cell, strict=True)) for cell in cells])


def test_a_friction_campaign_says_what_weather_changed():
    told = answer_text(
        rows(
            ("lead", "icy_30", "original", "completed"),
            ("lead", "icy_30", "reduced", "collision"),
            ("cut_in", "rain_60", "reduced", "collision"),
            ("cut_in", "rain_60", "reduced", "collision"),
            ("cut_in", "rain_60", "original", "collision"),
        )
    )
    assert told.split("\n") == [
        "on dry grip: 1 collision in 2 runs",
        "with weather: 3 collisions in 3 runs, most in cut_in in rain_60 (2)",
    ]
    assert answer_text(rows(("lead", "snow", "reduced", "completed"))) == (
        "with weather: 0 collisions in 1 run"
    )
    rolled = rows(
        ("lead", "snow", "reduced", "roll_over"), ("lead", "snow", "reduced", "completed")
    )
    assert answer_text(rolled) == (
        "with weather: 0 collisions and 1 roll-over in 2 runs, most in lead in snow (1)"
    )
    assert "--preset snow" in next_text(rolled)


def test_a_friction_campaign_names_the_next_command():
    hit = rows(
        ("lead", "icy_30", "reduced", "collision"),
        ("cut_in", "rain_60", "reduced", "collision"),
        ("cut_in", "icy_30", "reduced", "collision"),
        ("cut_in", "snow", "reduced", "completed"),
    )
    assert next_text(hit) == "Next: skidpad friction --preset icy_30 says how far it is to a stop"
    calm = rows(("cut_in", "snow", "reduced", "completed"))
    assert next_text(calm) == "Next: skidpad friction --table says how far it is to a stop"


def test_adas_ends_with_the_answers_the_page_and_the_run_to_look_at(tmp_path, monkeypatch):
    row = {"weather": "clear-noon", "precipitation_kind": "clear", "time_of_day": "noon"}
    about = {"profile": "recommended", "map": "figure8", "sensors": "objects", "grip": "physical"}
    written = [
        (
            RunKey(
                config=c,
                seed=s,
                range="physical",
                outcome="completed",
                log_hash=c + str(s),
                **row,
                **about,
            ),
            Metrics(fatal_collisions=n, duration_s=500.0, distance_km=5.0),
        )
        for s in (1, 2)
        for c, n in (("1", 0), ("2", 3 * s))
    ]
    MATRIX.write(tmp_path, written)
    monkeypatch.setattr(
        Matrix, "names", lambda _, runs: [f"{r['config']}-{r['seed']}" for r in runs.to_dicts()]
    )
    monkeypatch.setattr(CampaignFolder, "log", lambda self, name: self.path / "runs" / name)
    monkeypatch.setattr(
        "skidpad.report.matrix.page.write_report", lambda folder: folder / "report.html"
    )
    first, sure, *_, page, following = answer(tmp_path).split("\n")
    assert (
        first
        == "Of the configurations, fewest crashes: in clear sky configuration 1 (ACC) with 0.00 per run."
    )
    assert sure.startswith("2 seeds per cell cannot tell two configurations apart")
    assert page == str(tmp_path / "report.html")
    assert following == f"Next: skidpad show {tmp_path}/runs/2-2 tells of the run with 6 crashes"


@pytest.mark.parametrize(
    "words",
    ["doctor", "profiles show recommended", "profiles list", "map info figure8", "map list"],
)
def test_what_is_listed_fits_a_terminal(words):
    done = CliRunner().invoke(app, words.split())
    wide = [line for line in done.output.splitlines() if len(line) > 80]
    assert [line for line in wide if "pip install" not in line] == []


def test_play_takes_a_name_of_the_catalogue():
    done = CliRunner().invoke(app, ["play", "lead_slowdown", "--check"])
    assert done.exit_code == 0, done.output
    assert "lead_slowdown.xosc: can be played" in done.output
    wrong = CliRunner().invoke(app, ["play", "lead_slow", "--check"])
    assert "the catalogue has ghost_cut_in, lead_slowdown, front_accident" in str(wrong.exception)


def test_doctor_names_the_protocol_that_is_served_and_fits_a_pipe():
    done = CliRunner().invoke(app, ["doctor"])
    assert "server   serves CARLA 0.9.16" in done.output
    assert "msgpack" not in done.output
