"""`skidpad channels`: recordings of driving channels."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

channels = typer.Typer(
    name="channels", help="Recordings of driving channels.", no_args_is_help=True
)


@channels.command()
def info(
    file: Annotated[
        Path, typer.Argument(help="A channel recording (.mcap), or a ROS 2 bag with --mapping.")
    ],
    mapping: Annotated[
        Path | None, typer.Option(help="YAML that says which topics of a ROS 2 bag are what.")
    ] = None,
) -> None:
    """Say what a recording holds and what is wrong with it."""
    from skidpad.recording.channels.cycles import cycles
    from skidpad.recording.channels.mcap_files import McapRecording
    from skidpad.recording.sources import open_channels

    source = open_channels(file, mapping)
    typer.echo(f"{file}: channels {', '.join(source.channels)}")
    if isinstance(source, McapRecording):
        for topic in source.topics:
            span = topic.t_last - topic.t_first
            typer.echo(
                f"  {topic.topic} ({topic.schema}): {topic.messages} messages in {span:.1f} s"
            )
    n, objects = 0, [0] * len(source.channels)
    for cycle in cycles(source):
        n += 1
        for c, frame in enumerate(cycle.frames):
            objects[c] = max(objects[c], 0 if frame is None else len(frame.objects))
    typer.echo(f"  {n} cycles of 0.1 s")
    losses = source.losses
    for c, name in enumerate(source.channels):
        stale = losses.stale.get(name, 0)
        typer.echo(f"  {name}: up to {objects[c]} objects, absent in {stale} cycles")
    for text, value in (
        ("the file is cut short", losses.cut),
        ("damaged chunks", losses.chunks),
        ("malformed messages", losses.malformed),
        ("messages out of order", losses.out_of_order),
        ("messages with a leap in time", losses.jumps),
        ("messages of other kinds", losses.foreign),
    ):
        if value:
            typer.echo(f"  {text}" + ("" if value is True else f": {value}"))


@channels.command()
def compare(
    a: Annotated[Path, typer.Argument(help="Output folder of `skidpad monitor`, or one of many.")],
    b: Annotated[Path, typer.Argument(help="The other one.")],
) -> None:
    """Compare two monitored drives cycle by cycle, B less A."""
    from skidpad.evidence.channels.comparison import compare_drives
    from skidpad.recording.channels.indicators import read_indicators

    for row in compare_drives(read_indicators(a), read_indicators(b)):
        typer.echo(row)
