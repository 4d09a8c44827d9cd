"""Proofs that are too long for every change: driven one after the other, each with a dated line.

    python tools/nightly.py                  # all of them
    python tools/nightly.py --only fuzz soak # some
    python tools/nightly.py --list

A line of OUT/proofs.jsonl is written when a proof ends, so that a run that is stopped goes on where it
was: a proof that passed at this commit is not driven again unless `--again` asks for it. OUT/NAME.log
holds what it said. The table that is printed at the end is made from the newest line of each proof.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dated_lines

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Proof:
    """command: called in the project's folder. proves: in one sentence."""

    name: str
    command: tuple[str, ...]
    proves: str


PROOFS = (
    Proof(
        "fuzz",
        ("make", "fuzz"),
        "no reader is brought down by damaged files: 10^5 inputs each, in bounded time",
    ),
    Proof(
        "properties",
        (
            sys.executable,
            *("-m", "pytest", "-n", "2", "-m", "hypothesis", "--hypothesis-profile", "nightly"),
        ),
        "properties hold with twenty times the examples of CI",
    ),
    Proof(
        "coverage",
        (sys.executable, "tools/coverage_table.py", "--draws", "20000"),
        "printed intervals hold the truth given that they are printed: every cell with 20 000 draws",
    ),
    Proof(
        "soak-server",
        (sys.executable, "tools/soak_server.py", "--out", "out/nightly/soak"),
        "ten drives of 10^5 ticks with 50 cars of the Traffic Manager, map loads between (13.9 h of game "
        "time in one server): nothing hangs, memory stays",
    ),
    Proof(
        "soak-worker",
        (sys.executable, "tools/soak_worker.py", "--out", "out/nightly/soak"),
        "1000 runs in one worker: memory and open files stay, results equal those of a fresh worker",
    ),
    Proof(
        "channels",
        (
            sys.executable,
            *("tools/channels_campaign.py", "--out", "out/nightly/channels", "--hours", "50"),
        ),
        "the evaluation of the channels whole: driven, trained, validated and reported on seeds of its own",
    ),
    Proof(
        "first-readings",
        (sys.executable, "tools/first_readings.py"),
        "200 of 200 first readings after `listen` are of the first tick, for every kind of sensor",
    ),
    Proof(
        "monitor-hour",
        (sys.executable, "tools/monitor_hour.py", "--out", "out/nightly/monitor-hour"),
        "36 000 cycles judged while driving: median 0.5, 99.9 % 2.5, most 25 ms of processor time",
    ),
    Proof(
        "fleet-kills",
        (sys.executable, "tools/fleet_load.py", "--records", "20000", "--kills", "20"),
        "20 kills of the fleet's service at random moments: acknowledged ids are the stored ones",
    ),
    Proof(
        "fleet-hertz",
        (
            sys.executable,
            *("tools/fleet_load.py", "--vehicles=1000", "--hz=1", "--minutes=10"),
            *("--bytes=1000", "--kills=20"),
        ),
        "1000 vehicles report once a second for 10 min, 20 kills: acknowledged ids are the stored ones",
    ),
    Proof(
        "fleet-pages",
        (sys.executable, "tools/fleet_pages.py", "--rows", "10000000"),
        "the fleet's pages over ten million rows of indicators, each request a fresh query",
    ),
)


def commit() -> str:
    """The commit that is proved, with a mark when files differ from it."""
    told = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--exclude=*"]
    done = subprocess.run(told, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def drive(proof: Proof, out: Path) -> dict[str, Any]:
    """Drive one proof to its end; its line."""
    start = time.monotonic()
    log = out / f"{proof.name}.log"
    paths = [str(ROOT / "src"), os.environ.get("PYTHONPATH", "")]
    with log.open("w", encoding="utf-8") as file:
        done = subprocess.run(
            proof.command,
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(p for p in paths if p)},
            stdout=file,
            stderr=subprocess.STDOUT,
            check=False,
        )
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return {
        "name": proof.name,
        "passed": done.returncode == 0,
        "seconds": round(time.monotonic() - start, 1),
        "commit": commit(),
        "said": lines[-1] if lines else "",
    }


def latest(out: Path) -> dict[str, dict[str, Any]]:
    """The newest line of each proof."""
    return {line["name"]: line for line in dated_lines.read(out / "proofs.jsonl")}


def table(outcomes: dict[str, dict[str, Any]], proofs: tuple[Proof, ...]) -> str:
    """Markdown for docs/reliability.md."""
    lines = ["| proof | of what | ended | commit | took | load | outcome |", "|" + "---|" * 7]
    for proof in proofs:
        o = outcomes.get(proof.name)
        if o is None:
            cells = ("never", "", "", "", "not driven")
        else:
            word = "passed" if o["passed"] else "FAILED"
            took = f"{o['seconds']:.0f} s"
            cells = (o["when"][:16], o["commit"], took, f"{o['load']:g}", f"{word}: {o['said']}")
        lines.append(f"| {proof.name} | {proof.proves} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main(proofs: tuple[Proof, ...] = PROOFS) -> int:
    """Drive what is asked for; 1 when a proof failed."""
    parser = argparse.ArgumentParser(description="Proofs that are too long for every change.")
    parser.add_argument("--only", nargs="+", choices=[p.name for p in proofs])
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "nightly")
    parser.add_argument("--again", action="store_true", help="also what passed at this commit")
    parser.add_argument("--list", action="store_true")
    asked = parser.parse_args()
    chosen = tuple(p for p in proofs if not asked.only or p.name in asked.only)
    asked.out.mkdir(parents=True, exist_ok=True)
    now = commit()
    for proof in chosen if not asked.list else ():
        done = latest(asked.out).get(proof.name)
        if done and done["passed"] and done["commit"] == now and not asked.again:
            continue
        print(f"{proof.name}: {proof.proves}", flush=True)
        dated_lines.add(asked.out / "proofs.jsonl", drive(proof, asked.out))
    outcomes = latest(asked.out)
    print(table(outcomes, chosen))
    return 1 if any(not outcomes[p.name]["passed"] for p in chosen if p.name in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main())
