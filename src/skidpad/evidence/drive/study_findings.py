"""Findings on single functions that need runs of their own (`skidpad study ID`)."""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import Amount, Criterion, Never, rows_of
from skidpad.evidence.drive.sides import COLLISIONS, PHANTOMS, POINT, variants
from skidpad.evidence.rates import RateBelow
from skidpad.evidence.verdicts import Finding

CHANGES = Amount(0.5, "changes per minute")
JERK = Amount(0.1, "m/s3")
SPINS = Amount(0.1, "spins per run")
HITS = Amount(0.1, "hits per run")
CHAINED = "interventions per run that follow on a relocation"


def unequal_logs(table: pl.DataFrame) -> tuple[int, int]:
    """Returns the number of pairs of paced and slowed runs with unequal logs, and of all pairs."""
    sides = [table.filter(pl.col("variant") == v) for v in ("paced", "slowed")]
    keys = [k for k in ("config", "weather", "seed") if k in table.columns]
    both = sides[0].join(sides[1], on=keys, suffix="_slowed")
    return int((both["log_hash"] != both["log_hash_slowed"]).sum()), len(both)


def _rare(what: str, column: str, variant: str, limit: Amount) -> RateBelow:
    """Returns the criterion that the events of `column` in a variant's runs stay below the limit."""
    arm = rows_of("variant", variant)
    return RateBelow(what=what, events=pl.col(column).sum(), limit=limit, where=arm.are)


def _noisy(kind: str, sizes: str) -> tuple[Finding, Finding]:
    """Returns two findings on noise of a cited size: dropout, and crashes with vehicles."""
    id = {"night": "F-12", "rain": "F-13"}[kind]
    needs = "its own study: exact sensing, noise of night, noise of rain"
    given = f"Given noise of {sizes}"
    return (
        Finding(
            f"{id}n", f"{given}, targets drop out more often.",
            f"dropout, noise of {kind} minus none; everything else is a clear noon", needs,
            (variants("dropout_pct", kind, "exact", POINT),), study=True,
        ),
        Finding(
            f"{id}nv", f"{given}, there are more crashes with vehicles.",
            f"crashes with vehicles per run, noise of {kind} minus none", needs,
            (variants("crashes_vehicle", kind, "exact", COLLISIONS),), study=True,
        ),
    )  # fmt: skip


def _without(mark: str, variant: str, what: str) -> Finding:
    """Returns the finding that recoveries chain in the variant without one of the safeguards."""
    criteria: tuple[Criterion, ...] = (variants("chained", variant, "whole", COLLISIONS),)
    return Finding(
        f"F-30{mark}", f"Without {what} recoveries chain.",
        f"{CHAINED}, without {what} minus with all",
        "its own study: recovery whole, and without each of its safeguards", criteria, study=True,
    )  # fmt: skip


STUDY_FINDINGS: tuple[Finding, ...] = (
    Finding(
        "F-17", "Holding a lost target for 5 s brakes for phantoms; the radar cascade does not.",
        "phantom brakings per run, safety-persist minus cascade",
        "its own study: a lead that changes lane, both settings",
        (variants("phantom_brakings", "safety_persist", "cascade", PHANTOMS),), study=True,
    ),
    Finding(
        "F-18", "Without coasting after a lost lead the car pulls away and brakes in alternation; "
        "with it this vanishes.",
        "emergency brakings within 2 s of pulling away, without coasting minus with, and with",
        "its own study: with and without the coast phase",
        (
            variants("surges", "no_coast", "coast", PHANTOMS),
            _rare("such brakings with coasting", "surges", "coast", PHANTOMS),
        ),
        study=True,
    ),
    Finding(
        "F-19", "One distance controller swings between following and cruising; three zones do not.",
        "changes between following and cruising per minute, and jerk, one controller minus zones",
        "its own study: both followers",
        (
            variants("mode_changes_per_min", "one_pid", "zones", CHANGES),
            variants("jerk_rms", "one_pid", "zones", JERK),
        ),
        study=True,
    ),
    Finding(
        "F-21", "Map-matched radar trades false positives for fewer misses and dropouts.",
        "radar false positives, radar false negatives and dropout, map-matched against corridor",
        "its own study: both radar filters, all else equal",
        (
            variants("radar_fpr_pct", "map_matched", "corridor", POINT),
            variants("radar_fnr_pct", "corridor", "map_matched", POINT),
            variants("dropout_pct", "corridor", "map_matched", POINT),
        ),
        study=True,
    ),
    Finding(
        "F-25", "Slowing the client changes no metric in synchronous mode.",
        "pairs of runs with unequal content hash", "its own study: the same runs paced and slowed",
        (Never("unequal pairs of logs", unequal_logs),), study=True,
        built_in="no clock is read within the loop, so it is held against itself",
    ),
    Finding(
        "F-29", "The handbrake in emergency braking turns the car round; without it nothing does.",
        "slides of more than 15 deg per run, handbrake in tiers 1 to 3 minus released, and released",
        "its own study: handbrake engaged and released in tiers 1 to 3",
        (
            variants("spins", "engaged", "released", SPINS),
            _rare("slides without the handbrake", "spins", "released", SPINS),
        ),
        study=True,
    ),
    Finding(
        "F-30", "Three phases and a clear place leave no second hit within the cool-down.",
        "relocations followed by a contact within 3 s, per run, against a limit",
        "its own study: recovery whole, and without each of its safeguards",
        (_rare("hits within the cool-down", "hits_in_cool_down", "whole", HITS),), study=True,
    ),
    _without("a", "no_clearance", "the clearance test"),
    _without("b", "no_warm_up", "the warm-up"),
    _without("c", "no_grace", "the grace of the stuck detector"),
    *_noisy("night", "the size measured at night"),
    *_noisy("rain", "the size measured in rain"),
)  # fmt: skip
