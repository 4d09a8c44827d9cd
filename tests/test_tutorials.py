"""The tutorials work as printed: their files and commands, in order, in an empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

TUTORIALS = Path(__file__).resolve().parents[1] / "docs" / "tutorials"
BLOCK = re.compile(r"```(\w+)(?: title=\"([\w.]+)\")?\n(.*?)```", re.DOTALL)


def commands_of(block: str) -> list[tuple[str, list[str]]]:
    """Each command of a console block, with the lines that it is said to print."""
    found: list[tuple[str, list[str]]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif line.strip():
            found[-1][1].append(line.rstrip())
    return found


@pytest.mark.parametrize("page", sorted(p.name for p in TUTORIALS.glob("*.md")))
def test_a_tutorial_works_as_printed(page: str, tmp_path: Path) -> None:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    environment = {**os.environ, "PATH": path, "COLUMNS": "120"}
    driven = 0
    for language, title, text in BLOCK.findall((TUTORIALS / page).read_text(encoding="utf-8")):
        if title:
            (tmp_path / title).write_text(text, encoding="utf-8")
        for command, expected in commands_of(text) if language == "console" else ():
            done = subprocess.run(
                ["bash", "-c", command],
                cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
            )  # fmt: skip
            assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
            printed = (done.stdout + done.stderr).splitlines()
            missing = [line for line in expected if not any(line in p for p in printed)]
            assert not missing, f"{command}: {missing}\n{done.stdout}\n{done.stderr}"
            driven += 1
    assert driven >= 3


def test_expected_lines_belong_to_the_command_above() -> None:
    assert commands_of("$ a\n1\n2\n$ b\n") == [("a", ["1", "2"]), ("b", [])]
