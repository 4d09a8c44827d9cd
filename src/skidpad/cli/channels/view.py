"""`skidpad view`: a recording of channels in Rerun."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def view(
    file: Annotated[
        Path, typer.Argument(help="A channel recording (.mcap), or a ROS 2 bag with --mapping.")
    ],
    mapping: Annotated[
        Path | None, typer.Option(help="YAML that says which topics of a ROS 2 bag are what.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="Write an .rrd file instead of opening the viewer.")
    ] = None,
) -> None:
    """Look at the worlds of all channels and at their indicators over time (extra `view`)."""
    from skidpad.core.errors import FileError

    if not file.exists():
        raise FileError(f"{file}: no such file")
    from skidpad.recording.channels.cycles import cycles
    from skidpad.recording.sources import open_channels
    from skidpad.report.channels.viewer import log_drive, require_rerun

    require_rerun()
    source = open_channels(file, mapping, truth=False)
    n = log_drive(source.channels, cycles(source), save, spawn=save is None)
    typer.echo(f"{n} cycles of {', '.join(source.channels)}" + (f" in {save}" if save else ""))
