"""The evaluation of the channels, whole: drive, train, validate, report, and the tables of its pages.

    python tools/channels_campaign.py --out out/channels --hours 50        # about 1.5 h on two cores
    python tools/channels_campaign.py --out out/channels --hours 50 --publish
    python tools/channels_campaign.py --only rules --out out/channels --workers 16 --stop-after 540
    python tools/channels_campaign.py --only rules --table further --out out/channels --publish

Parts on seeds of their own, each on every route. `train` and `validate` are driven in the route's own
weather, by day, by night, in rain and on ice, among natural and among risky drivers; `report` the same
without ice, which is a part of its own: there the ego, which knows no grip, tailgates. Trees are fitted
on `train`, their limits chosen on routes that the fold did not see; `validate` is for looking, `report`
and `ice` are looked at once. Then the arbiter and each channel alone drive the same natural hours,
for redundancy. At last every rule and every variant that was tried is judged on hours of their own
(`monitor_drives`), of which only rows of counts stay. What is done is not done again, so a campaign that
was stopped goes on; `--only hazards`, `--only redundancy` or `--only rules` drives one of the three.
`--publish` writes docs/results/channels and the tables of docs/channels-evaluation.md and
docs/channels-tables.md, and says what was driven at which commit; with `--only rules --stop-after 0` it
publishes the rows that are there.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import channels_tables
import monitor_drives
from skidpad.campaign.recipes.channels import SEEDS_EACH
from skidpad.evidence.channels.redundancy import compare_drivers
from skidpad.recording.channels.drives import read_outcomes

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results" / "channels"
CONDITIONS, ICE = "own,day,night,rain", "ice"
JUDGED = ("validate", "report", "ice")
DRIVERS = ("arbiter", "lav_like", "tfuse_like")
KEPT = (
    "hours",
    "segments",
    "results",
    "precision_recall",
    "truths_agree",
    "unseen_by_all_channels",
)


@dataclass(frozen=True)
class Part:
    """name: its folder. seed: `--seed` of its drives, never used before. share: of the hours asked for."""

    name: str
    seed: int
    share: float
    conditions: str
    strata: str = "natural,risky"


PARTS = (
    Part("train", 61, 0.2, f"{CONDITIONS},{ICE}"),
    Part("validate", 62, 0.05, f"{CONDITIONS},{ICE}"),
    Part("report", 63, 0.4, CONDITIONS),
    Part("ice", 64, 0.35, ICE, "natural"),
)
HAZARDS, REDUNDANCY, RULES = "hazards", "redundancy", "rules"
FURTHER = "further"  # table of the hours that were registered for one variant, always driven whole
HOURS_EACH = 6.0  # of the arbiter and of each channel alone
SEED_OF_REDUNDANCY = 65
UNFINISHED = 3  # exit code: --stop-after came first


def main(words: Sequence[str] | None = None) -> int:
    """Everything; the exit code of what failed first."""
    asked = _asked(words)
    asked.out.mkdir(parents=True, exist_ok=True)
    if asked.only in (None, HAZARDS):
        _hazards(asked, asked.out)
    if asked.only in (None, REDUNDANCY):
        for driver in DRIVERS:
            folder = asked.out / REDUNDANCY / driver
            _drive(folder, asked, SEED_OF_REDUNDANCY, HOURS_EACH, drive_by=driver)
    is_whole = asked.only not in (None, RULES) or _rules(asked)
    if asked.publish:
        publish(asked.out, asked.hours, only=asked.only, table=asked.table)
    return 0 if is_whole else UNFINISHED


def _rules(asked: argparse.Namespace) -> bool:
    """Drive the hours of the rules; returns whether all are driven."""
    folder, parts = _hours_of(asked.table, asked.out, asked.hours)
    is_whole = monitor_drives.drive(folder, parts, asked.workers, asked.stop_after)
    if not is_whole:
        print("Not all hours are driven; the same command goes on.", flush=True)
    return is_whole


def _hours_of(table: str, out: Path, hours: float) -> tuple[Path, list[monitor_drives.Part]]:
    """Returns the folder of a table's rows, and the parts that are driven for it."""
    if table == FURTHER:
        return out / FURTHER, monitor_drives.registered_parts(None, FURTHER)
    return out / RULES, monitor_drives.registered_parts(hours)


def _hazards(asked: argparse.Namespace, out: Path) -> None:
    for part in PARTS:
        hours = asked.hours * part.share
        told = {"strata": part.strata, "conditions": part.conditions}
        _drive(out / part.name, asked, part.seed, hours, **told)
    model = out / "model.npz"
    if not model.exists():
        _skidpad("channels", "train", out / "train", "--out", model, "--workers", asked.workers)
    for name in JUDGED:
        learned = ("--model", model) if model.exists() else ()
        _skidpad("channels", "evaluate", out / name, "--workers", asked.workers, *learned)


def _asked(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the campaign")
    parser.add_argument(
        "--hours",
        type=float,
        default=50.0,
        help="simulated hours: of the parts of `hazards`, and of those of `rules`",
    )
    parser.add_argument(
        "--only", choices=(HAZARDS, REDUNDANCY, RULES), help="drive and publish this alone"
    )
    parser.add_argument(
        "--stop-after", type=float, metavar="S", help="begin no drive of the rules after so many s"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--table",
        choices=(RULES, "variants", FURTHER),
        default=RULES,
        help="of the page, for the rules' hours",
    )
    parser.add_argument("--publish", action="store_true", help="write results and page of docs")
    return parser.parse_args(words)


def _drive(
    folder: Path, asked: argparse.Namespace, seed: int, hours: float, **options: str
) -> None:
    more = [w for name, value in options.items() for w in (f"--{name.replace('_', '-')}", value)]
    _skidpad(
        "channels", "drive", "--route", "all", "--seed", seed, "--out", folder, "--resume",
        "--hours", hours, "--workers", asked.workers, *more,
    )  # fmt: skip


def _skidpad(*words: object) -> None:
    """A command of ours; what it says goes to the terminal."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    call = [sys.executable, "-m", "skidpad", *map(str, words)]
    done = subprocess.run(call, env=environment, check=False)
    if done.returncode:
        sys.exit(done.returncode)


def publish(
    out: Path, hours: float, results: Path = RESULTS, only: str | None = None, table: str = RULES
) -> None:
    """Copy what the page needs, and write its tables anew. table: of the rules."""
    results.mkdir(parents=True, exist_ok=True)
    if only in (None, HAZARDS):
        for name in JUDGED:
            judged = json.loads((out / name / "evaluation.json").read_text(encoding="utf-8"))
            _write(results / f"{name}.json", {"model": judged["model"], "strata": _kept(judged)})
        seeds = {p.name: p.seed * SEEDS_EACH for p in PARTS}
        _write(results / "run.json", _driven() | {"hours_asked": hours, "first_seed": seeds})
    if only in (None, REDUNDANCY):
        about = _driven() | {"first_seed": SEED_OF_REDUNDANCY * SEEDS_EACH}
        _write(results / "redundancy.json", about | {"drivers": _outcomes(out / REDUNDANCY)})
    if only in (None, RULES):
        folder, parts = _hours_of(table, out, hours)
        rows = monitor_drives.read_rows(folder / monitor_drives.ROWS)
        about = {name: value for name, value in _driven().items() if name != "processors"}
        _write(results / f"{table}.json", about | monitor_drives.summary(parts, rows))
        if table != FURTHER:
            (results / "ways.json").write_text(json.dumps(monitor_drives.ways(parts, rows)) + "\n")
    channels_tables.main([])


def _driven() -> dict[str, Any]:
    today = datetime.now(timezone.utc).date().isoformat()
    return {"commit": _commit(), "date": today, "processors": os.cpu_count()}


def _kept(table: dict[str, Any]) -> dict[str, Any]:
    """Per stratum what the tables are made of, at the tolerance that counts."""
    out = {}
    for stratum, part in table["strata"].items():
        kept = {name: part[name] for name in KEPT}
        kept["results"] = [r for r in part["results"] if r["tolerance_s"] == 1.0]
        kept["true_by_route"] = _true_by_route(part["segment_table"])
        out[stratum] = kept
    return out


def _true_by_route(rows: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    out: dict[str, dict[str, float]] = {}
    for row in rows:
        total = out.setdefault(row["route"], {"hours": 0.0})
        total["hours"] += row["hours"]
        for name in (n for n in row if n.startswith("sim_")):
            total[name] = total.get(name, 0.0) + row[name]
    return dict(sorted(out.items()))


def _outcomes(folder: Path) -> list[dict[str, Any]]:
    """Per driver what became of the drives that all have driven."""
    return [
        {
            "drive_by": row.drive_by,
            "segments": row.segments,
            "hours": row.hours,
            "km": row.km,
            "rates": {
                event: [rate.events, rate.rate, *(rate.interval or (None, None))]
                for event, rate in row.rates.items()
            },
        }
        for row in compare_drivers(read_outcomes([folder]))
    ]


def _commit() -> str:
    call = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--exclude=*"]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def _write(path: Path, value: Any) -> None:
    path.write_text(json.dumps(value, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
