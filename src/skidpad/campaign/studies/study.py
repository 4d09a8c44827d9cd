"""Small experiments of their own for findings that the matrix cannot decide (decision X-7)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import polars as pl

from skidpad.campaign.driving.pace import Brake
from skidpad.campaign.driving.run_setup import Stage, recovery_settings, stage_of
from skidpad.campaign.recipes.matrix import roads_of, warm_up
from skidpad.campaign.runs.run import run
from skidpad.campaign.studies.arms import STUDIES, Variant
from skidpad.campaign.workers.pool import local
from skidpad.campaign.workers.worker import Job
from skidpad.core.errors import SkidpadError, require_choice
from skidpad.evidence.drive import manner
from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.drive.metrics import run_metrics
from skidpad.evidence.verdicts import Judgement, judge
from skidpad.recording.run.log_files import log_hash
from skidpad.roads.bundled import load_map
from skidpad.simulation.recovery import Supervisor

KEPT = (
    "fatal_collisions",
    "crashes_vehicle",
    "off_lanes_pct",
    "radar_fpr_pct",
    "radar_fnr_pct",
    "dropout_pct",
    "mean_error_m",
    "mean_speed_kmh",
)
BY_ID = {f.id: f for f in (*FINDINGS, *ACCEPTANCE)}


def stage_for(variant: Variant) -> Stage:
    """Returns the world and script of a variant's run, with the supervisor that it asks for."""
    stage = stage_of(variant.run)
    if not variant.recovery:
        return stage
    values = replace(recovery_settings(variant.run.settings.traffic), **variant.recovery)
    return replace(stage, supervisor=Supervisor(stage.map, values, stage.setup.dt))


def drive_variant(variant: Variant) -> dict[str, Any]:
    """Drives one arm in a worker and returns its row."""
    spec = variant.run
    sinks = [Brake(variant.slow_s)] if variant.slow_s else []
    driven = run(spec, stage=stage_for(variant), sinks=sinks)
    log = driven.log
    metrics = run_metrics(log, load_map(roads_of(spec).map))
    fatal, first = metrics.fatal_collisions, metrics.fatal_first
    return {
        **variant.labels,
        "config": spec.driver.label,
        "weather": spec.weather.name,
        "seed": spec.seed,
        "outcome": driven.outcome.value,
        "log_hash": log_hash(log),
        **{name: getattr(metrics, name) for name in KEPT},
        "chained": None if fatal is None or first is None else fatal - first,
        "phantom_brakings": manner.phantom_brakings(log),
        "surges": manner.surges(log),
        "mode_changes_per_min": manner.mode_changes_per_min(log),
        "jerk_rms": manner.jerk_rms(log),
        "spins": manner.spins(log),
        "hits_in_cool_down": manner.hits_in_cool_down(log),
    }


def drive_all(
    what: str, jobs: Sequence[Job], workers: int, on_run: Callable[[int, int], None]
) -> list[dict[str, Any]]:
    """Returns the rows of all jobs, in their order; `on_run` as in `run_study`.

    SkidpadError, which begins with `what`, as soon as a run failed.
    """
    rows: dict[str, dict[str, Any]] = {}
    for finished in local(workers, warm_up)(jobs):
        if finished.failure is not None:
            how = finished.failure.value
            raise SkidpadError(f"{what}: a run {how}: {finished.detail.strip()}")
        rows[finished.job.key] = finished.value
        on_run(len(rows), len(jobs))
    return [rows[job.key] for job in jobs]


def run_study(
    id: str,
    seeds: Sequence[int],
    workers: int,
    on_run: Callable[[int, int], None] = lambda *_: None,
) -> tuple[list[Judgement], pl.DataFrame]:
    """Drives a study with these seeds; returns its claims, judged and corrected for all, and its runs.

    on_run: called with the runs done and the runs in all.

    Raises:
        ConfigError: no study has this id.
        SkidpadError: a run crashed, timed out or failed, which ends the study.
    """
    require_choice("study", id, tuple(STUDIES))
    study = STUDIES[id]
    variants = [variant for seed in seeds for variant in study.arms(seed)]
    jobs = [Job(f"{id}-{k}", drive_variant, v, v.run.deadline_s) for k, v in enumerate(variants)]
    table = pl.DataFrame(drive_all(f"study {id}", jobs, workers, on_run))
    claims = [BY_ID[claim] for claim in study.claims]
    return judge(claims, [table] * len(claims), astray(table)), table
