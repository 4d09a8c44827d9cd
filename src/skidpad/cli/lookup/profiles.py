"""`skidpad profiles`: the settings files and how they differ."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

WIDTH = 80  # columns of a terminal
profiles = typer.Typer(
    name="profiles",
    help="Settings profiles: list them, show one, compare two.",
    invoke_without_command=True,
)


@profiles.callback()
def _default(context: typer.Context) -> None:
    """Settings profiles: list them, show one, compare two."""
    if context.invoked_subcommand is None:
        list_profiles()


@profiles.command("list")
def list_profiles() -> None:
    """Name the profiles, with the number of settings that differ from `recommended`."""
    from skidpad.core.settings.parts import PROFILES, differences, load_profile

    recommended = load_profile("recommended")
    for name in PROFILES:
        n = len(differences(recommended, load_profile(name)))
        typer.echo(f"{name:<16}{n} settings differ from recommended" if n else name)


@profiles.command()
def sensors(
    plot: Annotated[
        Path | None, typer.Option(help="Draw the layout: a .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Print where the sensors are mounted and what they cover; --plot draws them from above."""
    from skidpad.cli.lookup.sensors import sensor_table, write_layout

    typer.echo(sensor_table())
    if plot is not None:
        write_layout(plot)
        typer.echo(plot)


@profiles.command()
def show(name: str) -> None:
    """Show every setting of a profile with its source."""
    from textwrap import wrap

    from skidpad.core.settings.parts import PART_OF, find_setting, load_profile

    for setting, value in load_profile(name).to_plain().items():
        about = find_setting(setting)
        words = f"{about.source}, {PART_OF[setting]}: {about.text}"
        for line in wrap(words, WIDTH, initial_indent="# ", subsequent_indent="#   "):
            typer.echo(line)
        typer.echo(f"{setting}: {_text(value)}")


@profiles.command()
def diff(a: str, b: str) -> None:
    """List the settings in which two profiles differ."""
    from skidpad.core.settings.parts import differences, load_profile

    rows = differences(load_profile(a), load_profile(b))
    if not rows:
        typer.echo(f"{a} and {b} are equal")
        return
    typer.echo(f"{'setting':<24}{a:<20}{b}")
    for name, left, right in rows:
        typer.echo(f"{name:<24}{_text(left):<20}{_text(right)}")


def _text(value: Any) -> str:
    """Returns a value as `--set` takes it: none, on, off, a number or text."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if isinstance(value, float) else str(value)
