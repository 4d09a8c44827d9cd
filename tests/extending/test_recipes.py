"""Every recipe of docs/extending.md works as printed: its package is installed and then removed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from docs_run import install
from skidpad.cli.lookup.extensions import extension_points
from skidpad.recording.run.log_files import read_log

PAGE = Path(__file__).resolve().parents[2] / "docs" / "extending.md"
RECIPE = re.compile(r"^## (An? .+?)\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)
BLOCK = re.compile(r"```(\w+)(?: title=\"([\w./-]+)\")?\n(.*?)```", re.DOTALL)
RECIPES = dict(RECIPE.findall(PAGE.read_text(encoding="utf-8")))


def call(folder: Path, *arguments: str, packages: Path | None = None) -> str:
    """Runs Python in `folder`; packages: where recipes are installed."""
    paths = [os.environ.get("PYTHONPATH", ""), str(PAGE.parents[1] / "src")]
    paths += [] if packages is None else [str(packages)]
    environment = {
        **os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "COLUMNS": "120",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{arguments}\n{done.stdout}\n{done.stderr}"
    return done.stdout + done.stderr


def follow(text: str, folder: Path, packages: Path) -> list[str]:
    """Writes the files and runs the commands of a recipe; returns its commands of Skidpad."""
    followed = []
    for language, title, block in BLOCK.findall(text):
        if title:
            (folder / title).parent.mkdir(parents=True, exist_ok=True)
            (folder / title).write_text(block, encoding="utf-8")
        printed = ""
        for line in block.splitlines() if language == "console" else ():
            if line.startswith("$ pip install "):
                install(folder / line.split()[-1], packages)
            elif line.startswith("$ skidpad "):
                followed.append(line[2:])
                printed = call(folder, "-m", *line[2:].split(), packages=packages)
            else:  # what the command prints, apart from the width of columns
                words = line.split()
                shown = [p.split()[: len(words)] for p in printed.splitlines()]
                assert words in shown, f"{line!r} is not in:\n{printed}"
    return followed


def replayed_readings(folder: Path, out: str) -> str:
    """Returns what the cockpit's replay of a campaign's run shows, without the package."""
    replay = "from skidpad.cockpit.replay import RecordedRun; from pathlib import Path; "
    replay += f"print(RecordedRun(next(Path('{out}/runs').iterdir())).readings(20))"
    return call(folder, "-c", replay)


# what the cockpit says of the run that a recipe drives
PARTS = {
    "A driving function": (
        "out/assisted",
        "isa: Intelligent speed assistance [package speed-assistance]",
    ),
    "A weather preset": ("out/fog", "freezing-fog: Freezing fog [package freezing-fog]"),
    "A backend": ("out/late", "Pedals and steering act 0.15 s late [package late-actuators]"),
    "A map": ("out/circle", "circle-60.xodr"),  # the run keeps the road, not the package
}


def check_cockpit(folder: Path, out: str, part: str) -> None:
    """The cockpit lists the part of the package for a run, and opens the run without the package."""
    listed = "from skidpad.cockpit.parts import list_parts; "
    listed += "from skidpad.cockpit.replay import RecordedRun; from pathlib import Path; "
    listed += f"print(list_parts(RecordedRun(next(Path('{out}/runs').iterdir())).spec))"
    assert part in call(folder, "-c", listed, packages=folder / "packages")
    assert "[package" not in call(folder, "-c", listed)


def check_sensor(folder: Path) -> None:
    """The report, and the cockpit's replay without the package, show the sensor."""
    assert "Radar to the rear" in (folder / "out/behind/report.html").read_text("utf-8")
    assert "Radar to the rear, returns" in replayed_readings(folder, "out/behind")


def check_function(folder: Path) -> None:
    """The function held the vehicle to the limit of 100 km/h; report and cockpit show its numbers."""
    page = folder / "out/assisted/report.html"
    assert "Intelligent speed assistance" in page.read_text("utf-8")
    rows = pl.read_parquet(page.with_name("results.parquet"))
    assert 90.0 < rows["max_speed_kmh"].item() < 101.0
    assert rows["functions"].item() == "acc+lca+isa"
    assert "Intelligent speed assistance, limit kmh" in replayed_readings(folder, "out/assisted")


def check_indicator(folder: Path) -> None:
    """The page and its data have the indicator, also when it is written again without the package."""
    page = folder / "out/monitored/report.html"
    assert "ego speed difference" in page.read_text("utf-8")
    again = (
        "from skidpad.report.channels.page import write_drive_report; from pathlib import Path; "
    )
    call(folder, "-c", again + "write_drive_report(Path('out/monitored'))")
    assert "ego speed difference" in page.read_text("utf-8")
    assert "ego_speed_difference" in page.with_name("monitor.json").read_text("utf-8")


def check_action(folder: Path) -> None:
    """The story of the run tells the action."""
    story = (folder / "out/crowd").rglob("*")
    texts = [p.read_text("utf-8") for p in story if p.suffix in (".csv", ".json", ".jsonl")]
    assert any("slow_all" in text for text in texts)


def check_metric(folder: Path) -> None:
    """Rows and report have the metric, also a report that is written again without the package."""
    page = folder / "out/close/report.html"
    assert "close following" in page.read_text("utf-8")
    rows = pl.read_parquet(page.with_name("results.parquet"))
    assert 0.0 <= rows["close_following_pct"].item() <= 100.0
    again = "from skidpad.report.matrix.page import write_report; from pathlib import Path; "
    call(folder, "-c", again + "write_report(Path('out/close'))")
    assert "close following" in page.read_text("utf-8")


def check_backend(folder: Path) -> None:
    """What acts is what was asked for three ticks before."""
    log = read_log(folder / "out/late/runs/2_rain-noon-001")
    asked, done = log.requested.throttle, log.applied.throttle
    assert list(done[4:24]) == list(asked[:20]) != list(done[1:21])


def check_map(folder: Path) -> None:
    """The campaign keeps the road that was made."""
    assert list(folder.glob("out/circle/maps/*/circle-60.xodr"))


CHECKS = {
    "A sensor": check_sensor,
    "A driving function": check_function,
    "An indicator": check_indicator,
    "A scenario action and a condition": check_action,
    "A metric": check_metric,
    "A backend": check_backend,
    "A map": check_map,
}


@pytest.mark.parametrize("title", RECIPES)
def test_a_recipe_works_as_printed_and_its_runs_open_without_it(title: str, tmp_path: Path) -> None:
    packages = tmp_path / "packages"
    commands = follow(RECIPES[title], tmp_path, packages)
    assert commands
    if title in CHECKS:
        CHECKS[title](tmp_path)
    if title in PARTS:
        check_cockpit(tmp_path, *PARTS[title])
    for command in commands:
        if command.startswith(("skidpad show ", "skidpad safety-case ")):
            with_it = call(tmp_path, "-m", *command.split(), packages=packages)
            assert call(tmp_path, "-m", *command.split()) == with_it  # with the package removed


def test_every_registry_has_a_recipe() -> None:
    groups = {registry.group for registry in extension_points()}
    assert groups == set(re.findall(r'entry-points."([\w.]+)"', PAGE.read_text("utf-8")))
    assert set(CHECKS) | set(PARTS) <= set(RECIPES)


def test_the_relay_of_the_recipe_takes_alerts(tmp_path: Path) -> None:
    pytest.importorskip("httpx")
    follow(RECIPES["An alert relay"], tmp_path, tmp_path / "packages")
    use = """
from skidpad.cli.fleet.links import relays
from skidpad.core.errors import ConfigError
from skidpad.fleet.service import Places
from pathlib import Path

relay, = relays(Places(data=Path(".")), [], [], None, ["file=alerts.jsonl"])
relay.send({"id": "a"})
relay.send({"id": "b"})
for wrong in ("file=nowhere/alerts.jsonl", "flie=x"):
    try:
        relays(Places(data=Path(".")), [], [], None, [wrong])
    except ConfigError as error:
        print(error)
"""
    said = call(tmp_path, "-c", use, packages=tmp_path / "packages")
    assert (tmp_path / "alerts.jsonl").read_text() == '{"id": "a"}\n{"id": "b"}\n'
    assert "there is no folder nowhere" in said
    assert "unknown alert relay 'flie'; choose one of: webhook, mqtt, file; did you mean" in said
