"""Checks and times the driving of runs on a graphics card, and writes what it finds as JSON.

python tools/card_check.py OUT.json [--runs N] [--seconds S] [--vehicles V] [--workers W] [--cores C]

1. start: runs of configurations 0 to 4 and two weathers for 50 ticks, and what their radars saw, against
   the same runs on the CPU.
2. outcomes of runs of configuration 2 to their end: all on the card, an eighth on the CPU, and how those that
   both have driven differ in the mean. More than four standard errors are not chance.
3. ticks/s of the same runs on the card, with supervisor, respawn and log; set-up, judging, compiling apart.
4. finished, judged runs per minute: on the card with one and W processes, on C cores without it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

import skidpad
from skidpad.campaign.runs.card import ROWS, Stages, drive_on_card
from skidpad.campaign.runs.drive import describe
from skidpad.campaign.runs.many import DEFAULTS
from skidpad.campaign.runs.run import Run
from skidpad.core.kernels.card import require_card

START = 50  # ticks that are promised
NEAR = 1e-9
RADAR_NEAR = 1e-4  # its echoes are in single precision
RADAR = ("radar_pre", "radar_velocity", "radar_points")  # of the report
SEED = 1000


def list_runs(
    count: int, seconds: float, vehicles: int, configs: tuple[int, ...], first: int = SEED
) -> list[dict[str, Any]]:
    """Returns descriptions of runs on figure8, as `drive_many` takes them."""
    weathers = ("clear-noon", "rain-noon")
    return [
        {
            "stack": configs[k % len(configs)], "seed": first + k, "duration": seconds,
            "vehicles": vehicles, "sensors": "objects", "weather": weathers[k // len(configs) % 2],
        }
        for k in range(count)
    ]  # fmt: skip


def judge(run: Run) -> dict[str, float]:
    """Returns what a run is judged by here: how far the ego came, contacts, and supervised ticks."""
    log = run.log
    x, y = log.actors.x[:, 0].astype(float), log.actors.y[:, 0].astype(float)
    steps = np.hypot(np.diff(x), np.diff(y))
    return {
        "ticks": len(log),
        "quick": run.quick_ticks,
        "km": float(steps[steps < 5.0].sum()) / 1000.0,
        "contacts": len(log.contacts),
        "supervised": int((log.supervision != 0).sum()),
        "mean_speed": float(log.ego.speed.mean()),
    }


def start_of(run: Run) -> dict[str, Any]:
    """Returns the first ticks of a run's log."""
    log = run.log
    own = {f"ego.{n}": getattr(log.ego, n)[:START] for n in ("x", "y", "yaw", "speed")}
    radar = {f"radar.{n}": np.nan_to_num(getattr(log.report, n)[:START], nan=-1.0) for n in RADAR}
    asked = {
        f"asked.{n}": getattr(log.requested, n)[:START] for n in ("throttle", "brake", "steer")
    }
    return own | radar | asked | {"quick": run.quick_ticks}


def compare_starts(descriptions: list[dict[str, Any]]) -> dict[str, Any]:
    """Returns the largest differences of the first ticks between card and CPU."""
    card = skidpad.drive_many(descriptions, device="cuda", judge=start_of)
    cpu = skidpad.drive_many(descriptions, judge=start_of)
    names = [name for name in card[0] if name != "quick"]
    largest = {
        name: max(float(np.abs(a[name] - b[name]).max()) for a, b in zip(card, cpu, strict=True))
        for name in names
    }
    return {
        "runs": len(card), "ticks": START, "largest": largest,
        "on_card": int(sum(a["quick"] for a in card)),
        "within_1e-9": all(
            error <= (RADAR_NEAR if name.startswith("radar.") else NEAR)
            for name, error in largest.items()
        ),
    }  # fmt: skip


def compare_outcomes(
    card: list[dict[str, float]], cores: list[dict[str, float]]
) -> dict[str, dict[str, float]]:
    """Returns, of runs that both have driven, the mean difference card - cores and its standard errors."""
    found = {}
    for name in cores[0]:
        more = np.array([a[name] - b[name] for a, b in zip(card, cores, strict=False)])
        error = float(more.std(ddof=1) / len(more) ** 0.5)
        found[name] = {"more_on_card": float(more.mean()), "standard_error": error}
    return found


def sum_up(judged: list[dict[str, float]]) -> dict[str, Any]:
    """Returns the distribution of what runs are judged by: mean, standard error and quartiles."""
    found: dict[str, Any] = {"runs": len(judged)}
    for name in judged[0]:
        values = np.array([one[name] for one in judged])
        found[name] = {
            "mean": float(values.mean()),
            "standard_error": float(values.std(ddof=1) / len(values) ** 0.5),
            "quartiles": np.percentile(values, (25, 50, 75)).tolist(),
        }
    return found


def time_card(descriptions: list[dict[str, Any]]) -> tuple[dict[str, Any], list[dict[str, float]]]:
    """Drives runs on the card in this process; returns ticks/s, the share of each stage, and judgements."""
    described = [describe(**{**DEFAULTS, **one}) for one in descriptions]
    stages = Stages()
    begin = perf_counter()
    judged = drive_on_card(described, judge, stages)
    wall = perf_counter() - begin
    loop = sum(stages.seconds[name] for name in ("card", "log", "copying", "events"))
    return {
        "runs": len(judged), "wall_s": wall, "stages_s": stages.seconds, "launches": stages.launches,
        "events": stages.events, "ticks_on_card": stages.ticks,
        "ticks_per_s": sum(one["ticks"] for one in judged) / loop,
        "ticks_per_s_of_the_kernel": stages.ticks / max(stages.seconds["card"], 1e-9),
        "runs_per_min": 60.0 * len(judged) / wall,
    }, judged  # fmt: skip


def time_many(
    descriptions: list[dict[str, Any]], card: list[dict[str, float]], **how: Any
) -> dict[str, Any]:
    """Returns runs per minute end to end, and how outcomes differ from the card's."""
    begin = perf_counter()
    judged = skidpad.drive_many(descriptions, judge=judge, **how)
    wall = perf_counter() - begin
    return {
        **how, "runs": len(judged), "wall_s": wall, "runs_per_min": 60.0 * len(judged) / wall,
        "judged": sum_up(judged), "against_card": compare_outcomes(card, judged),
    }  # fmt: skip


def name_card() -> str:
    """Returns the card's name and driver."""
    query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    return subprocess.run(query, capture_output=True, text=True, check=True).stdout.strip()


def parse(argv: list[str]) -> argparse.Namespace:
    """Returns the arguments of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--runs", type=int, default=4096)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--vehicles", type=int, nargs="+", default=[20, 2])
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--cores", type=int, default=16)
    parser.add_argument("--commit", default="")
    return parser.parse_args(argv)


def main(argv: list[str]) -> int:
    """Drives all that is asked for, and writes after each part what is known by then."""
    asked = parse(argv)
    require_card()
    found: dict[str, Any] = {
        "date": datetime.now(tz=timezone.utc).date().isoformat(), "card": name_card(), "commit": asked.commit,
        "rows_of_a_launch": ROWS, "seconds": asked.seconds,
    }  # fmt: skip

    def note(name: str, value: object) -> None:
        found[name] = value
        asked.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        print(name, json.dumps(value)[:1500], flush=True)

    configs = (0, 1, 2, 3, 4)
    note("start", compare_starts(list_runs(40, 10.0, 20, configs, 1)))
    for vehicles in asked.vehicles:
        runs = list_runs(asked.runs, asked.seconds, vehicles, (2,))
        timed, judged = time_card(runs)
        note(f"card_{vehicles + 1}_vehicles", timed | {"judged": sum_up(judged)})
        few = runs[: max(asked.runs // 8, 16)]
        note(f"cores_{vehicles + 1}_vehicles", time_many(few, judged, workers=asked.cores))
        if asked.workers > 1:
            shared = time_many(runs, judged, workers=asked.workers, device="cuda")
            note(f"card_shared_{vehicles + 1}_vehicles", shared)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
