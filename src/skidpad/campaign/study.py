"""Small experiments of their own for findings that the matrix cannot decide (decision X-7)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import polars as pl
from msgspec import structs

from skidpad.campaign.cells import seeds
from skidpad.campaign.matrix import roads_of, warm_up
from skidpad.campaign.pace import Brake
from skidpad.campaign.pool import local
from skidpad.campaign.run import run
from skidpad.campaign.worker import Job
from skidpad.core.errors import SkidpadError, require_choice
from skidpad.core.frames import RadarPoints, SensorFrame
from skidpad.core.randomness import stream
from skidpad.core.run import AdasDriver, RunSpec, StackDriver
from skidpad.core.specs import SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import SensorLevel, Tier
from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.drive.metrics import run_metrics
from skidpad.evidence.verdicts import Judgement, judge
from skidpad.physics.presets import find_weather
from skidpad.recording.logfiles import log_hash
from skidpad.recording.runlog import RunLog
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.stack.adas import AdasStack
from skidpad.stack.configurations import functions_of
from skidpad.stack.settings import load_profile

BRAKING = (Tier.HARD_STOP, Tier.EMERGENCY)
TARGETS_KMH = (60.0, 90.0, 120.0, 150.0)
DROPOUT_SHARES = (0.0, 0.1, 0.2)  # of time in which nothing is sensed
DROPOUT_S = 1.0  # length of one


@dataclass(frozen=True, slots=True)
class Variant:
    """One arm of a study: a run, columns that name it, and what is special about it."""

    run: RunSpec
    labels: Mapping[str, Any]
    dropout: float = 0.0
    slow_s: float = 0.0


class Blinking:
    """Our stack, which for stretches of a second receives empty sensor frames (F-08)."""

    report: StackReport

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        plain = dict(settings)
        share, seed = plain.pop("dropout"), plain.pop("seed")
        self.stack = AdasStack(specs, map, plain)
        length = round(DROPOUT_S / self.stack.config.dt)
        begins = stream(seed, "study", "dropout").random(200_000) < share / length
        reach = np.convolve(begins, np.ones(length))[: begins.size]
        self.blind = reach > 0
        self.report = self.stack.report

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Drive, blind or not."""
        if self.blind[frame.tick % self.blind.size]:
            frame = replace(frame, images={}, segments={}, radar=RadarPoints.none())
        command = self.stack.tick(frame)
        self.report = self.stack.report
        return command


def base_run(
    configuration: int, weather: str = "clear-noon", settings: Mapping[str, Any] | None = None
) -> RunSpec:
    """An object-level run of the profile `recommended`."""
    return RunSpec(
        driver=AdasDriver(label=str(configuration), functions=functions_of(configuration)),
        weather=find_weather(weather),
        settings=load_profile("recommended", settings).as_plain(),
        sensors=SensorLevel.OBJECTS,
    )


def speed_and_dropout(n: int) -> list[Variant]:
    """F-08: cruise target x share of time without any sensing, configuration 2."""
    base = base_run(2)
    variants = []
    for seed in seeds(n):
        for target in TARGETS_KMH:
            for share in DROPOUT_SHARES:
                options = {
                    "configuration": 2,
                    "profile": base.profile,
                    "cruise_kmh": target,
                    "dropout": share,
                    "seed": seed,
                }
                driver = StackDriver("skidpad.campaign.study:Blinking", options, name="2")
                labels = {"target_kmh": target, "dropout_injected": share}
                spec = structs.replace(base, driver=driver, seed=seed)
                variants.append(Variant(spec, labels))
    return variants


def persistence(n: int) -> list[Variant]:
    """F-17: holding a lost lead for 5 s, against the radar cascade."""
    arms: dict[str, dict[str, Any]] = {"cascade": {}, "safety_persist": {"safety_persist": True}}
    return [
        Variant(structs.replace(base_run(2, settings=values), seed=seed), {"variant": name})
        for seed in seeds(n)
        for name, values in arms.items()
    ]


def radar_filters(n: int) -> list[Variant]:
    """F-21: map-matched radar, against the 1.6 m corridor."""
    arms: dict[str, dict[str, Any]] = {
        "map_matched": {},
        "corridor": {"radar_corridor": "parabola"},
    }
    return [
        Variant(structs.replace(base_run(2, settings=values), seed=seed), {"variant": name})
        for seed in seeds(n)
        for name, values in arms.items()
    ]


def preliminary(n: int) -> list[Variant]:
    """A-278: the preliminary profile, against the recommended one with the same grip and sight."""
    same = {"grip": "none", "range": "none", "mu_ref": 1.5, "camera": False}
    return [
        Variant(
            structs.replace(
                base_run(2),
                seed=seed,
                profile=profile,
                settings=load_profile(profile, same).as_plain(),
            ),
            {"variant": name},
        )
        for seed in seeds(n)
        for name, profile in (("preliminary", "preliminary"), ("final", "recommended"))
    ]


def pace(n: int) -> list[Variant]:
    """F-25: the same runs, each tick 1 ms slower."""
    base = structs.replace(base_run(4, "rain-night"), duration=100.0)
    return [
        Variant(structs.replace(base, seed=seed), {"variant": name}, slow_s=slow)
        for seed in seeds(n)
        for name, slow in (("paced", 0.0), ("slowed", 1e-3))
    ]


STUDIES: dict[str, Callable[[int], list[Variant]]] = {
    "F-08": speed_and_dropout,
    "F-17": persistence,
    "F-21": radar_filters,
    "F-25": pace,
    "A-278": preliminary,
}


def drive_variant(variant: Variant) -> dict[str, Any]:
    """In a worker: drive one arm and return its row."""
    spec = variant.run
    driven = run(spec, sinks=[Brake(variant.slow_s)] if variant.slow_s else [])
    metrics = run_metrics(driven.log, load_map(roads_of(spec).map))
    return {
        **variant.labels,
        "config": spec.driver.label,
        "weather": spec.weather.name,
        "seed": spec.seed,
        "outcome": driven.outcome.value,
        "log_hash": log_hash(driven.log),
        "fatal_collisions": metrics.fatal_collisions,
        "off_lanes_pct": metrics.off_lanes_pct,
        "radar_fpr_pct": metrics.radar_fpr_pct,
        "radar_fnr_pct": metrics.radar_fnr_pct,
        "dropout_pct": metrics.dropout_pct,
        "phantom_brakings": phantom_brakings(driven.log),
    }


def phantom_brakings(log: RunLog) -> int:
    """Times that emergency braking began although nothing was within 40 m of the ego.

    Whatever stands or drives there, in any lane: a strict reading of "for nothing".
    """
    a = log.actors
    distance = np.hypot(a.x - a.x[:, :1], a.y - a.y[:, :1])
    distance[:, 0] = np.inf
    empty = np.where(log.present, distance, np.inf).min(axis=1) > 40.0
    braking = np.isin(log.report.tier, BRAKING) & (log.supervision == 0)
    begins = braking & ~np.concatenate([[False], braking[:-1]])
    return int(np.sum(begins & empty))


def run_study(
    id: str, n: int, workers: int, on_run: Callable[[int, int], None] = lambda *_: None
) -> tuple[Judgement, pl.DataFrame]:
    """Drive a study with n seeds and judge its finding."""
    require_choice("study", id, tuple(STUDIES))
    variants = STUDIES[id](n)
    jobs = [Job(f"{id}-{k}", drive_variant, v, v.run.deadline_s) for k, v in enumerate(variants)]
    rows: dict[str, dict[str, Any]] = {}
    for finished in local(workers, warm_up)(jobs):
        if finished.failure is not None:
            how = finished.failure.value
            raise SkidpadError(f"study {id}: a run {how}: {finished.detail.strip()}")
        rows[finished.job.key] = finished.value
        on_run(len(rows), len(jobs))
    table = pl.DataFrame([rows[j.key] for j in jobs])
    finding = next(f for f in (*FINDINGS, *ACCEPTANCE) if f.id == id)
    return judge([finding], [table], astray(table))[0], table
