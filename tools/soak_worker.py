"""Many runs in one worker: it must not grow, keep files open, or come to other results.

    python tools/soak_worker.py --runs 1000

OUT/worker.jsonl holds memory and open files after each tenth of the runs. Ten seeds take turns, so each
result is compared with the first of its seed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

from msgspec import structs

import dated_lines
from processes import memory_mb
from skidpad.campaign.runs.run import run
from skidpad.campaign.workers.worker import Job, Worker
from skidpad.core.courses import Roads
from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.recording.run.log_files import log_hash
from skidpad.stack.configurations import functions_of

SEEDS = 10
LIMIT_S = 900.0  # of a run: the first compiles kernels
GROWTH_MB = 100.0  # after the first tenth


def one_run(seed: int) -> str:
    """A short drive; the hash of its log."""
    spec = RunSpec(
        driver=AdasDriver(label="2", functions=functions_of(2)),
        course=Roads(vehicles=10),
        weather=find_weather("rain-noon"),
        sensors=SensorLevel.OBJECTS,
        duration=5.0,
    )
    return log_hash(run(structs.replace(spec, seed=seed)).log)


def result(worker: Worker, k: int) -> tuple[str, str]:
    """The hash of one run, or what went wrong."""
    worker.give(Job(str(k), one_run, k % SEEDS, LIMIT_S))
    while (finished := worker.collect()) is None:
        time.sleep(0.01)
    return finished.value or "", finished.detail


def soak(runs: int, out: Path) -> list[str]:
    """Drive them all; the faults."""
    worker = Worker()
    hashes: dict[int, str] = {}
    process = worker.process.pid
    assert process is not None
    seen: list[tuple[float, int]] = []
    faults: list[str] = []
    try:
        for k in range(runs):
            found, wrong = result(worker, k)
            if wrong:
                return [f"run {k}: {wrong}"]
            if hashes.setdefault(k % SEEDS, found) != found:
                faults.append(f"run {k}: another result than run {k % SEEDS}")
            if (k + 1) % max(1, runs // 10) == 0:
                seen.append((memory_mb(process), len(os.listdir(f"/proc/{process}/fd"))))
                line = {"runs": k + 1, "memory_mb": seen[-1][0], "files": seen[-1][1]}
                dated_lines.add(out / "worker.jsonl", line)
    finally:
        worker.dismiss()
    first, last = seen[0], seen[-1]
    if last[0] - first[0] > GROWTH_MB or last[1] > first[1]:
        faults.append("it grew")
    print(
        f"{runs} runs in one worker: {first[0]:.0f} MB and {first[1]} files after the first tenth, "
        f"{last[0]:.0f} MB and {last[1]} files at the end"
    )
    return faults


def main() -> int:
    """1 when anything went wrong."""
    parser = argparse.ArgumentParser(description="Many runs in one worker.")
    parser.add_argument("--out", type=Path, default=Path("out/soak"))
    parser.add_argument("--runs", type=int, default=1000)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    faults = soak(asked.runs, asked.out)
    print("\n".join(faults) or "no fault")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
