"""The reference drives: how each is driven, through commands and the public call only."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
from typer.testing import CliRunner

import skidpad
from skidpad.cli.main import app
from skidpad.recording.run.log_files import write_log
from skidpad.simulation.carla_server.process import ServerProcess
from support.references.columns import Columns, joined, of_lines, of_recording, of_table

CLIENT = Path(__file__).with_name("carla_client.py")
ATTEMPTS = 3  # a busy client may open a stream after its first reading was sent
CLIENT_LIMIT = 600.0  # s; a quiet machine needs about 5
SCENARIOS = next(Path(skidpad.__file__).parent.rglob("lead_slowdown.xosc")).parent
SEGMENT_HOURS = 45.0 / 3600.0


def command(*words: object) -> None:
    """Run a command of ours in this process."""
    done = CliRunner().invoke(app, [str(w) for w in words], catch_exceptions=False)
    good = (0, 1) if words[0] == "play" else (0,)  # 1: the verdict, which is no matter here
    assert done.exit_code in good, done.output


def of_log(folder: Path) -> Columns:
    """Ticks and events of a run's folder."""
    ticks = pl.read_parquet(folder / "ticks.parquet")
    return joined([("ticks", of_table(ticks)), ("events", of_lines(folder / "events.jsonl"))])


def cell(
    folder: Path,
    configuration: int,
    weather: str,
    seed: int,
    sensors: str = "objects",
    profile: str = "recommended",
    duration: float = 25.0,
) -> Columns:
    """One cell of the matrix among twenty vehicles."""
    run = skidpad.drive(
        configuration,
        weather=weather,
        seed=seed,
        sensors=sensors,
        profile=profile,
        duration=duration,
    )
    write_log(folder, run.log)
    return of_log(folder)


def scenario(folder: Path, name: str, grip: str) -> Columns:
    """One scenario of the friction study on ice."""
    file = SCENARIOS / f"{name}.xosc"
    asked = ("--weather", "icy_30", "--grip", grip, "--end-on-collision")
    command("play", file, *asked, "--out", folder)
    return of_log(folder)


def segment(folder: Path, route: str) -> Columns:
    """A segment of a route, driven by two channels and watched by the monitor."""
    words = ("--route", route, "--hours", SEGMENT_HOURS, "--no-mind-weather", "--out", folder)
    command("channels", "drive", *words)
    (recording,) = folder.glob("*/*.mcap")
    command("monitor", recording, "--out", folder / "monitor")
    indicators = pl.read_parquet(folder / "monitor" / "indicators.parquet")
    return joined(
        [
            ("recording", of_recording(recording)),
            ("indicators", of_table(indicators)),
            ("hazards", of_lines(folder / "monitor" / "hazards.jsonl")),
        ]
    )


def carla(folder: Path) -> Columns:
    """A drive of the real client through the CARLA server: what the client was told."""
    out = folder / "seen.npz"
    for _ in range(ATTEMPTS):
        with ServerProcess(["--idle-exit", "120", "--scenery", "none"]) as server:
            done = subprocess.run(
                [sys.executable, CLIENT, str(server.port), out],
                capture_output=True,
                text=True,
                timeout=CLIENT_LIMIT,
                check=False,
            )
        if out.exists():
            break
    assert out.exists(), done.stdout + done.stderr
    with np.load(out) as seen:
        return dict(seen)


DRIVES: dict[str, Callable[[Path], Columns]] = {
    "no assistance, dry": partial(cell, configuration=0, weather="clear-noon", seed=1),
    "following, dry": partial(cell, configuration=1, weather="clear-noon", seed=2),
    "lane centring, rain at night": partial(cell, configuration=2, weather="rain-night", seed=3),
    "full package, ice": partial(cell, configuration=4, weather="icy_30", seed=5),
    "full package, thesis": partial(
        cell, configuration=4, weather="clear-night", seed=6, profile="thesis_text"
    ),
    "lane centring, listing": partial(
        cell, configuration=2, weather="clear-noon", seed=7, profile="thesis_listing"
    ),
    "light ahead, pixels, wet": partial(
        cell, configuration=3, weather="rain-noon", seed=4, sensors="pixels", duration=12.0
    ),
    "full package, pixels, rain at night": partial(
        cell, configuration=4, weather="rain-night", seed=8, sensors="pixels", duration=12.0
    ),
    "ghost cut-in": partial(scenario, name="ghost_cut_in", grip="none"),
    "ghost cut-in, reduced": partial(scenario, name="ghost_cut_in", grip="statistical"),
    "lead slowdown": partial(scenario, name="lead_slowdown", grip="none"),
    "lead slowdown, reduced": partial(scenario, name="lead_slowdown", grip="statistical"),
    "front accident": partial(scenario, name="front_accident", grip="none"),
    "front accident, reduced": partial(scenario, name="front_accident", grip="statistical"),
    "channels": partial(segment, route="route-1"),
    "carla": carla,
}
