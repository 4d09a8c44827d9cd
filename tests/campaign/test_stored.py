"""Every kind of run is written, read back, and driven again to the same content."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from msgspec.structs import replace
from typer.testing import CliRunner

from scenario_tuning import Candidate, tuning_run
from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes.channels import RECIPE as CHANNELS
from skidpad.campaign.recipes.grip import recipe as grip_recipe
from skidpad.campaign.recipes.matrix import RECIPE as MATRIX
from skidpad.campaign.runs.play import run_to
from skidpad.campaign.runs.run import run
from skidpad.campaign.runs.stored import read_run, read_segment
from skidpad.campaign.studies.arms import speed_and_dropout
from skidpad.campaign.workers.worker import Finished, Job
from skidpad.cli.main import app
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.run import (
    AgentDriver,
    ChannelCrew,
    Passenger,
    RunSpec,
    StackDriver,
    run_from_plain,
)
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.recording.run.log_files import log_hash, read_log
from support.runs import adas_run, scenario_run, segment_run

SERVER = BackendChoice(
    backend=BackendKind.CARLA,
    host="10.0.0.7",
    port=2100,
    without=("light-cache",),
    server_command="carla --quality 'very low'",
    restart_every=3,
)
KINDS = {
    "adas": adas_run(3, "rain-night", profile="thesis_text", settings={"mu_ref": 0.8}),
    "adas on CARLA": adas_run(3, backend=SERVER),
    "adas with a stack": adas_run(driver=StackDriver("a.b:C", {"gain": [1, 2.5]}, name="x")),
    "study": speed_and_dropout(1)[1].run,
    "tuning": tuning_run(Candidate("lead_slowdown", {"Deceleration": 6.0}), 900_001),
    "grip": scenario_run("ghost_cut_in", "statistical", overlay=True),
    "play": scenario_run("/x/y.xosc", course=Scenario(ego="a", actors=ActorMode.IDEAL)),
    "play, ideal": scenario_run("/x/y.xosc", driver=Passenger()),
    "play, agent": scenario_run("/x/y.xosc", driver=AgentDriver("/x/agent.py:A")),
    "channels": segment_run(crew=ChannelCrew(drive_by="tfuse_like", noise=2.0)),
}


@pytest.mark.req("A-260")
@pytest.mark.parametrize("kind", KINDS)
def test_a_description_survives_its_file(kind: str) -> None:
    text = yaml.safe_dump(KINDS[kind].to_plain(), sort_keys=False)
    assert run_from_plain(yaml.safe_load(text), "config.yaml") == KINDS[kind]


def test_an_address_decides_no_run_and_everything_else_does() -> None:
    one, far = KINDS["adas on CARLA"], replace(SERVER, host="10.0.0.8", port=9, server_command="")
    assert replace(one, backend=far).to_identity() == one.to_identity()
    assert replace(one, backend=replace(SERVER, pace=True)).to_identity() != one.to_identity()
    assert len({yaml.safe_dump(r.to_identity()) for r in KINDS.values()}) == len(KINDS)


@pytest.mark.parametrize(
    ("driver", "course"),
    [(ChannelCrew(), "adas"), (Passenger(), "adas"), (StackDriver("a:B"), "channels")],
)
def test_a_driver_that_cannot_drive_there_is_refused(driver: Any, course: str) -> None:
    with pytest.raises(ConfigError):
        RunSpec(driver=driver, course=KINDS[course].course)


def here(jobs: Iterable[Job]) -> Iterator[Finished]:
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


def again(run: Path) -> str:
    done = CliRunner().invoke(app, ["rerun", str(run), "--to", "1"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.req("A-139", "A-260")
def test_a_folder_of_every_command_is_driven_again(tmp_path: Path) -> None:
    adas = adas_run(2, seed=3, duration=1.0, vehicles=3)
    blinking = replace(speed_and_dropout(1)[2].run, seed=4, duration=1.0)
    grip = replace(tuning_run(Candidate("lead_slowdown", {}), 1), duration=1.0)
    played = replace(grip, driver=Passenger())
    Campaign(MATRIX, [adas, blinking]).run(tmp_path, here)
    Campaign(grip_recipe(keep_all=True), [grip]).run(tmp_path / "grip", here)
    run_to(played, tmp_path / "play")
    folders = {
        tmp_path / "runs" / adas.name: adas,
        tmp_path / "runs" / blinking.name: blinking,
        tmp_path / "grip" / "runs" / grip.name: grip,
        tmp_path / "play": played,
    }
    for folder, spec in folders.items():
        assert read_run(folder) == spec
        assert log_hash(run(spec).log) == log_hash(read_log(folder))
        assert "the same drive" in again(folder)


@pytest.mark.req("A-260")
def test_a_segment_of_channels_is_driven_again(tmp_path: Path) -> None:
    spec = segment_run(duration=1.0)
    Campaign(CHANNELS, [spec]).run(tmp_path, here)
    recording = tmp_path / "route-4" / f"{spec.name}.mcap"
    assert read_segment(recording) == spec
    assert "the same drive" in again(recording)


def stored(folder: Path, plain: dict[str, Any]) -> Path:
    (folder / "config.yaml").write_text(yaml.safe_dump(plain), encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    ("plain", "told"),
    [
        ({"version": 99}, "version 99"),
        ({"driver": "2"}, "version None of a run's description, not 2"),
        ({"version": 2, "seed": "x"}, "does not describe a run"),
        ({"version": 2, "weather": {"wetness": 400.0}}, "wetness must be between 0 and 100"),
        ({"version": 2, "colour": "red"}, "colour"),
    ],
)
def test_what_a_folder_does_not_hold_is_said(
    tmp_path: Path, plain: dict[str, Any], told: str
) -> None:
    with pytest.raises(FileError, match=told):
        read_run(stored(tmp_path, plain))
