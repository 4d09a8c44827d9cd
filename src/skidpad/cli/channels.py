"""`skidpad channels`: recordings of driving channels."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

import typer

channels = typer.Typer(
    name="channels", help="Recordings of driving channels.", no_args_is_help=True
)


class Truth(str, Enum):
    """Choices of --truth."""

    both = "both"
    sim = "sim"
    world = "world"


FILE = typer.Argument(help="A channel recording (.mcap), or a ROS 2 bag with --mapping.")
MAPPING = typer.Option(None, help="YAML that says which topics of a ROS 2 bag are what.")
DIR = typer.Argument(help="Folder with .mcap recordings, at any depth.")
LABELS = typer.Option(None, help="Human labels (CSV).")
TRUTH = typer.Option(Truth.both, help="Which truth to judge by.")
CURVE = typer.Option(
    None, help="Also vary the thresholds on this signal, such as gap, from half to double."
)
A = typer.Argument(help="Output folder of `skidpad monitor`, or one of many.")
B = typer.Argument(help="The other one.")


@channels.command()
def info(file: Path = FILE, mapping: Path | None = MAPPING) -> None:
    """Say what a recording holds and what is wrong with it."""
    from skidpad.recording.channels import McapRecording
    from skidpad.recording.cycles import cycles
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
def evaluate(
    folder: Path = DIR,
    labels: Path | None = LABELS,
    truth: Truth = TRUTH,
    curve: str | None = CURVE,
) -> None:
    """Judge the hazard rules by precision and recall; writes DIR/evaluation.json."""
    import json

    from skidpad.core.errors import require_choice
    from skidpad.evidence.evaluation import Evaluation, judge, read_labels
    from skidpad.evidence.hazards import Signal
    from skidpad.recording.channels import McapRecording
    from skidpad.recording.context import route_of
    from skidpad.recording.cycles import cycles
    from skidpad.recording.files import write_bytes
    from skidpad.recording.sources import recordings_below

    paths = recordings_below(folder)
    marked = read_labels(labels) if labels else {}
    if "" in marked and len(paths) > 1:
        from skidpad.core.errors import ConfigError

        raise ConfigError(
            f"{labels}: needs a column `recording`, since {folder} holds {len(paths)} recordings"
        )
    wanted = ("sim", "world") if truth is Truth.both else (truth.value,)
    varied = None if curve is None else Signal(require_choice("signal", curve, [*Signal]))
    evaluation = Evaluation()
    for path in paths:
        source = McapRecording(path)
        rows = list(cycles(source))
        mine = [*marked.get("", []), *marked.get(path.stem, [])]
        name = str(path.relative_to(folder))
        evaluation.segments.append(
            judge(
                name,
                route_of(source) or path.parent.name,
                source.channels,
                rows,
                mine,
                wanted,
                varied,
            )
        )
        typer.echo(f"{name}: {len(rows)} cycles")
    table = evaluation.as_dict()
    write_bytes(folder / "evaluation.json", json.dumps(table, indent=1, allow_nan=False).encode())
    _print_results(table)


def _print_results(table: dict[str, object]) -> None:
    from skidpad.evidence.matching import percent

    def ratio(row: dict[str, object], name: str) -> str:
        value, interval = row[name], row[f"{name}_interval"]
        if not isinstance(value, float) or not isinstance(interval, tuple):
            return "not defined"
        return f"{percent(value)} % ({percent(interval[0])} to {percent(interval[1])})"

    results = table["results"]
    assert isinstance(results, list)
    for result in results:
        if result["tolerance_s"] != 1.0:
            continue
        typer.echo(f"rules {result['rules']} against {result['truth']} truth")
        for hazard, row in result["hazards"].items():
            typer.echo(
                f"  {hazard}: found {row['tp']}, false {row['fp']}, missed {row['fn']}; "
                f"precision {ratio(row, 'precision')}, recall {ratio(row, 'recall')}"
            )


@channels.command()
def compare(a: Path = A, b: Path = B) -> None:
    """Compare two monitored drives cycle by cycle, B less A."""
    from skidpad.evidence.comparison import compare_drives
    from skidpad.recording.indicators import read_indicators

    for row in compare_drives(read_indicators(a), read_indicators(b)):
        typer.echo(row)
