"""Commands end with the answer and the next command."""

import polars as pl
from typer.testing import CliRunner

from skidpad.cli.grip import answer_text
from skidpad.cli.main import app


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
