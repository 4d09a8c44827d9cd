"""Help is in groups, each command with an example that the command would take."""

import shlex

import pytest
import typer
from typer.core import TyperOption
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.cli.options.help_panels import COMMANDS, SUBCOMMANDS

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


def subcommands(group, path):
    """(words, command) of every command below a group."""
    for name, command in getattr(group, "commands", {}).items():
        if command.hidden:
            continue
        words = f"{path} {name}".strip()
        if hasattr(command, "commands"):
            yield from subcommands(command, words)
        elif path:
            yield words, command


def test_every_command_of_a_group_has_its_own_example():
    for words, command in subcommands(ROOT, ""):
        assert f"{command.epilog} ".startswith(f"Example: skidpad {words} "), words
    assert len(SUBCOMMANDS) == len([*subcommands(ROOT, "")])


@pytest.mark.parametrize(
    "example", sorted({*SUBCOMMANDS, *(EXAMPLES[name] for name in set(EXAMPLES) - FOREIGN)})
)
def test_the_example_is_one_that_the_command_takes(example):
    words = shlex.split(example)
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
