"""Every kind of run is written, read back, and driven again to the same content."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
import yaml
from msgspec.structs import replace
from typer.testing import CliRunner

from runs import adas_run, scenario_run, segment_run
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
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.run import (
    ActorMode,
    AgentDriver,
    ChannelCrew,
    Passenger,
    RunSpec,
    Scenario,
    StackDriver,
    run_from_plain,
)
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.recording.channels.drives import DriveRecord, read_record
from skidpad.recording.run.log_files import log_hash, read_log

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
    "study": speed_and_dropout([1])[1].run,
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
    assert replace(one, backend=far).resolved() == one.resolved()
    assert replace(one, backend=replace(SERVER, pace=True)).resolved() != one.resolved()
    assert len({yaml.safe_dump(r.resolved()) for r in KINDS.values()}) == len(KINDS)


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
    blinking = replace(speed_and_dropout((1,))[2].run, seed=4, duration=1.0)
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
    record = read_record(recording.with_suffix(".json"))
    assert record is not None
    route = msgspec.to_builtins(spec.course)
    del route["type"]
    first = {  # as the first version wrote it
        "route": {**route, "weather": msgspec.to_builtins(spec.weather)},
        "channels": ["lav_like", "tfuse_like"],
        "seed": 1,
        "duration": 1.0,
        "drive_by": "arbiter",
        "noise": 1.0,
    }
    older = msgspec.json.encode(DriveRecord(first, record.outcome))
    recording.with_suffix(".json").write_bytes(older)
    assert read_segment(recording) == spec


MATRIX_1 = {
    "driver": "2",
    "functions": ["acc", "lca"],
    "stack": None,
    "options": {},
    "weather": {"name": "clear-noon", "title": "Clear Sky - Noon"},
    "seed": 5,
    "profile": "recommended",
    "settings": {"mu_ref": 0.7},
    "map": "figure8",
    "duration": 60.0,
    "traffic": "random",
    "vehicles": 7,
    "allow_fewer": False,
    "sensors": "pixels",
    "render": "all",
    "backend": {"kind": "carla", "pace": True, "without": ["light-cache"]},
}
GRIP_1 = {
    "scenario": "ghost_cut_in",
    "weather": {"name": "icy_30", "ice_thickness": 30.0},
    "friction": "original",
    "seed": 2,
    "cutin": "unfixed",
    "model": "statistical",
    "mu_ref": 0.9,
    "controller": "stack",
    "config": 2,
    "profile": "recommended",
    "settings": {"grip": "physical", "mu_ref": 0.9},
    "level": "objects",
    "actors": "physical",
    "overlay": False,
    "backend": {"kind": "embedded", "pace": False, "without": []},
}


def stored(folder: Path, plain: dict[str, Any]) -> Path:
    (folder / "config.yaml").write_text(yaml.safe_dump(plain), encoding="utf-8")
    return folder


def test_folders_of_the_first_version_are_read(tmp_path: Path) -> None:
    matrix = read_run(stored(tmp_path, MATRIX_1))
    assert (matrix.name, matrix.duration) == ("2_clear-noon-005", 60.0)
    assert matrix.settings.world.mu_ref == 0.7
    assert matrix.backend == BackendChoice(
        backend=BackendKind.CARLA, pace=True, without=("light-cache",)
    )
    foreign = read_run(stored(tmp_path, MATRIX_1 | {"driver": "f.py:A", "stack": "f.py:A"}))
    assert foreign.driver == StackDriver("f.py:A", name="f.py:A")
    grip = read_run(stored(tmp_path, GRIP_1))
    assert grip.name == "ghost_cut_in-unfixed_icy_30_original-000002"
    assert grip.settings.world.grip.value == "statistical"
    assert isinstance(grip.course, Scenario)
    assert grip.course.parameters["EgoSpeed"] == 0.0


@pytest.mark.parametrize(
    ("plain", "told"),
    [
        ({"file": "lead_slowdown.xosc", "seed": 1}, "play the file again"),
        ({"version": 99}, "version 99"),
        ({"driver": "2"}, "does not describe a run"),
        ({"version": 2, "weather": {"wetness": 400.0}}, "wetness must be between 0 and 100"),
        ({"version": 2, "colour": "red"}, "colour"),
    ],
)
def test_what_a_folder_does_not_hold_is_said(
    tmp_path: Path, plain: dict[str, Any], told: str
) -> None:
    with pytest.raises(FileError, match=told):
        read_run(stored(tmp_path, plain))
