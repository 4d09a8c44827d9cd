"""Headline findings of the channels source as data, judged on drives (decision X-7).

The table has one row per drive segment, see `Evaluation.segment_table`: practical rules against
world-model truth. Contrasts are over segments, since events within a drive are dependent.
"""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.verdicts import Contrast, Finding, paired, rate_below

GOOD = 0.8  # precision and recall that the overall claim stands for (85.4 and 82.5 % macro)
FALSE_PER_HOUR = 0.5  # of a rule that "never cries wolf"; 0 in 8 h excludes more
BUDGET_MS = 25.0
SCORE = 0.02  # of an indicator; less does not matter
EVENTS = 0.1  # per segment
LOCALISATION, TAILGATING, TAILGATED = SCORED_HAZARDS
INDICATORS = (
    "object_trajectory_similarity", "planned_path_comfort", "history_comfort",
    "cross_channel_planned_path_similarity", "ego_location_similarity",
    "object_count_similarity", "object_motion_prediction_validation",
    "channel_planned_path_similarity", "object_location_similarity",
    "ego_trajectory_similarity", "object_orientation_similarity",
    "ego_orientation_similarity", "object_area_similarity",
)  # fmt: skip
"""Those of the published ranking, most violations first."""


def _column(table: pl.DataFrame, name: str) -> pl.Series:
    return (
        table[name] if name in table.columns else pl.Series(name, [None] * len(table), pl.Float64)
    )


def _counts(table: pl.DataFrame, kind: str, hazards: Sequence[HazardType]) -> pl.Series:
    total = pl.Series([0.0] * len(table))
    for hazard in hazards:
        total = total + _column(table, f"{kind}_{hazard.value}").cast(pl.Float64)
    return total


def _mean_above(label: str, values: pl.Series, margin: float) -> list[Contrast]:
    """The claim that the mean over segments is positive; segments without a value count not."""
    known = values.drop_nulls()
    return [paired(label, known.to_numpy(), margin)] if len(known) else []


def _score_above(label: str, table: pl.DataFrame, name: str) -> list[Contrast]:
    return _mean_above(label, _column(table, name).cast(pl.Float64), SCORE)


def _ratio_above(
    label: str, hits: pl.Series, cases: pl.Series, limit: float, margin: float = 0.0
) -> list[Contrast]:
    """hits / cases > limit, over segments with cases: mean of hits - limit * cases."""
    with_cases = cases.fill_null(0.0) > 0.0
    return _mean_above(label, (hits - limit * cases).filter(with_cases), margin)


def _complete(*parts: list[Contrast]) -> list[Contrast]:
    """All contrasts; none when one of them cannot be drawn."""
    return [c for part in parts for c in part] if all(parts) else []


def cf01(table: pl.DataFrame) -> list[Contrast]:
    """Precision and recall of all three hazards together."""
    tp, fp, fn = (_counts(table, kind, SCORED_HAZARDS) for kind in ("tp", "fp", "fn"))
    return _complete(
        _ratio_above(f"hits less {GOOD:g} of detections, per segment", tp, tp + fp, GOOD),
        _ratio_above(f"hits less {GOOD:g} of true hazards, per segment", tp, tp + fn, GOOD),
    )


def _harder(table: pl.DataFrame, hard: HazardType, easy: HazardType) -> list[Contrast]:
    """The share of errors is larger for `hard`: errors less the share of `easy`, per segment."""
    wrong, all_hard = _errors(table, hard)
    wrong_easy, all_easy = _errors(table, easy)
    total = float(all_easy.sum() or 0.0)
    if total == 0.0:
        return []
    share = float(wrong_easy.sum() or 0.0) / total
    return _ratio_above(f"errors, {hard.value} above {easy.value}", wrong, all_hard, share)


def _errors(table: pl.DataFrame, hazard: HazardType) -> tuple[pl.Series, pl.Series]:
    tp, fp, fn = (_counts(table, kind, (hazard,)) for kind in ("tp", "fp", "fn"))
    return fp + fn, tp + fp + fn


def cf02(table: pl.DataFrame) -> list[Contrast]:
    """Tailgated has a smaller share of errors than either other hazard."""
    return _complete(_harder(table, TAILGATING, TAILGATED), _harder(table, LOCALISATION, TAILGATED))


def cf03(table: pl.DataFrame) -> list[Contrast]:
    """False localisation alarms per hour; the claim needs true ones to find."""
    false, hours = _counts(table, "fp", (LOCALISATION,)).drop_nulls(), table["hours"]
    found = _counts(table, "tp", (LOCALISATION,)).drop_nulls()
    if not len(false) or not found.sum():
        return []
    label = f"{FALSE_PER_HOUR:g} less the false localisation alarms per hour"
    return [rate_below(label, int(false.sum()), float(hours.sum()), FALSE_PER_HOUR)]


def cf04(table: pl.DataFrame) -> list[Contrast]:
    """Tailgating has a larger share of errors than either other hazard."""
    return _complete(
        _harder(table, TAILGATING, TAILGATED), _harder(table, TAILGATING, LOCALISATION)
    )


def cf05(table: pl.DataFrame) -> list[Contrast]:
    """More than half of the false tailgating alarms have a cause that the source names."""
    false = _counts(table, "fp", (TAILGATING,))
    explained = _column(table, "false_tailgating_explained").cast(pl.Float64)
    return _ratio_above("explained false alarms less half of them", explained, false, 0.5)


def cf07(table: pl.DataFrame) -> list[Contrast]:
    """Hazards with an object that no channel reported are found less than half the time."""
    unseen = _column(table, "unseen").cast(pl.Float64)
    found = _column(table, "unseen_found").cast(pl.Float64)
    return _ratio_above(
        "hazards of unseen objects missed less half of them", unseen - found, unseen, 0.5
    )


def cf08(table: pl.DataFrame) -> list[Contrast]:
    """Localisation hazards at night above the mean of the other segments."""
    rows = table.filter(_column(table, "night").is_not_null())
    if not len(rows):
        return []
    rate = _column(rows, f"world_{LOCALISATION.value}").cast(pl.Float64) / rows["hours"]
    night = rows["night"].cast(pl.Boolean)
    day = rate.filter(~night).mean()
    if day is None or not night.any():
        return []
    assert isinstance(day, float)
    return _mean_above(
        "localisation hazards per hour, night less day", rate.filter(night) - day, 0.1
    )


def cf10(table: pl.DataFrame) -> list[Contrast]:
    """The first of the published ranking above the mean of the others, the last three below."""
    columns = {i: _column(table, f"violations_{i}").cast(pl.Float64) for i in INDICATORS}
    mean = sum(columns.values(), pl.Series([0.0] * len(table))) / len(columns)
    least = (columns[INDICATORS[-1]] + columns[INDICATORS[-2]] + columns[INDICATORS[-3]]) / 3.0
    return _complete(
        _mean_above(
            "violations per segment, object trajectory less the mean of all",
            columns[INDICATORS[0]] - mean,
            EVENTS,
        ),
        _mean_above(
            "violations per segment, mean of all less orientation and area", mean - least, EVENTS
        ),
    )


def cf14(table: pl.DataFrame) -> list[Contrast]:
    """Agreement of plans falls in turns and when standing."""
    return _complete(
        _score_above(
            "plan similarity, straight less turning", table, "cross_path_straight_minus_turn"
        ),
        _score_above(
            "plan similarity, moving less standing", table, "cross_path_moving_minus_standing"
        ),
    )


def cf15(table: pl.DataFrame) -> list[Contrast]:
    """Object scores fall with the number of objects."""
    return _complete(
        _score_above(
            "location similarity, few less many objects", table, "object_location_few_minus_many"
        ),
        _score_above(
            "trajectory similarity, few less many objects",
            table,
            "object_trajectory_few_minus_many",
        ),
    )


def cf17(table: pl.DataFrame) -> list[Contrast]:
    """Indicators are steadier while the ego stands than while it moves."""
    return _score_above(
        "share of steady indicators, standing less moving", table, "steady_standing_minus_moving"
    )


def cf30(table: pl.DataFrame) -> list[Contrast]:
    """The 99.9 % quantile of the time per cycle is below the budget in every segment."""
    time = _column(table, "total_p999_ms").cast(pl.Float64)
    return _mean_above(f"{BUDGET_MS:g} ms less the 99.9 % quantile", BUDGET_MS - time, 0.0)


def cf31(table: pl.DataFrame) -> list[Contrast]:
    """Motion prediction takes more than half of the three modules' time."""
    share = _column(table, "motion_prediction_share").cast(pl.Float64)
    return _mean_above("share of motion prediction less a half", share - 0.5, 0.02)


SEGMENTS = "means over drive segments, sign changes, bootstrap interval"
DRIVES = "drives with truth (`skidpad channels drive`, then `evaluate`)"


def _finding(id: str, claim: str, estimand: str, contrasts: object, **more: str) -> Finding:
    return Finding(
        id=id,
        claim=claim,
        estimand=estimand,
        needs=more.get("needs", DRIVES),
        test=more.get("test", SEGMENTS),
        margin=more.get("margin", "none"),
        contrasts=contrasts,  # type: ignore[arg-type]
        built_in=more.get("built_in", ""),
    )


FINDINGS: tuple[Finding, ...] = (
    _finding("CF-01", "The rules find most hazards of the world model, with few false alarms.",
             f"precision and recall of all three hazards against {GOOD:g}", cf01),
    _finding("CF-02", "Being tailgated is the hazard that is found best.",
             "errors per true or detected hazard, the others above tailgated", cf02),
    _finding("CF-03", "The localisation rule never cries wolf.",
             f"false localisation alarms per hour, against {FALSE_PER_HOUR:g}", cf03,
             needs=f"{DRIVES} in which the rule found a hazard",
        test="exact Poisson",
             built_in="positions jump by more than the rule's limit or hardly at all"),
    _finding("CF-04", "Tailgating is the hazard that is hardest to find.",
             "errors per true or detected hazard, tailgating above the others", cf04),
    _finding("CF-05", "False tailgating comes from red lights, turns and crossing objects.",
             "share of false tailgating alarms standing, turning or with another conflict", cf05),
    _finding("CF-07", "What every channel misses cannot be found.",
             "missed share of true hazards whose object no channel reported", cf07,
             needs=f"{DRIVES} in which all channels missed an object of a hazard",
             built_in="the monitor knows only what channels report"),
    _finding("CF-08", "Night strains localisation.",
             "localisation hazards per hour, night above day", cf08, margin="0.1 per hour",
             needs=f"{DRIVES} by night and by day",
             built_in="one channel's localisation is set to degrade in the dark"),
    _finding("CF-10", "Predicted object trajectories are violated most, orientation and area hardly.",
             "violation events per segment against the mean of all indicators", cf10,
             margin=f"{EVENTS:g} per segment"),
    _finding("CF-14", "Plans diverge in turns and at red lights.",
             "cross-channel plan similarity, elsewhere less there", cf14, margin=f"{SCORE:g}",
             built_in="one channel does not recognise lights"),
    _finding("CF-15", "Object scores fall with the number of objects.",
             "similarity with fewer than five objects less that with more", cf15, margin=f"{SCORE:g}"),
    _finding("CF-17", "A stuck vehicle shows: indicators hardly change.",
             "share of indicators steady over 20 s, standing less moving", cf17, margin=f"{SCORE:g}"),
    _finding("CF-30", "Real time is met.", "99.9 % quantile of the processor time per cycle", cf30,
             needs="timed drives"),
    _finding("CF-31", "Motion prediction dominates the time.",
             "share of motion prediction in comfort, similarity and motion prediction", cf31,
             margin="0.02", needs="timed drives"),
)  # fmt: skip
