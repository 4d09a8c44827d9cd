"""`skidpad hazards`: the scenes that a monitor found, and their export."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from skidpad.scenarios.export.version import OscVersion

hazards = typer.Typer(
    name="hazards", help="Hazardous scenes that a monitor found.", no_args_is_help=True
)
Dir = Annotated[Path, typer.Argument(help="Output folder of `skidpad monitor`.")]
Id = Annotated[list[str] | None, typer.Option("--id", help="Only this hazard; may be repeated.")]


T = TypeVar("T")


@hazards.command("list")
def list_(
    folder: Dir,
) -> None:
    """Print one line per hazard record."""
    from skidpad.recording.hazards.records import read_index

    for line in lines(read_index(folder)):
        typer.echo(line)


def lines(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yields a line of text per row of an index; a sentence where there is none."""
    for row in rows:
        flags = f" [{', '.join(row['flags'])}]" if row["flags"] else ""
        yield (
            f"{row['id']}  {row['type']:<26} {row['t_start']:.1f} to {row['t_end']:.1f} s  "
            f"{row['count']} cycles  {', '.join(row['involved'])}{flags}"
        )
    if not rows:
        yield "no hazard was found"


@hazards.command()
def show(
    folder: Dir,
    id: Id = None,
) -> None:
    """Everything that a record says, without its worlds."""
    import json

    from skidpad.recording.hazards.records import read_index

    rows = read_index(folder)
    for row in _choose_ids({row["id"]: row for row in rows}, id):
        typer.echo(json.dumps(row, indent=2))


@hazards.command()
def export(
    folder: Dir,
    id: Id = None,
    osc: Annotated[
        OscVersion, typer.Option(help="1.2 for all channels; 1.0 for CARLA ScenarioRunner.")
    ] = OscVersion.V1_2,
    world: Annotated[
        str | None, typer.Option(help="Only this channel's world; 1.0: the driving one by default.")
    ] = None,
) -> None:
    """Write each hazard as .xosc and .xodr into DIR/scenarios."""
    from skidpad.recording.hazards.records import read_hazards

    chosen = _choose_ids({record.id: record for record in read_hazards(folder)}, id)
    from skidpad.scenarios.export.hazard_export import export_hazard

    for record in chosen:
        scenario, road = export_hazard(record, folder / "scenarios", osc, world)
        typer.echo(f"{scenario} with {road.name}")


def _choose_ids(table: dict[str, T], ids: list[str] | None) -> list[T]:
    """Returns the entries of these ids, all for None or []; ConfigError for an unknown one."""
    from skidpad.core.errors import ConfigError

    unknown = [i for i in ids or [] if i not in table]
    if unknown:
        raise ConfigError(
            f"no hazard {', '.join(unknown)}; there are: {', '.join(table) or 'none'}"
        )
    return [table[i] for i in (ids or table)]
