"""A setting is declared in one line, and everything that users see of it follows from that line."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import skidpad

PACKAGE = Path(skidpad.__file__).parent
TOOLS = PACKAGE.parents[1] / "tools"
LINE = '    slush: float = setting_field(0.5, "M-1", "depth of slush, m", low=0.0, high=2.0)\n'
BEFORE = "    esc: bool = setting_field("
ASK = """
from typer.testing import CliRunner
from skidpad.cli.main import app
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.core.settings.parts import load_profile, parse_assignments
from skidpad.core.errors import ConfigError
from docs_hooks import settings_reference

shown = CliRunner().invoke(app, ["profiles", "show", "recommended"]).output
assert "# M-1, world: depth of slush, m\\nslush: 0.5\\n" in shown
assert "| `slush` | depth of slush, m | a number between 0 and 2 | 0.5 | M-1 |" in settings_reference()
run = RunSpec(settings=load_profile("thesis_text", parse_assignments(["slush=1.5"])))
assert run.settings.world.slush == 1.5
plain = run.to_plain()
assert plain["settings"]["slush"] == 1.5
assert run_from_plain(plain, "config.yaml") == run
try:
    load_profile("recommended", {"slush": 3.0})
except ConfigError as error:
    print(error)
"""


@pytest.mark.req("M-14")
def test_a_new_setting_appears_in_help_files_python_and_docs(tmp_path: Path) -> None:
    copy = tmp_path / "skidpad"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    module = copy / "core" / "settings" / "parts.py"
    text = module.read_text(encoding="utf-8")
    assert text.count(BEFORE) == 1
    module.write_text(text.replace(BEFORE, LINE + BEFORE), encoding="utf-8")
    answer = subprocess.run(
        [sys.executable, "-c", ASK],
        capture_output=True, text=True, timeout=120, check=False,
        env={"PYTHONPATH": f"{tmp_path}:{TOOLS}", "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
    )  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == "slush must be between 0 and 2, got 3.0\n"


RUN_PATH = ("core/run.py", "core/courses.py", "core/settings/parts.py", "campaign/runs/run.py",
            "campaign/runs/drive.py", "campaign/driving/run_setup.py", "campaign/driving/stack_at_wheel.py",
            "campaign/driving/course_file.py", "campaign/recipes/matrix.py", "campaign/cells/matrix.py",
            "campaign/stepping.py", "cli/options/asked.py")  # fmt: skip


def test_settings_are_typed_on_the_way_from_a_command_to_a_run() -> None:
    for name in RUN_PATH:
        text = (PACKAGE / name).read_text(encoding="utf-8")
        assert "Mapping[str, Any]" not in text, name
        assert "settings_of(" not in text, name
