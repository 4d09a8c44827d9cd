"""Commands end with the answer and the next command."""

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.cli.campaigns.adas import answer
from skidpad.cli.campaigns.grip import answer_text, next_text
from skidpad.cli.main import app
from skidpad.cli.output.tables import fit_terminal
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.matrix import MATRIX, Metrics, RunKey
from skidpad.report.matrix.answers import terminal_answer
from skidpad.report.matrix.data import Matrix, load_matrix


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
        first == "All configurations lie within these crashes per run: 0.00 to 4.50 in clear sky."
    )
    assert sure.startswith("2 seeds per cell cannot tell two configurations apart")
    assert page == str(tmp_path / "report.html")
    assert following == f"Next: skidpad show {tmp_path}/runs/2-2 tells of the run with 6 crashes"


def calm_campaign(folder):
    """Two seeds of configuration 1 without a crash."""
    same = {"weather": "clear-noon", "precipitation_kind": "clear", "time_of_day": "noon"}
    same |= {"profile": "recommended", "map": "figure8", "sensors": "objects", "grip": "physical"}
    keys = [
        RunKey(config="1", seed=s, range="physical", outcome="completed", log_hash=str(s), **same)
        for s in (1, 2)
    ]
    MATRIX.write(folder, [(key, Metrics(fatal_collisions=0, distance_km=5.0)) for key in keys])
    return load_matrix(folder)


@pytest.mark.parametrize(
    ("logs", "told"),
    [
        ({"1": "runs/1"}, "Next: skidpad show runs/1 tells of a run without a crash"),
        ({"2": "runs/2"}, "Next: skidpad show runs/2 tells of a run without a crash"),
        ({}, "Next: skidpad compare {} OTHER says what another campaign changes"),
    ],
)
def test_a_campaign_without_a_crash_names_the_next_command_too(tmp_path, monkeypatch, logs, told):
    matrix = calm_campaign(tmp_path)
    monkeypatch.setattr(Matrix, "names", lambda _, runs: [str(s) for s in runs["seed"]])
    monkeypatch.setattr(CampaignFolder, "log", lambda _, name: logs.get(name))
    assert terminal_answer(matrix)[-1] == told.format(tmp_path)


def test_prose_is_filled_to_the_width_of_a_terminal_and_commands_are_not_cut(monkeypatch):
    text = f"{'word ' * 30}end\n/a/path/of/a/page.html\nNext: skidpad show {'long/' * 30}run"
    assert fit_terminal(text) == text, "in a pipe a line stays a line"
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    first, second, page, following = fit_terminal(text).split("\n")
    assert max(len(first), len(second)) <= 80
    assert f"{first} {second}\n{page}\n{following}" == text


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
