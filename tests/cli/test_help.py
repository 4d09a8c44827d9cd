"""Help is in groups, each command with an example that the command would take."""

import shlex

import pytest
import typer
from typer.core import TyperOption
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.cli.options.help_panels import COMMANDS

ROOT = typer.main.get_command(app)
SHOWN = {name: command for name, command in ROOT.commands.items() if not command.hidden}
EXAMPLES = {name: text for commands in COMMANDS.values() for name, text in commands.items()}
FOREIGN = {"carla-server"}  # reads its own words


def test_every_command_stands_in_a_group_and_has_an_example():
    assert set(EXAMPLES) == set(SHOWN)
    told = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "80"}).output
    for panel in COMMANDS:
        assert f"─ {panel} ─" in told
    assert max(map(len, told.splitlines())) <= 80


@pytest.mark.parametrize("name", sorted(set(EXAMPLES) - FOREIGN))
def test_the_example_is_one_that_the_command_takes(name):
    words = shlex.split(EXAMPLES[name])
    command, first = ROOT, 0
    while first < len(words) and words[first] in getattr(command, "commands", {}):
        command, first = command.commands[words[first]], first + 1
    flags = {flag for p in command.params for flag in getattr(p, "opts", [])}
    assert {word for word in words[first:] if word.startswith("--")} <= flags
    needed = [p for p in command.params if p.required and isinstance(p, TyperOption)]
    assert all(set(p.opts) & set(words) for p in needed), [p.name for p in needed]


@pytest.mark.parametrize("name", ["adas", "grip", "play", "drive"])
def test_options_are_in_groups(name):
    told = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "80"}).output
    assert told.count("╭─") >= 5
    assert f"Example: skidpad {name}" in told.replace("\n", " ")
