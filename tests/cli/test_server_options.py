"""The options that name a simulator are the same wherever they are taken."""

from __future__ import annotations

from dataclasses import fields

import pytest
import typer
from typer.core import TyperGroup, TyperOption

from skidpad.cli.main import app
from skidpad.cli.server_options import ServerWish

ROOT = typer.main.get_command(app)


def options(path: str) -> dict[str, tuple[str | None, tuple[str, ...], bool]]:
    """Help and flags of a command's simulator options."""
    command = ROOT
    for name in path.split():
        assert isinstance(command, TyperGroup)
        command = command.commands[name]
    wanted = {f.name for f in fields(ServerWish)}
    return {
        p.name: (p.help, tuple(p.opts), p.multiple)
        for p in command.params
        if isinstance(p, TyperOption) and p.name in wanted
    }


def test_a_campaign_takes_them_all() -> None:
    assert set(options("adas")) == {f.name for f in fields(ServerWish)}
    assert options("grip") == options("adas")


@pytest.mark.parametrize("path", ["play", "channels drive"])
def test_others_take_some_of_them_with_the_same_words(path: str) -> None:
    some = options(path)
    assert {"backend", "host", "port"} <= set(some)
    assert some.items() <= options("adas").items()
