"""An hour of the monitor beside the drive: 36 000 cycles against their gates.

    python tools/monitor_hour.py --out out/monitor-hour           # as fast as it goes
    python tools/monitor_hour.py --out out/monitor-hour --live    # held at real time

Six routes of ten minutes with two channels; the monitor judges every cycle in a process of its own. The
gates are of its processor time per cycle, the writing of finished records apart (DC-65): median 0.5 ms,
99.9 % 2.5 ms, most 25 ms. Wall time is told beside them, and each cycle that came over 25 ms after its
last word has its cause: only `--live` says something by it, as otherwise a drive hands over cycles
faster than the clock. 1 when a gate is missed.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl

from skidpad.evidence.channels.timing import delay_sentence, late_cycles

ROOT = Path(__file__).resolve().parents[1]
SEED = 77  # of no evaluation
GATES = {"median": 0.5, "99.9 %": 2.5, "most": 25.0}  # ms of processor time


def main() -> int:
    """Drive, then say what the cycles took."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the drives")
    parser.add_argument("--hours", type=float, default=1.0, help="of all routes together")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--live", action="store_true", help="hold the drives at real time")
    asked = parser.parse_args()
    words = ["--hours", asked.hours, "--workers", asked.workers, "--seed", SEED, "--out", asked.out]
    words += ["--route", "all", "--resume", "--monitor", *(["--live"] if asked.live else [])]
    call = [sys.executable, "-m", "skidpad", "channels", "drive", *map(str, words)]
    subprocess.run(call, env=os.environ | {"PYTHONPATH": str(ROOT / "src")}, check=True)
    found = sorted(asked.out.glob("*/*.monitor/timing.parquet"))
    timing = pl.concat([pl.read_parquet(path) for path in found], how="diagonal_relaxed")
    return 0 if told(timing) else 1


def told(timing: pl.DataFrame) -> bool:
    """Print what cycles took and which came late; whether every gate holds."""
    own, writing = timing["total"].to_numpy(), timing["writing"].to_numpy()
    took = dict(zip(GATES, (np.median(own), np.percentile(own, 99.9), own.max()), strict=True))
    for row in late_cycles(timing).head(20).iter_rows(named=True):
        print(", ".join(f"{name} {value}" for name, value in row.items()))
    print(delay_sentence(timing))
    records = writing[writing > GATES["99.9 %"]]
    print(f"{len(records)} cycles wrote a record beside: at most {writing.max():.1f} ms")
    said = ", ".join(f"{name} {took[name]:.2f} ({gate:g})" for name, gate in GATES.items())
    print(f"{len(own)} cycles; ms of processor time each, and the gate: {said}")
    return all(took[name] <= gate for name, gate in GATES.items())


if __name__ == "__main__":
    sys.exit(main())
