"""Choose the scenarios' values in the open: candidates, tuning seeds, a criterion (decision X-8).

`python tools/scenario_tuning.py [scenario ...]` drives every candidate on dry road with original
friction, as a campaign, and prints one row each. No weather and no reduced friction enters; what the
rows were used for stands in docs/grip.md.
"""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import polars as pl

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.grip import template
from skidpad.campaign.cells.matrix import TUNING_SEEDS
from skidpad.campaign.recipes.grip import warm_up
from skidpad.campaign.recipes.recipe import Driven, Recipe
from skidpad.campaign.runs.folder import Stopwatch, last_line
from skidpad.campaign.runs.run import run
from skidpad.campaign.workers.pool import local
from skidpad.core.courses import Scenario
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.run import Friction, RunSpec
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.grip.scores import npc_contact_row
from skidpad.physics.presets import preset
from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns, metric, read_results
from skidpad.scenarios.shipped import NAMES
from skidpad.scenarios.variation import (
    CUT_IN,
    CutIn,
    drawn_parameters,
    drawn_skill,
    variant_parameters,
)

SEEDS = TUNING_SEEDS[:30]
FRESH_SEEDS = TUNING_SEEDS[80:180]  # no part in the choice
BASELINE = "rain_0"
SPEEDS_KMH = (50.0, 80.0, 100.0)
HEADWAY = 1.26  # s from centre to centre, 1 s between bumpers at 80 km/h
DECELERATIONS = (4.0, 6.0, 8.0)  # m/s^2: brisk, hard, emergency
MERGE_DISTANCES = (1.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0)  # m
GHOST_SPEEDS = (22.0, 24.0, 26.0)  # m/s
SWERVE_TIMES = (1.5, 2.5)  # s
START = 100.0  # m, where the ego starts


@dataclass(frozen=True, slots=True)
class Candidate:
    """Nominal values over those of the file."""

    scenario: str
    values: Mapping[str, float]
    cutin: CutIn = CutIn.FIXED


@dataclass(frozen=True, slots=True)
class Trial:
    """One run: a candidate with a seed."""

    candidate: Candidate
    number: int  # of the candidate among those of its scenario
    seed: int

    @property
    def name(self) -> str:
        """Name of the task: candidate and seed."""
        return f"{self.candidate.scenario}-{self.number:02d}-{self.seed:06d}"

    @property
    def deadline_s(self) -> float:
        """Wall time after which the run counts as hanging."""
        return tuning_run(self.candidate, self.seed).deadline_s

    def to_identity(self) -> dict[str, Any]:
        """Everything that decides the run, as plain data."""
        return tuning_run(self.candidate, self.seed).to_identity()


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialKey:
    """Which run a row is about, and how it ended."""

    scenario: str
    number: int
    cutin: str
    values: str
    seed: int
    outcome: str  # core.Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialMetrics:
    """What the choice goes by."""

    completed: bool | None = metric("no accident", "X-8")
    triggered: bool | None = metric("every event of the scenario began", "X-8")
    npc_contact: bool | None = metric("two NPCs touched", "X-8")
    hardest: float | None = metric("hardest braking of the ego, m/s2", "X-8")
    nearest_m: float | None = metric("least distance of centres", "X-8")
    way_m: float | None = metric("way of the ego along x", "X-8")


def candidates(scenario: str) -> Iterator[Candidate]:
    """Yields the sets of values that are tried for a scenario."""
    if scenario == CUT_IN:
        for cutin in (CutIn.ORIGINAL, CutIn.FIXED):  # without and with the spawn delay
            for v in GHOST_SPEEDS:
                start = variant_parameters(cutin, v)["GhostS"]
                for distance in MERGE_DISTANCES:
                    values = {"GhostSpeed": v, "GhostS": start, "MergeDistance": distance}
                    yield Candidate(scenario, values, cutin)
        return
    for v_kmh in SPEEDS_KMH:
        v = mps_from_kmh(v_kmh)
        same = {"EgoSpeed": v, "LeadSpeed": v, "LeadS": START + HEADWAY * v}
        if scenario == "lead_slowdown":
            for a in DECELERATIONS:
                yield Candidate(scenario, same | {"Deceleration": a})
            continue
        for swerve in SWERVE_TIMES:
            lead_s = START + 1.8 * v  # the second vehicle ends up in the same lane, nearer
            pair = {"LeadS": lead_s, "SecondS": lead_s + 8.0, "SecondSpeed": v}
            yield Candidate(scenario, same | pair | {"SwerveTime": swerve})


def tuning_run(candidate: Candidate, seed: int) -> RunSpec:
    """The candidate with a seed, on dry road with original friction."""
    name = candidate.scenario
    course = Scenario(
        file=name,
        parameters=dict(drawn_parameters(name, seed, candidate.cutin, candidate.values)),
        skill=drawn_skill(name, seed),
    )
    return template(course=course, weather=preset(BASELINE), seed=seed, friction=Friction.ORIGINAL)


def trials(candidates: Iterable[Candidate], seeds: range, first: int = 0) -> list[Trial]:
    """Every candidate with every seed; `first` is the number of the first candidate."""
    numbered = list(enumerate(candidates, start=first))
    return [Trial(candidate, number, seed) for number, candidate in numbered for seed in seeds]


def drive_one(out: Path, trial: Trial) -> Driven[TrialKey, TrialMetrics]:
    """In a worker: drive a trial; nothing but its row is kept."""
    del out
    watch = Stopwatch()
    driven = run(tuning_run(trial.candidate, trial.seed))
    a, outcome = driven.log.actors, driven.outcome
    metrics = TrialMetrics(
        completed=outcome is Outcome.COMPLETED,
        triggered=driven.triggered,
        npc_contact=npc_contact_row(driven.log) is not None,
        hardest=float(-np.diff(driven.log.v_ego).min() / DT),
        nearest_m=float(np.hypot(a.x[:, 1:] - a.x[:, :1], a.y[:, 1:] - a.y[:, :1]).min()),
        way_m=float(np.ptp(a.x[:, 0])),
    )
    key = trial_key(trial, outcome)
    return Driven(key=key, metrics=metrics, timing=watch.timing(), error=last_line(driven.error))


def trial_key(trial: Trial, outcome: Outcome) -> TrialKey:
    """The identifying columns of a trial's row."""
    c = trial.candidate
    return TrialKey(
        scenario=c.scenario,
        number=trial.number,
        cutin=c.cutin.value if c.scenario == CUT_IN else "",
        values=" ".join(f"{k}={v:.4g}" for k, v in c.values.items()) or "as shipped",
        seed=trial.seed,
        outcome=outcome.value,
    )


RECIPE = Recipe(
    command="tuning",
    columns=Columns(TrialKey, TrialMetrics, ("scenario", "number", "seed")),
    entry=Entry[TrialKey, TrialMetrics],
    key=trial_key,
    drive=drive_one,
    warm_up=warm_up,
    success=lambda metrics: metrics.completed,
    success_means="completed",
)


def summary(results: pl.DataFrame) -> pl.DataFrame:
    """What the seeds made of each candidate: shares, medians, and the least distance of all."""
    candidate = ("scenario", "number", "cutin", "values")
    of_candidate = results.group_by(candidate, maintain_order=True).agg(
        pl.col("completed", "triggered", "npc_contact").mean(),
        pl.col("hardest", "way_m").median(),
        pl.col("nearest_m").min(),
    )
    return of_candidate.sort("scenario", "number")


def main(arguments: Sequence[str]) -> None:
    """Drive and print the candidates of these scenarios, or of all."""
    parser = ArgumentParser(description="Drive every candidate of the scenarios' values.")
    parser.add_argument("scenario", nargs="*", help="default: all")
    parser.add_argument("--out", type=Path, help="keep ledger and rows here, and go on from them")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args(arguments)
    tasks: list[Trial] = []
    for scenario in given.scenario or NAMES:
        tried = list(candidates(scenario))
        shipped = trials([Candidate(scenario, {})], FRESH_SEEDS, first=len(tried))
        tasks += [*trials(tried, SEEDS), *shipped]
    with TemporaryDirectory() as nowhere:
        out = given.out or Path(nowhere) / "tuning"
        Campaign(RECIPE, tasks).run(out, local(given.workers, warm_up), resume=True)
        found = summary(read_results(out))
    for row in found.iter_rows(named=True):
        print(
            f"{row['scenario']} {row['cutin']} {row['values']}: completed {row['completed']:.0%}, "
            f"triggered {row['triggered']:.0%}, npc contact {row['npc_contact']:.0%}, hardest braking "
            f"{row['hardest']:.1f} m/s2, nearest {row['nearest_m']:.1f} m, way {row['way_m']:.0f} m"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
