"""`skidpad rerun` runs nothing of what a folder names without being told to (item 7)."""

import pytest
import yaml
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import FileError
from skidpad.core.run import AgentDriver, StackDriver
from skidpad.core.simulator import BackendChoice, BackendKind
from support import runs

FOREIGN = (
    "from pathlib import Path\nPath(__file__).with_suffix('.ran').touch()\nclass S:\n    pass\n"
)


def folder_of(tmp_path, run):
    folder = tmp_path / "run"
    folder.mkdir(exist_ok=True)
    (folder / "config.yaml").write_text(yaml.safe_dump(run.to_plain()))
    (folder / "ticks.parquet").touch()
    return folder


@pytest.mark.parametrize("kind", ["stack", "agent", "server"])
def test_a_folder_that_names_code_is_asked_about(tmp_path, kind):
    code = tmp_path / "foreign.py"
    code.write_text(FOREIGN)
    where = f"{code}:S"
    server = BackendChoice(backend=BackendKind.CARLA, server_command=f"touch {tmp_path}/ran")
    run = {
        "stack": runs.adas_run(driver=StackDriver(where)),
        "agent": runs.scenario_run("ghost_cut_in", driver=AgentDriver(where)),
        "server": runs.adas_run(backend=server),
    }[kind]
    folder = folder_of(tmp_path, run)
    refused = CliRunner().invoke(app, ["rerun", str(folder)], input="n\n")
    assert refused.exit_code == 1
    assert "which would be run; go on?" in refused.output
    unanswered = CliRunner().invoke(app, ["rerun", str(folder)])  # nobody is there to answer
    assert unanswered.exit_code == 1
    assert not list(tmp_path.glob("*ran"))
    told = CliRunner().invoke(app, ["rerun", str(folder), "--yes"])
    assert isinstance(told.exception, FileError)  # it was let through, and there is no log


def test_a_folder_of_ours_is_not_asked_about(tmp_path):
    folder = folder_of(tmp_path, runs.adas_run())
    assert isinstance(CliRunner().invoke(app, ["rerun", str(folder)]).exception, FileError)
