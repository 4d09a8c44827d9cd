"""The README keeps its word: its example is the one that runs, its commands exist."""

import re
from pathlib import Path

import click
import typer

from skidpad.cli.main import app

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_stack_is_the_file_in_examples():
    block = re.search(r"```python\n(from math.*?)```", README, re.DOTALL).group(1)
    assert block in (ROOT / "examples" / "follow_lane.py").read_text(encoding="utf-8")
    assert len([line for line in block.splitlines() if line.strip()]) <= 30


def test_the_example_with_a_lidar_is_the_file_in_examples():
    text = (ROOT / "docs" / "your-stack.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert block in (ROOT / "examples" / "lidar_brake.py").read_text(encoding="utf-8")


def commands(group, prefix=""):
    found = set()
    for name, command in group.commands.items():
        found.add(prefix + name)
        if isinstance(command, click.Group):
            found |= commands(command, prefix + name + " ")
    return found


def test_every_command_named_in_the_readme_exists():
    known = {name.split()[0] for name in commands(typer.main.get_command(app))}
    told = set(re.findall(r"skidpad ([a-z][a-z-]*)(?= |`|\n)", README)) - {"import"}
    assert told <= known, f"not a command: {sorted(told - known)}"


def test_links_of_the_readme_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target
