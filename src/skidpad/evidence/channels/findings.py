"""Headline findings of the channels source as data, judged on drives (decision X-7).

The table has one row per drive segment, see `Evaluation.segment_table`: practical rules against
world-model truth. Contrasts are over segments, since events within a drive are dependent.
"""

from __future__ import annotations

import polars as pl

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.timing import BUDGET_MS
from skidpad.evidence.contrasts import Amount, Mean
from skidpad.evidence.rates import RateBelow
from skidpad.evidence.verdicts import Finding

GOOD = 0.8  # precision and recall that the overall claim stands for (85.4 and 82.5 % macro)
FALSE_PER_HOUR = Amount(
    0.5, "per hour"
)  # of a rule that "never cries wolf"; 0 in 8 h excludes more
NONE = Amount(0.0)
SCORE = Amount(0.02)  # of an indicator; less does not matter
EVENTS = Amount(0.1, "per segment")
LOCALISATION, TAILGATING, TAILGATED = SCORED_HAZARDS
INDICATORS = (
    Indicator.OBJECT_TRAJECTORY, Indicator.PLANNED_PATH_COMFORT, Indicator.HISTORY_COMFORT,
    Indicator.CROSS_PATH, Indicator.EGO_LOCATION, Indicator.OBJECT_COUNT,
    Indicator.MOTION_VALIDATION, Indicator.CHANNEL_PATH, Indicator.OBJECT_LOCATION,
    Indicator.EGO_TRAJECTORY, Indicator.OBJECT_ORIENTATION, Indicator.EGO_ORIENTATION,
    Indicator.OBJECT_AREA,
)  # fmt: skip
"""Those of the published ranking, most violations first."""


def mean_above(
    label: str, value: pl.Expr, margin: Amount = NONE, where: pl.Expr | None = None
) -> Mean:
    """Returns a test of whether the mean of `value` over drive segments is above 0.

    margin: the smallest amount that matters; where: the segments that count, None: all.
    """
    return Mean(label=label, value=value, margin=margin, where=where, over="drive segments")


def share_above(label: str, hits: pl.Expr, cases: pl.Expr, limit: float | pl.Expr) -> Mean:
    """Returns a test of whether hits / cases is above `limit`, over segments with cases.

    It is judged by the mean of hits - limit * cases.
    """
    return mean_above(label, hits - limit * cases, where=cases > 0.0)


def sum_counts(kind: str, *hazards: HazardType) -> pl.Expr:
    """Returns an expression: the sum over hazards of a segment's counts of `kind` (tp, fp or fn)."""
    return sum((pl.col(f"{kind}_{h.value}").cast(pl.Float64) for h in hazards), pl.lit(0.0))


def errors_above(hard: HazardType, easy: HazardType) -> Mean:
    """Returns a test of whether the share of errors is larger for hazard `hard` than for `easy`.

    Errors are fp + fn of tp + fp + fn; the share of `easy` is that of all segments together.
    """
    (wrong, cases), (wrong_easy, cases_easy) = (
        (fp + fn, tp + fp + fn)
        for tp, fp, fn in ([sum_counts(k, h) for k in ("tp", "fp", "fn")] for h in (hard, easy))
    )
    share = pl.when(cases_easy.sum() > 0.0).then(wrong_easy.sum() / cases_easy.sum())
    return share_above(f"errors, {hard.value} above {easy.value}", wrong, cases, share)


def violations(*indicators: Indicator) -> pl.Expr:
    """Returns an expression: violation events in a segment, averaged over the indicators."""
    columns = (pl.col(f"violations_{i.value}").cast(pl.Float64) for i in indicators)
    return sum(columns, pl.lit(0.0)) / len(indicators)


HITS, FALSE, MISSED = (sum_counts(kind, *SCORED_HAZARDS) for kind in ("tp", "fp", "fn"))
AT_NIGHT = pl.col("night").cast(pl.Boolean)
LOST_PER_HOUR = pl.col(f"world_{LOCALISATION.value}").cast(pl.Float64) / pl.col("hours")
DRIVES = "drives with truth (`skidpad channels drive`, then `evaluate`)"
FINDINGS: tuple[Finding, ...] = (
    Finding(
        "CF-01", "The rules find most hazards of the world model, with few false alarms.",
        f"precision and recall of all three hazards against {GOOD:g}", DRIVES,
        (
            share_above(f"hits less {GOOD:g} of detections, per segment", HITS, HITS + FALSE, GOOD),
            share_above(
                f"hits less {GOOD:g} of true hazards, per segment", HITS, HITS + MISSED, GOOD,
            ),
        ),
    ),
    Finding(
        "CF-02", "Being tailgated is the hazard that is found best.",
        "errors per true or detected hazard, the others above tailgated", DRIVES,
        (errors_above(TAILGATING, TAILGATED), errors_above(LOCALISATION, TAILGATED)),
    ),
    Finding(
        "CF-03", "The localisation rule never cries wolf.",
        f"false localisation alarms per hour, against {FALSE_PER_HOUR.value:g}",
        f"{DRIVES} in which the rule found a hazard",
        (
            RateBelow(
                what="the false localisation alarms", events=sum_counts("fp", LOCALISATION).sum(),
                limit=FALSE_PER_HOUR, exposure=pl.col("hours").sum(),
                given=sum_counts("tp", LOCALISATION).sum(),
            ),
        ),
        built_in="positions jump by more than the rule's limit or hardly at all",
    ),
    Finding(
        "CF-04", "Tailgating is the hazard that is hardest to find.",
        "errors per true or detected hazard, tailgating above the others", DRIVES,
        (errors_above(TAILGATING, TAILGATED), errors_above(TAILGATING, LOCALISATION)),
    ),
    Finding(
        "CF-05", "False tailgating comes from red lights, turns and crossing objects.",
        "share of false tailgating alarms standing, turning or with another conflict", DRIVES,
        (
            share_above(
                "explained false alarms less half of them",
                pl.col("false_tailgating_explained").cast(pl.Float64), sum_counts("fp", TAILGATING),
                0.5,
            ),
        ),
    ),
    Finding(
        "CF-07", "What every channel misses cannot be found.",
        "missed share of true hazards whose object no channel reported",
        f"{DRIVES} in which all channels missed an object of a hazard",
        (
            share_above(
                "hazards of unseen objects missed less half of them",
                pl.col("unseen") - pl.col("unseen_found"), pl.col("unseen"), 0.5,
            ),
        ),
        built_in="the monitor knows only what channels report",
    ),
    Finding(
        "CF-08", "Night strains localisation.", "localisation hazards per hour, night above day",
        f"{DRIVES} by night and by day",
        (
            mean_above(
                "localisation hazards per hour, night less day",
                LOST_PER_HOUR - LOST_PER_HOUR.filter(~AT_NIGHT).mean(), Amount(0.1, "per hour"),
                where=AT_NIGHT,
            ),
        ),
        built_in="one channel's localisation is set to degrade in the dark",
    ),
    Finding(
        "CF-10", "Predicted object trajectories are violated most, orientation and area hardly.",
        "violation events per segment against the mean of all indicators", DRIVES,
        (
            mean_above(
                "violations per segment, object trajectory less the mean of all",
                violations(INDICATORS[0]) - violations(*INDICATORS), EVENTS,
            ),
            mean_above(
                "violations per segment, mean of all less orientation and area",
                violations(*INDICATORS) - violations(*reversed(INDICATORS[-3:])), EVENTS,
            ),
        ),
    ),
    Finding(
        "CF-14", "Plans diverge in turns and at red lights.",
        "cross-channel plan similarity, elsewhere less there", DRIVES,
        (
            mean_above(
                "plan similarity, straight less turning", pl.col("cross_path_straight_minus_turn"),
                SCORE,
            ),
            mean_above(
                "plan similarity, moving less standing", pl.col("cross_path_moving_minus_standing"),
                SCORE,
            ),
        ),
        built_in="one channel does not recognise lights",
    ),
    Finding(
        "CF-15", "Object scores fall with the number of objects.",
        "similarity with fewer than five objects less that with more", DRIVES,
        tuple(
            mean_above(
                f"{score} similarity, few less many objects",
                pl.col(f"object_{score}_few_minus_many"), SCORE,
            )
            for score in ("location", "trajectory")
        ),
    ),
    Finding(
        "CF-17", "A stuck vehicle shows: indicators hardly change.",
        "share of indicators steady over 20 s, standing less moving", DRIVES,
        (
            mean_above(
                "share of steady indicators, standing less moving",
                pl.col("steady_standing_minus_moving"), SCORE,
            ),
        ),
    ),
    Finding(
        "CF-30", "Real time is met.", "99.9 % quantile of the processor time per cycle",
        "timed drives",
        (
            mean_above(
                f"{BUDGET_MS:g} ms less the 99.9 % quantile", BUDGET_MS - pl.col("total_p999_ms"),
            ),
        ),
    ),
    Finding(
        "CF-31", "Motion prediction dominates the time.",
        "share of motion prediction in comfort, similarity and motion prediction", "timed drives",
        (
            mean_above(
                "share of motion prediction less a half", pl.col("motion_prediction_share") - 0.5,
                Amount(0.02),
            ),
        ),
    ),
)  # fmt: skip
