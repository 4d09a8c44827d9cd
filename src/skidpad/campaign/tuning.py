"""Choose the scenarios' values in the open: candidates, tuning seeds, a criterion (decision X-8).

`python -m skidpad.campaign.tuning [scenario ...]` drives every candidate on dry road with original
friction and prints one row each. No weather and no reduced friction enters; what the rows were used
for stands in docs/grip.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from skidpad.campaign.cells import TUNING_SEEDS
from skidpad.campaign.grip_cells import template
from skidpad.campaign.run import Run, run
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.run import Friction, RunSpec, Scenario
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.grip.scores import npc_contact_row
from skidpad.physics.presets import preset
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
class Row:
    """What the seeds made of a candidate."""

    completed: float  # share of seeds
    triggered: float
    npc_contact: float
    a_hardest: float  # m/s^2, median of the ego's hardest braking
    nearest: float  # m, least distance of centres over all seeds
    way: float  # m, median


def candidates(scenario: str) -> Iterator[Candidate]:
    """What was tried."""
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


def judge(candidate: Candidate, seeds: range = SEEDS) -> Row:
    """Drive it once per seed."""
    played = [run(tuning_run(candidate, seed)) for seed in seeds]
    logs = [p.log for p in played]
    way = [float(np.ptp(log.actors.x[:, 0])) for log in logs]
    return Row(
        completed=float(np.mean([p.outcome is Outcome.COMPLETED for p in played])),
        triggered=float(np.mean([p.triggered for p in played])),
        npc_contact=float(np.mean([npc_contact_row(log) is not None for log in logs])),
        a_hardest=float(np.median([-np.diff(log.v_ego).min() / DT for log in logs])),
        nearest=min(_nearest(p) for p in played),
        way=float(np.median(way)),
    )


def _nearest(played: Run) -> float:
    a = played.log.actors
    return float(np.hypot(a.x[:, 1:] - a.x[:, :1], a.y[:, 1:] - a.y[:, :1]).min())


def tuning_run(candidate: Candidate, seed: int) -> RunSpec:
    """The candidate with a seed, on dry road with original friction."""
    name = candidate.scenario
    course = Scenario(
        file=name,
        parameters=dict(drawn_parameters(name, seed, candidate.cutin, candidate.values)),
        skill=drawn_skill(name, seed),
    )
    return template(course=course, weather=preset(BASELINE), seed=seed, friction=Friction.ORIGINAL)


def main(scenarios: list[str]) -> None:
    """Print the rows of these scenarios, or of all."""
    for scenario in scenarios or NAMES:
        shipped = Candidate(scenario, {})
        for candidate in [*candidates(scenario), shipped]:
            row = judge(candidate, FRESH_SEEDS if candidate is shipped else SEEDS)
            label = candidate.cutin.value if scenario == CUT_IN else ""
            values = " ".join(f"{k}={v:.4g}" for k, v in candidate.values.items()) or "as shipped"
            print(
                f"{scenario} {label} {values}: completed {row.completed:.0%}, triggered "
                f"{row.triggered:.0%}, npc contact {row.npc_contact:.0%}, hardest braking "
                f"{row.a_hardest:.1f} m/s2, nearest {row.nearest:.1f} m, way {row.way:.0f} m",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
