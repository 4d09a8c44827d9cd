"""`skidpad channels evaluate` and `train`: identifiers of hazards, judged and learned."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from skidpad.evidence.channels.hazards import Signal
    from skidpad.evidence.channels.judging.segments import Segment
    from skidpad.evidence.channels.matching import Span


class Truth(str, Enum):
    """Values that the option --truth takes."""

    both = "both"
    sim = "sim"
    world = "world"


Dir = Annotated[Path, typer.Argument(help="Folder with .mcap recordings, at any depth.")]
Workers = Annotated[int, typer.Option(help="Processes; 0: one per core.")]


def evaluate(
    folder: Dir,
    labels: Annotated[Path | None, typer.Option(help="Human labels (CSV).")] = None,
    truth: Annotated[Truth, typer.Option(help="Which truth to judge by.")] = Truth.both,
    curve: Annotated[
        str | None,
        typer.Option(
            help="Also vary the thresholds on this signal, such as gap, from half to double."
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="Also judge this learned identifier (.npz; `bundled`: ours)."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: DIR.")] = None,
    workers: Workers = 0,
) -> None:
    """Judge who finds hazards by precision and recall; writes evaluation.json and report.html."""
    import json

    from skidpad.core.errors import ConfigError, require_choice
    from skidpad.recording.sources import recordings_below

    paths = recordings_below(folder)
    from skidpad.evidence.channels.hazards import Signal

    varied = None if curve is None else Signal(require_choice("signal", curve, [*Signal]))
    from skidpad.evidence.channels.judging.evaluation import Evaluation, read_labels
    from skidpad.recording.files import write_bytes
    from skidpad.report.channels.evaluation.page import write_evaluation_report

    marked = read_labels(labels) if labels else {}
    if "" in marked and len(paths) > 1:
        raise ConfigError(
            f"{labels}: needs a column `recording`, since {folder} holds {len(paths)} recordings"
        )
    truths = ("sim", "world") if truth is Truth.both else (truth.value,)
    everywhere = marked.get("", [])
    tasks = [
        _Task(path, folder, truths, (*everywhere, *marked.get(path.stem, [])), varied, model)
        for path in paths
    ]
    evaluation = Evaluation(_segments(tasks, workers))
    if model is not None:
        _refuse_training_drives(model, evaluation.segments)
    table = evaluation.as_dict() | {"model": None if model is None else _about_model(model)}
    out = out or folder
    out.mkdir(parents=True, exist_ok=True)
    write_bytes(out / "evaluation.json", json.dumps(table, indent=1, allow_nan=False).encode())
    write_evaluation_report(out)
    _print_results(table)


def train(
    folder: Dir,
    out: Annotated[Path, typer.Option("--out", help="Model file to write (.npz).")],
    workers: Workers = 0,
) -> None:
    """Train the learned identifier on recordings with truth; writes the model and its card."""
    from skidpad.recording.sources import recordings_below

    paths = recordings_below(folder)
    from skidpad.evidence.channels.identifier.model import model_bytes
    from skidpad.evidence.channels.identifier.training import (
        TrainingDrive,
        card_text,
        require_learning,
        train_model,
    )
    from skidpad.recording.files import write_bytes

    require_learning()
    tasks = [_Task(path, folder, ("sim", "world"), (), None, None, rows=True) for path in paths]
    drives = [
        TrainingDrive(s.route, s.context.get("seed", s.name), s.t, s.rows, s.truths, s.hours)
        for s in _segments(tasks, workers)
    ]
    model = train_model(drives, typer.echo)
    write_bytes(out, model_bytes(model))
    write_bytes(out.with_suffix(".md"), card_text(model).encode())
    typer.echo(f"{out}: written, with its card {out.with_suffix('.md').name}")


@dataclass(frozen=True, slots=True)
class _Task:
    """One recording to judge, in a worker."""

    path: Path
    folder: Path
    truths: tuple[str, ...]
    labels: tuple[Span, ...]
    curve: Signal | None
    model: Path | None
    rows: bool = False  # keep what an identifier sees

    def made_by(self) -> dict[str, str]:
        """Returns what findings depend on besides the model, as words; other words make them void."""
        from skidpad.evidence.channels.judging.kept import code_hash

        about = self.path.stat()
        return {
            "code": code_hash(),
            "recording": f"{about.st_size} bytes of {about.st_mtime_ns}",
            "truths": ",".join(self.truths),
            "labels": repr(self.labels),
            "curve": "" if self.curve is None else self.curve.value,
        }


def judge_one(task: _Task) -> Segment:
    """Judges one recording, or reads what the same code found of it before; writes NAME.judged.

    Without `task.rows` the rows that an identifier sees are left out of the result.
    """
    from dataclasses import replace

    import numpy as np

    from skidpad.core.files.reading import is_file
    from skidpad.evidence.channels.identifier.model import load_model
    from skidpad.evidence.channels.judging.kept import segment_bytes, segment_from
    from skidpad.evidence.channels.judging.learned import with_model
    from skidpad.recording.files import write_bytes

    made_by, kept = task.made_by(), task.path.with_suffix(".judged")
    segment = segment_from(kept.read_bytes(), made_by) if is_file(kept) else None
    if segment is None:
        segment = _judge_task(task)
        write_bytes(kept, segment_bytes(segment, made_by))
    segment = replace(segment, name=str(task.path.relative_to(task.folder)))
    if task.model is not None:
        segment = with_model(segment, load_model(task.model))
    if task.rows:
        return segment
    return replace(segment, rows=np.empty((0, 0)), motion=np.empty((0, 3)))


def _judge_task(task: _Task) -> Segment:
    """Returns one recording judged by all identifiers, with the monitor's times."""
    import time

    from skidpad.evidence.channels.judging.segments import judge
    from skidpad.live.watch import Timer
    from skidpad.recording.channels.context import context_of
    from skidpad.recording.channels.cycles import cycles
    from skidpad.recording.channels.mcap_files import McapRecording

    source = McapRecording(task.path)
    context = context_of(source)
    return judge(
        task.path.name,
        context.get("route") or task.path.parent.name,
        source.channels,
        list(cycles(source)),
        task.labels,
        task.truths,
        task.curve,
        context,
        Timer(time.thread_time_ns),
    )


def _segments(tasks: list[_Task], workers: int) -> list[Segment]:
    """Returns all recordings judged, in the order of the tasks; prints each; a failure is raised.

    workers: 0: one per core.
    """
    import os
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    workers = min(workers or os.cpu_count() or 1, len(tasks))
    if workers == 1:
        return list(_report_segments(map(judge_one, tasks)))
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        return list(_report_segments(pool.map(judge_one, tasks)))


def _report_segments(segments: Iterable[Segment]) -> Iterator[Segment]:
    """Yields the segments unchanged, and prints the name and cycles of each."""
    for segment in segments:
        typer.echo(f"{segment.name}: {segment.t.size} cycles")
        yield segment


def _about_model(path: Path) -> dict[str, object]:
    """Returns what a reader must know of the learned identifier: file, training hours, recordings."""
    from skidpad.evidence.channels.identifier.model import load_model

    model = load_model(path)
    return {
        "file": path.name,
        "sees_labels": model.sees_labels,
        "hours": model.card["hours"],
        "recordings": len(model.card["recordings"]),
    }


def _refuse_training_drives(path: Path, segments: list[Segment]) -> None:
    """Raises ConfigError when the model was trained on any of the drives that it is judged by."""
    from skidpad.core.errors import ConfigError
    from skidpad.evidence.channels.identifier.model import load_model

    seen = load_model(path).trained_on()
    both = [s.name for s in segments if (s.route, s.context.get("seed", s.name)) in seen]
    if both:
        more = f" and {len(both) - 1} more" if len(both) > 1 else ""
        raise ConfigError(f"{path}: was trained on {both[0]}{more} of these recordings")


def _print_results(table: dict[str, object]) -> None:
    """Prints found, false and missed hazards with precision and recall, for the tolerance of 1 s."""
    from skidpad.evidence.channels.matching import percent

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
        typer.echo(f"{result['rules']} against {result['truth']} truth")
        for hazard, row in result["hazards"].items():
            typer.echo(
                f"  {hazard}: found {row['tp']}, false {row['fp']}, missed {row['fn']}; "
                f"precision {ratio(row, 'precision')}, recall {ratio(row, 'recall')}"
            )
