"""`skidpad.drive()` and `skidpad adas` describe a run alike: equal options give equal RunSpecs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import skidpad
from skidpad.campaign.runs import drive as drive_module
from skidpad.cli.main import app
from skidpad.cli.options.campaigns import CampaignOptions
from skidpad.core.run import RunSpec

CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "nothing": ("--stack 2", {"stack": 2}),
    "a configuration inside the envelope": ("--stack 5", {"stack": "5"}),
    "the reference driver": ("--stack reference", {"stack": "reference"}),
    "roads and traffic": (
        "--stack 3 --map town --traffic pack --vehicles 7 --duration 60",
        {"stack": 3, "map": "town", "traffic": "pack", "vehicles": 7, "duration": 60.0},
    ),
    "an end along the road": ("--stack 1 --route-km 1.5", {"stack": 1, "route_km": 1.5}),
    "weather and seed": (
        "--stack 4 --weather rain-night --first-seed 7 --sensors objects",
        {"stack": 4, "weather": "rain-night", "seed": 7, "sensors": "objects"},
    ),
    "a profile and single settings": (
        "--stack 2 --profile thesis_text --set grip=none --set radar=off",
        {"stack": 2, "profile": "thesis_text", "settings": {"grip": "none", "radar": "off"}},
    ),
    "a stack of one's own": (
        "--stack examples/follow_lane.py:FollowLane --stack-set cruise_kmh=60",
        {"stack": "examples/follow_lane.py:FollowLane", "stack_settings": {"cruise_kmh": 60}},
    ),
}


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[RunSpec]:
    """The runs that a command or a call would drive; none is driven."""
    found: list[RunSpec] = []
    monkeypatch.setattr(
        CampaignOptions, "__call__", lambda _, campaign, *__: found.extend(campaign.tasks)
    )
    monkeypatch.setattr(drive_module, "run", lambda spec, *_, **__: found.append(spec))
    return found


@pytest.mark.parametrize("name", CASES)
def test_a_command_and_a_call_describe_the_same_run(
    name: str, asked: list[RunSpec], tmp_path: Path
) -> None:
    words, arguments = CASES[name]
    if "--weather" not in words:
        words += " --weather clear-noon"
    done = CliRunner().invoke(
        app, ["adas", "--out", str(tmp_path), *words.split()], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    skidpad.drive(**arguments)
    by_command, by_call = asked
    assert by_command.to_plain() == by_call.to_plain()
    assert by_command == by_call


def test_other_options_give_another_run(asked: list[RunSpec]) -> None:
    """The comparison above is not of values that never differ."""
    for words, arguments in CASES.values():
        del words
        skidpad.drive(**arguments)
    assert len({str(spec.to_plain()) for spec in asked}) == len(CASES)
