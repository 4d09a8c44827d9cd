"""`skidpad view`: a recording of channels in Rerun."""

from __future__ import annotations

from pathlib import Path

import typer

FILE = typer.Argument(help="A channel recording (.mcap), or a ROS 2 bag with --mapping.")
MAPPING = typer.Option(None, help="YAML that says which topics of a ROS 2 bag are what.")
SAVE = typer.Option(None, help="Write an .rrd file instead of opening the viewer.")


def view(file: Path = FILE, mapping: Path | None = MAPPING, save: Path | None = SAVE) -> None:
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
