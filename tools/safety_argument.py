"""Writes the safety argument of the speed envelope: `python tools/safety_argument.py`.

Every claim is supported, undeveloped (no evidence, or not driven yet) or refuted. A goal is what the weakest
of its children is; a refuted one stays refuted whatever stands beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any

import polars as pl
import yaml

import result_envelope as proof
from envelope_power import ENOUGH, LEVEL, factor_bound

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results"
ARGUMENT, PAGE = RESULTS / "envelope-argument.yaml", ROOT / "docs" / "envelope-safety.md"
ESTIMATES = "envelope-estimates/estimates.csv"
LEAST, SPEED_SHARE, TOO_HIGH = 3.0, 0.85, 0.05


class Status(str, Enum):
    """What stands of a claim; the later, the worse."""

    SUPPORTED = "supported"
    UNDEVELOPED = "undeveloped"
    REFUTED = "refuted"


MARKS = {Status.SUPPORTED: "🟩", Status.UNDEVELOPED: "⬜", Status.REFUTED: "🟥"}
WORST = tuple(Status)


def estimate_on(results: Path, is_patchy: bool) -> Status:
    """Judges the share of the way on which the estimate is 1.3 times too high, over all laws."""
    if not (results / ESTIMATES).is_file():
        return Status.UNDEVELOPED
    rows = pl.read_csv(results / ESTIMATES)
    rows = rows.filter((pl.col("surface") == "patches of ice") == is_patchy)
    return Status.SUPPORTED if (rows["too_high"] <= TOO_HIGH).all() else Status.REFUTED


def _slippery(results: Path, name: str) -> list[pl.DataFrame] | None:
    """Returns the runs of one driver by map in rain, snow and ice; None: not driven everywhere."""
    found = []
    for folder in (results / map_name for map_name in proof.MAPS):
        drivers = proof.read_drivers(folder) if (folder / "results.parquet").is_file() else {}
        if name not in drivers:
            return None
        found.append(proof.on_surfaces(drivers[name], proof.SLIPPERY))
    return found


def fewer_events_than_bare(results: Path) -> Status:
    """Judges the bound of the factor between bare stack and envelope."""
    bare, governed = (_slippery(results, name) for name in (proof.BARE, proof.ENVELOPE))
    if bare is None or governed is None:
        return Status.UNDEVELOPED
    all_bare, all_governed = (pl.concat(t, how="diagonal") for t in (bare, governed))
    if proof.events(all_bare) < ENOUGH:
        return Status.UNDEVELOPED
    bound = factor_bound(proof.events(all_bare), proof.events(all_governed))
    bound *= proof.way_ratio(all_bare, all_governed)
    return Status.SUPPORTED if bound >= LEAST else Status.REFUTED


def fewer_events_than_table(results: Path) -> Status:
    """Judges whether the envelope has fewer events per km than the table, paired by seed of a map."""
    rival, governed = (_slippery(results, name) for name in (proof.TABLE, proof.ENVELOPE))
    if rival is None or governed is None:
        return Status.UNDEVELOPED
    return Status.SUPPORTED if proof.fewer_by_seed(rival, governed) < LEVEL else Status.REFUTED


def speed_of_true_grip(results: Path) -> Status:
    """Judges the mean speed in each weather against the one with true grip."""
    true, governed = (_slippery(results, n) for n in (proof.RIVALS["oracle"], proof.ENVELOPE))
    if true is None or governed is None:
        return Status.UNDEVELOPED
    speeds = [
        pl.concat(t, how="diagonal").group_by("weather").agg(pl.col("mean_speed_kmh").mean())
        for t in (true, governed)
    ]
    both = speeds[0].join(speeds[1], on="weather", suffix="_envelope")
    fast = both["mean_speed_kmh_envelope"] >= SPEED_SHARE * both["mean_speed_kmh"]
    return Status.SUPPORTED if fast.all() else Status.REFUTED


CHECKS: dict[str, Callable[[Path], Status]] = {
    "estimate_on_surfaces": lambda results: estimate_on(results, False),
    "estimate_on_patches": lambda results: estimate_on(results, True),
    "fewer_events_than_bare": fewer_events_than_bare,
    "fewer_events_than_table": fewer_events_than_table,
    "speed_of_true_grip": speed_of_true_grip,
}


def has_test(name: str) -> bool:
    """Tells whether a test of that name stands in its file."""
    file, _, test = name.partition("::")
    path = ROOT / file
    return path.is_file() and f"def {test}(" in path.read_text(encoding="utf-8")


def status_of(node: dict[str, Any], results: Path = RESULTS) -> Status:
    """Returns what stands of a claim and all below it."""
    if "check" in node:
        return CHECKS[node["check"]](results)
    if "test" in node:
        return Status.SUPPORTED if has_test(node["test"]) else Status.REFUTED
    children = [status_of(child, results) for child in node.get("children", ())]
    return max(children, key=WORST.index) if children else Status.UNDEVELOPED


def write_node(node: dict[str, Any], results: Path, depth: int = 0) -> str:
    """Returns the lines of a claim and of all below it."""
    status = status_of(node, results)
    text = node.get("claim") or f"*Argument: {node['strategy']}*"
    evidence = ""
    if "test" in node:
        evidence = f" Evidence: test `{node['test'].partition('::')[2]}`."
    if "check" in node:
        evidence = f" Evidence: results, `{node['check']}`."
    line = f"{'    ' * depth}* {MARKS[status]} **{node['id']}** {text}, {status.value}.{evidence}\n"
    if "counter" in node:
        line += f"{'    ' * (depth + 1)}* Against it: {node['counter']}.\n"
    return line + "".join(
        write_node(child, results, depth + 1) for child in node.get("children", ())
    )


def write_page(results: Path = RESULTS) -> str:
    """Returns docs/envelope-safety.md."""
    argument = yaml.safe_load(ARGUMENT.read_text(encoding="utf-8"))
    top = status_of(argument, results)
    triggers = "".join(f"* {line}\n" for line in argument["triggers"])
    return (
        f"# Safety argument of the speed envelope\n\n**The top claim is {top.value}.** It is made in Goal "
        "Structuring Notation from\n`docs/results/envelope-argument.yaml` and the committed results by "
        "`python tools/safety_argument.py`.\n\n🟩 supported, ⬜ undeveloped: no evidence or not driven yet, "
        "🟥 refuted by a result. A goal is what its weakest child is.\n\n"
        f"{write_node(argument, results)}\n## Triggering conditions\nConditions in the sense of ISO 21448 "
        f"under which the function may not be enough:\n\n{triggers}"
    )


if __name__ == "__main__":
    PAGE.write_text(write_page(), encoding="utf-8")
