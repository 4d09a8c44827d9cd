"""Drives the same random runs with two trees of the source and names the first tick that differs.

    python tools/same_drives.py BEFORE/src AFTER/src --drives 300

For changes that may move no bit, such as faster kernels. Runs are on objects: configurations 0 to 4, four
profiles, three maps, up to 40 vehicles, every weather, and the shipped scenarios with their scripts. The exit
status is 1 when a drive differs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from msgspec import structs

from skidpad.campaign.cells.grip import Cross, cross, template
from skidpad.campaign.runs.run import run
from skidpad.core.courses import Roads
from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import SensorLevel, TrafficStart
from skidpad.physics.presets import all_presets
from skidpad.recording.run.log import RunLog
from skidpad.scenarios.shipped import NAMES
from skidpad.stack.configurations import functions_of

SCENARIOS = 0.25  # share of the runs
PROFILES = ("recommended", "recommended", "thesis_text", "thesis_listing", "preliminary")
MAPS = ("figure8", "figure8", "town", "motorway")
SNOW = "snow"  # only the physical grip model knows it


def draw_run(k: int) -> RunSpec:
    """Returns the k-th random run."""
    rng = np.random.default_rng(k)
    presets = all_presets()
    names = sorted(set(presets) - {SNOW})
    weather = presets[names[int(rng.integers(len(names)))]]
    seed = int(rng.integers(1, 1000))
    if rng.random() < SCENARIOS:
        scenario = NAMES[int(rng.integers(len(NAMES)))]
        chosen = Cross(scenarios=(scenario,), weather=(weather,))
        return structs.replace(cross(template(), chosen, range(seed, seed + 1))[0], duration=20.0)
    number = int(rng.integers(5))
    return RunSpec(
        driver=AdasDriver(label=str(number), functions=functions_of(number)),
        course=Roads(
            map=MAPS[int(rng.integers(len(MAPS)))],
            vehicles=int(rng.integers(41)),
            traffic=list(TrafficStart)[int(rng.integers(3))],
            allow_fewer=True,
        ),
        weather=weather,
        settings=load_profile(PROFILES[int(rng.integers(len(PROFILES)))], {}),
        sensors=SensorLevel.OBJECTS,
        seed=seed,
        duration=float(rng.uniform(15.0, 45.0)),
    )


def sum_ticks(log: RunLog) -> list[int]:
    """Returns a checksum of each tick: every actor, command, report and phase."""
    columns = [*log.ego, *log.applied, *log.requested, *log.report, log.supervision]
    rows = np.column_stack([np.asarray(c, dtype=np.float64) for c in columns])
    actors = np.concatenate([*(np.asarray(a) for a in log.actors), log.present], axis=1)
    mu = np.asarray(log.mu).reshape(len(rows), -1)
    parts = zip(rows, actors, mu, strict=True)
    return [crc32(m.tobytes(), crc32(a.tobytes(), crc32(r.tobytes()))) for r, a, m in parts]


def drive(k: int) -> dict[str, Any]:
    """Returns what a run left: checksums of its ticks, its events in words, its outcome."""
    found = run(draw_run(k))
    events = [repr(event) for event in found.log.events]
    return {"k": k, "ticks": sum_ticks(found.log), "events": events, "outcome": found.outcome}


def describe_difference(before: dict[str, Any], after: dict[str, Any]) -> str:
    """Returns where two records of one run part ways; empty when they are equal."""
    one, other = before["ticks"], after["ticks"]
    for tick, (a, b) in enumerate(zip(one, other, strict=False)):
        if a != b:
            return f"run {before['k']} differs from tick {tick} on"
    if len(one) != len(other):
        return f"run {before['k']} has {len(one)} ticks before and {len(other)} after"
    same = before["events"] == after["events"] and before["outcome"] == after["outcome"]
    return "" if same else f"run {before['k']} differs in its events or its outcome"


def drive_with(source: Path, first: int, count: int) -> Iterator[dict[str, Any]]:
    """Yields the records of runs driven by another process with this source."""
    call = [sys.executable, __file__, "--child", "--first", str(first), "--drives", str(count)]
    env = os.environ | {"PYTHONPATH": str(source)}
    with subprocess.Popen(call, env=env, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        for line in child.stdout:
            yield json.loads(line)


def main(words: Sequence[str] | None = None) -> int:
    """Compares all runs; prints each that differs, and a line on all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sources", nargs="*", type=Path, help="two folders src")
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--drives", type=int, default=300, help="how many runs")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args(words)
    if asked.child:
        for k in range(asked.first, asked.first + asked.drives):
            print(json.dumps(drive(k)), flush=True)
        return 0
    if len(asked.sources) != 2:
        parser.error(f"two folders are compared, got {len(asked.sources)}")
    before, after = (drive_with(source, asked.first, asked.drives) for source in asked.sources)
    differing, ticks, with_events, count = 0, 0, 0, 0
    for one, other in zip(before, after, strict=True):
        count, ticks = count + 1, ticks + len(one["ticks"])
        with_events += bool(one["events"])
        if words := describe_difference(one, other):
            differing += 1
            print(words)
    print(f"{count} runs, {with_events} with events, {ticks} ticks: {differing} differ")
    return 1 if differing or count < asked.drives else 0


if __name__ == "__main__":
    sys.exit(main())
