"""Options are declared beside the fields of the run value, and are the same wherever they are taken."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import pytest
import typer
from msgspec import Meta, Struct, structs
from typer.core import TyperGroup, TyperOption
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.cli.options.asked import Tuned
from skidpad.cli.options.spread import describe_parameters, spread_fields
from skidpad.core.errors import ConfigError
from skidpad.core.run import PARTED, RunSpec
from skidpad.core.simulator import BackendChoice

ROOT = typer.main.get_command(app)
DRIVING = ("adas", "grip", "play")


class Colour(str, Enum):
    RED = "red"
    BLUE = "blue"


class Paint(Struct, frozen=True):
    colour: Annotated[Colour, Meta(description="Of the car.")] = Colour.RED
    coats: Annotated[int, Meta(ge=1, le=3, description="How many.")] = 1
    wet: Annotated[bool, Meta(description="Not dry yet.")] = False
    marks: Annotated[tuple[str, ...], Meta(description="Words on it.")] = ()
    layers: Annotated[tuple[str, ...], Meta(description="In turn.", extra=PARTED)] = ("a", "b")
    secret: int = 7


def invoke(*words: str) -> tuple[int, str]:
    seen = []
    small = typer.Typer()

    @small.command()
    @spread_fields(coats=2)
    def command(paint: Paint, name: str = "x") -> None:
        """Paint."""
        seen.append((paint, name))

    done = CliRunner().invoke(small, list(words), catch_exceptions=False)
    return done.exit_code, repr(seen[0]) if seen else done.output


def test_described_fields_become_options_and_the_command_gets_the_value() -> None:
    assert invoke() == (0, repr((Paint(coats=2), "x")))
    words = ("--colour", "blue", "--coats", "3", "--wet", "--marks", "a", "--marks", "b")
    words += ("--layers", "c, d,e")
    expected = Paint(Colour.BLUE, 3, wet=True, marks=("a", "b"), layers=("c", "d", "e"))
    assert invoke(*words, "--name", "y") == (0, repr((expected, "y")))


@pytest.mark.parametrize(
    ("wrong", "allowed"), [(("--colour", "green"), "red, blue"), (("--coats", "4"), "1 and 3")]
)
def test_what_the_field_does_not_allow_is_named_with_what_is(
    wrong: tuple[str, ...], allowed: str
) -> None:
    with pytest.raises(ConfigError) as told:
        invoke(*wrong)
    for part in (*wrong, allowed):
        assert part in str(told.value)


def test_a_field_without_a_description_is_no_option() -> None:
    code, told = invoke("--secret", "1")
    assert code == 2
    assert "--secret" in told


def options(path: str, kind: type[Struct]) -> dict[str, tuple[str | None, tuple[str, ...], bool]]:
    """Help and flags of a command's options that set fields of `kind`."""
    command = ROOT
    for name in path.split():
        assert isinstance(command, TyperGroup)
        command = command.commands[name]
    wanted = {p.name for p in describe_parameters(kind, {})}
    return {
        p.name: (p.help, tuple(p.opts), p.multiple)
        for p in command.params
        if isinstance(p, TyperOption) and p.name in wanted
    }


@pytest.mark.parametrize("path", [*DRIVING, "channels drive"])
def test_every_command_that_drives_takes_the_simulator_options(path: str) -> None:
    assert set(options(path, BackendChoice)) == {f.name for f in structs.fields(BackendChoice)}
    assert options(path, BackendChoice) == options("adas", BackendChoice)


@pytest.mark.parametrize("path", DRIVING)
def test_every_command_that_drives_a_run_takes_its_options(path: str) -> None:
    found = options(path, RunSpec)
    named = {"duration", "sensors", "render", "overlay", "bodywork", "scenery", "quality", "govern"}
    assert named == set(found)
    assert found == options("adas", RunSpec)
    assert {"profile", "set", "surface"} == set(options(path, Tuned))
