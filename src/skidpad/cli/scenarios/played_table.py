"""What `skidpad play` prints at its end: a table of at most 80 columns, the answer, what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote

from skidpad.core.geometry import kmh_from_mps
from skidpad.evidence.play_verdicts import PlayVerdict
from skidpad.report.play.page import answer, criterion, in_order
from skidpad.report.play.runs import CSV, Played, PlayRun

WIDTHS = (26, 14, 10, 6, 6, 6, 6)  # with a space between columns 80
HEADS = ("scenario", "weather", "verdict", "gap", "TTC", "decel", "hit")
UNITS = ("", "", "", "m", "s", "m/s2", "km/h")
LEGEND = "gap, TTC: least; decel: required of the follower; hit: closing speed of contact"
BIG = 999  # beyond which a number says no more
ROWS, REASONS = 60, 10  # shown at most


def played_text(played: Played, page: Path) -> str:
    """Returns the text for the terminal: table, reasons, criterion, answer and next command."""
    runs = in_order(played.runs)
    lines = [_line(HEADS), _line(UNITS), *(_line(_cells(run)) for run in runs[:ROWS])]
    if len(runs) > ROWS:
        lines.append(f"... and {len(runs) - ROWS} more in {played.out / CSV}")
    lines += [LEGEND, "", *_reasons(runs), criterion(played), answer(played)]
    lines += [f"page: {page}", f"table: {played.out / CSV}"]
    following = _next_command(runs)
    return "\n".join([*lines, f"Next: {following}"] if following else lines)


def _line(cells: Sequence[str]) -> str:
    """Returns a row of the table as text, names fitted and numbers to the right."""
    names = [_pad_text(cell, width) for cell, width in zip(cells[:3], WIDTHS, strict=False)]
    numbers = [f"{cell:>{width}}" for cell, width in zip(cells[3:], WIDTHS[3:], strict=True)]
    return " ".join([*names, *numbers]).rstrip()


def _pad_text(text: str, width: int) -> str:
    """Returns text padded to the width; what is too long loses its middle, as names differ at their ends."""
    if len(text) > width:
        half = (width - 2) // 2
        text = f"{text[: width - 2 - half]}..{text[-half:]}"
    return f"{text:<{width}}"


def _cells(run: PlayRun) -> list[str]:
    """Returns the cells of a run: scenario, weather, verdict, gap in m, TTC in s, m/s², km/h."""
    hit = None if run.contact is None else kmh_from_mps(run.contact[2])
    numbers = [
        (run.least("min_gap_m"), ".1f"),
        (run.least("min_ttc_s"), ".2f"),
        (run.most("max_required_mps2"), ".1f"),
        (hit, ".0f"),
    ]
    told = ["-" if value is None else _number(value, spec) for value, spec in numbers]
    weather = f"{run.weather} dry" if run.friction == "original" else run.weather
    return [run.scenario, weather, run.verdict.value, *told]


def _number(value: float, spec: str) -> str:
    """Returns a number in the format, ">BIG" from BIG on."""
    return format(value, spec) if value < BIG else f">{BIG}"


def _reasons(runs: Sequence[PlayRun]) -> list[str]:
    """Returns the reasons of the first REASONS runs that have any, and how many more have."""
    told = [
        f"{run.verdict.value}: {run.scenario}: {'; '.join(run.judged.reasons)}"
        for run in runs
        if run.judged.reasons
    ]
    more = [f"... and {len(told) - REASONS} more on the page"] if len(told) > REASONS else []
    return [*told[:REASONS], *more]


def _next_command(runs: Sequence[PlayRun]) -> str:
    """Returns the command that shows most of the worst run; "" where no run has a folder."""
    first = next((run for run in runs if run.folder is not None), None)
    if first is None:
        return ""
    folder = quote(str(first.folder))
    if first.verdict is PlayVerdict.FAILED and first.contact is not None:
        begin, end = max(first.contact[0] - 3.0, 0.0), first.contact[0] + 0.5
        return f"skidpad rerun {folder} --from {begin:.1f} --to {end:.1f}"
    return f"skidpad replay {folder}"
