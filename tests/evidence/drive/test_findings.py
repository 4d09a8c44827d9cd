from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.contrasts import (
    Amount,
    Contrast,
    contrast_pairs,
    distinct,
    paired_runs,
    per_seed,
)
from skidpad.evidence.drive.findings import FINDINGS
from skidpad.evidence.rates import RateBelow, rate_below
from skidpad.evidence.statistics import event_rate
from skidpad.evidence.verdicts import Finding, Verdict, judge

BY_ID = {f.id: f for f in FINDINGS}
WEATHERS = [f"{p}-{t}" for p in ("clear", "rain") for t in ("sunrise", "noon", "night")]
Row = dict[str, Any]
Effect = Callable[[Row], dict[str, float]]

NEUTRAL = {
    "fatal_collisions": 3.0,
    "crashes_vehicle": 3.0,
    "max_impact_vehicle_kmh": 40.0,
    "lane_invasions": 5.0,
    "bend_speed_kmh": 90.0,
    "mean_speed_kmh": 50.0,
    "p95_speed_kmh": 100.0,
    "dropout_pct": 8.0,
    "mean_error_m": 3.0,
    "headway_variance_m2": 60.0,
    "radar_fpr_pct": 50.0,
    "radar_fpr_pct_pre": 60.0,
    "radar_fnr_pct": 5.0,
    "min_ttc_s": 0.1,
    "ttc_below_1_5_s": 10.0,
    "phantom_brakings": 3.0,
    "surges": 3.0,
    "mode_changes_per_min": 6.0,
    "jerk_rms": 5.0,
    "spins": 3.0,
    "hits_in_cool_down": 3.0,
    "chained": 3.0,
}
NOISE = {"min_ttc_s": 0.01}
COUNTS = (
    *("fatal_collisions", "crashes_vehicle", "lane_invasions"),
    *("surges", "spins", "hits_in_cool_down", "chained"),
)
RARE = ("F-07", "F-07v", "F-18", "F-29", "F-30")  # claims that a rate is next to nothing


def is_config(row: Row, name: str) -> int:
    return int(row["config"] == name)


def order(row: Row) -> dict[str, float]:
    return {"fatal_collisions": {"0": 14.0, "3": 10.0, "2": 6.0, "1": 3.0}.get(row["config"], 0)}


def shifts(**by: Callable[[Row], float]) -> Effect:
    return lambda row: {column: NEUTRAL[column] + f(row) for column, f in by.items()}


def limited(row: Row) -> dict[str, float]:
    return {"fatal_collisions": 0.0 if row["config"] == "4" else 4.0}


def night(row: Row) -> int:
    return int(row["time_of_day"] == "night")


def variant(name: str) -> Callable[[Row], float]:
    return lambda row: 3.0 * (row["variant"] == name)


TRUE: dict[str, Effect] = {
    "F-01": order,
    "F-04": shifts(
        fatal_collisions=lambda r: 4 * is_config(r, "2"),
        bend_speed_kmh=lambda r: 30 * is_config(r, "2"),
    ),
    "F-05": shifts(
        mean_speed_kmh=lambda r: 9 * is_config(r, "2"),
        p95_speed_kmh=lambda r: 9 * is_config(r, "2"),
        bend_speed_kmh=lambda r: 9 * is_config(r, "2"),
    ),
    "F-07": limited,
    "F-10": shifts(lane_invasions=lambda r: 5 * is_config(r, "1")),
    "F-11": shifts(dropout_pct=lambda r: 4 * (r["weather"] == "clear-noon")),
    "F-12": shifts(
        mean_error_m=lambda r: 3 * night(r), headway_variance_m2=lambda r: 30 * night(r)
    ),
    "F-13": shifts(fatal_collisions=lambda r: 4 * (r["precipitation_kind"] == "rain")),
    "F-16": shifts(
        radar_fpr_pct=lambda r: 30 * is_config(r, "0"),
        radar_fpr_pct_pre=lambda r: 30 + 30 * is_config(r, "0"),
    ),
    "F-17": shifts(phantom_brakings=variant("safety_persist")),
    "F-21": shifts(
        radar_fpr_pct=variant("map_matched"),
        radar_fnr_pct=variant("corridor"),
        dropout_pct=variant("corridor"),
    ),
    "F-26": shifts(ttc_below_1_5_s=lambda r: 9 * is_config(r, "3")),
}


def among_vehicles(effect: Effect) -> Effect:
    """The same of crashes with vehicles, while the others stay as they are."""

    def moved(row: Row) -> dict[str, float]:
        claimed = effect(row)
        return {c.replace("fatal_collisions", "crashes_vehicle"): v for c, v in claimed.items()}

    return moved


TRUE |= {f"{id}v": among_vehicles(TRUE[id]) for id in ("F-01", "F-04", "F-07", "F-13")}
TRUE["F-05v"] = shifts(max_impact_vehicle_kmh=lambda r: 9 * is_config(r, "2"))
TRUE |= {
    "F-12n": shifts(dropout_pct=variant("night")),
    "F-13nv": shifts(crashes_vehicle=variant("rain")),
    "F-18": lambda r: {"surges": 0.0 if r["variant"] == "coast" else 4.0},
    "F-19": shifts(mode_changes_per_min=variant("one_pid"), jerk_rms=variant("one_pid")),
    "F-29": lambda r: {"spins": 0.0 if r["variant"] == "released" else 4.0},
    "F-30": lambda r: {"hits_in_cool_down": 0.0},
    "F-30a": shifts(chained=variant("no_clearance")),
}
VARIANTS = {
    "F-12n": ("exact", "night"),
    "F-13nv": ("exact", "rain"),
    "F-18": ("coast", "no_coast"),
    "F-19": ("zones", "one_pid"),
    "F-29": ("released", "engaged"),
    "F-30": ("whole",),
    "F-30a": ("whole", "no_clearance"),
    "F-17": ("cascade", "safety_persist"),
    "F-21": ("map_matched", "corridor"),
}


def campaign(
    id: str, effect: Effect, size: float, seeds: int = 8, noise: float = 0.6
) -> pl.DataFrame:
    """Results in which `effect` acts `size` times: 1 as claimed, -1 reversed, 0 not at all."""
    rng = np.random.default_rng(11)
    rows = []
    cells = product("01234", WEATHERS, range(seeds), VARIANTS.get(id, ("",)))
    for config, weather, seed, kind in cells:
        row: Row = {
            "config": config,
            "weather": weather,
            "precipitation_kind": weather.split("-")[0],
            "time_of_day": weather.split("-")[1],
            "seed": seed,
            "variant": kind,
            "outcome": "completed",
            "log_hash": f"{config}{weather}{seed}{kind}",
        }
        claimed = effect(row)
        for column, neutral in NEUTRAL.items():
            value = neutral + size * (claimed.get(column, neutral) - neutral)
            value += rng.normal(0.0, NOISE.get(column, noise))
            row[column] = max(round(value), 0) if column in COUNTS else value
        rows.append(row)
    return pl.DataFrame(rows)


def clear_campaign(id: str, size: float) -> pl.DataFrame:
    return campaign(id, TRUE[id], size, noise=0.15 if id in RARE else 0.6)


def verdict(id: str, table: pl.DataFrame | None) -> Verdict:
    return judge([BY_ID[id]], [table])[0].verdict


@pytest.mark.parametrize("id", TRUE)
def test_data_that_show_the_claim_support_it_and_inverted_data_contradict_it(id: str) -> None:
    assert verdict(id, clear_campaign(id, 1.0)) is Verdict.SUPPORTED
    assert verdict(id, clear_campaign(id, -1.0)) is Verdict.CONTRADICTED


@pytest.mark.parametrize("id", TRUE)
def test_no_table_or_no_rows_is_not_testable(id: str) -> None:
    assert verdict(id, None) is Verdict.NOT_TESTABLE
    assert verdict(id, campaign(id, TRUE[id], 1.0, seeds=1).clear()) is Verdict.NOT_TESTABLE


@pytest.mark.parametrize("id", ["F-05", "F-10", "F-11", "F-13", "F-17"])
def test_one_noisy_seed_is_undecided_and_says_how_many_it_takes(id: str) -> None:
    effect = campaign(id, TRUE[id], 0.3, seeds=2, noise=9.0)
    judged = judge([BY_ID[id]], [effect])[0]
    assert judged.verdict is Verdict.UNDECIDED
    assert judged.seeds_needed is not None
    assert judged.seeds_needed > 2
    assert f"about {judged.seeds_needed} seeds" in judged.text


def test_an_effect_below_the_margin_contradicts() -> None:
    table = campaign("F-11", TRUE["F-11"], 0.0, noise=0.1)
    judged = judge([BY_ID["F-11"]], [table])[0]
    assert judged.verdict is Verdict.CONTRADICTED
    assert "Smaller than the margin" in judged.text


def test_equal_drives_are_by_construction() -> None:
    table = campaign("F-11", TRUE["F-11"], 0.0, noise=0.0)
    same = table.with_columns(log_hash=pl.col("config") + pl.col("seed").cast(pl.String))
    assert verdict("F-11", same) is Verdict.BY_CONSTRUCTION


def test_one_side_of_several_equal_weathers_is_still_the_same_drive() -> None:
    """By day there are two weathers and by night one: where all three are one drive, so are both sides."""
    table = campaign("F-12", TRUE["F-12"], 0.0, noise=0.0)
    drive = pl.concat_str("config", "precipitation_kind", pl.col("seed").cast(pl.String))
    assert verdict("F-12", table.with_columns(log_hash=drive)) is Verdict.BY_CONSTRUCTION


def test_equal_drives_say_nothing_of_a_claim_that_is_not_built_in() -> None:
    table = campaign("F-10", TRUE["F-10"], 0.0, noise=0.0)
    same = table.with_columns(log_hash=pl.col("seed").cast(pl.String))
    assert verdict("F-10", same) is Verdict.SAME_DRIVES


def study(speed: float, dropout: float) -> pl.DataFrame:
    rng = np.random.default_rng(5)
    return pl.DataFrame(
        {
            "target_kmh": float(v),
            "dropout_injected": d,
            "seed": seed,
            "fatal_collisions": (
                n := max(
                    round(
                        5 + speed * (v - 100) / 20 + dropout * (d - 0.2) * 10 + rng.normal(0, 0.5)
                    ),
                    0,
                )
            ),
            "crashes_vehicle": n,
        }
        for v, d, seed in product((60, 100, 150), (0.0, 0.2, 0.4), range(12))
    )


@pytest.mark.parametrize("id", ["F-08", "F-08v"])
def test_speed_against_dropout(id: str) -> None:
    f = [BY_ID[id]]
    assert judge(f, [study(2.0, 0.1)])[0].verdict is Verdict.SUPPORTED
    assert judge(f, [study(0.0, 2.0)])[0].verdict is Verdict.CONTRADICTED
    assert judge(f, [None])[0].verdict is Verdict.NOT_TESTABLE
    assert len(f[0].contrasts(study(2.0, 0.1))) == 2


def test_one_unequal_log_contradicts_independence_of_pace() -> None:
    rows = [
        {"variant": v, "seed": s, "log_hash": f"h{s}"}
        for v in ("paced", "slowed")
        for s in range(4)
    ]
    assert verdict("F-25", pl.DataFrame(rows)) is Verdict.SUPPORTED
    rows[6]["log_hash"] = "other"
    assert verdict("F-25", pl.DataFrame(rows)) is Verdict.CONTRADICTED
    assert verdict("F-25", pl.DataFrame(rows[:4])) is Verdict.NOT_TESTABLE


def test_crashed_runs_leave_the_comparison() -> None:
    table = campaign("F-10", TRUE["F-10"], 1.0)
    broken = table.with_columns(outcome=pl.lit("crashed"), lane_invasions=pl.lit(0))
    both = pl.concat([table, broken.cast(table.schema)])
    honest = judge([BY_ID["F-10"]], [table])[0].contrasts[0].mean
    assert judge([BY_ID["F-10"]], [both])[0].contrasts[0].mean == honest


@dataclass(frozen=True)
class Given:
    """A criterion whose differences are known."""

    values: list[float]
    margin: float = 0.0
    test: tuple[str, ...] = ()
    amounts: tuple[Amount, ...] = ()

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        return contrast_pairs("d", self.values, self.margin)


def test_holm_makes_a_claim_harder_in_a_long_report() -> None:
    def found(values: list[float]) -> Finding:
        return Finding("X", "", "", "", (Given(values),))

    clear, noise = [1.0, 1.1] * 4, [1.0, -1.0, 1.0, -1.0]
    table = pl.DataFrame({"seed": [1]})
    assert judge([found(clear)], [table])[0].verdict is Verdict.SUPPORTED
    family = [found(clear)] + [found(noise)] * 7
    assert judge(family, [table] * 8)[0].verdict is Verdict.UNDECIDED


@pytest.mark.req("X-7")
def test_a_difference_below_its_margin_contradicts_only_after_correction() -> None:
    def found(values: list[float]) -> Finding:
        return Finding("X", "", "", "", (Given(values, 0.5),))

    small, noise = [0.0, 0.1] * 3, [2.0, -1.0] * 3
    table = pl.DataFrame({"seed": [1]})
    assert judge([found(small)], [table])[0].verdict is Verdict.CONTRADICTED
    family = [found(small)] + [found(noise)] * 7
    assert judge(family, [table] * 8)[0].verdict is Verdict.UNDECIDED


def test_weathers_of_one_seed_are_one_unit() -> None:
    (contrast,) = BY_ID["F-10"].contrasts(campaign("F-10", TRUE["F-10"], 1.0, seeds=3))
    assert contrast.units == 3
    assert contrast.p_claimed == pytest.approx(1.0 / 8.0)


def test_a_rate_is_bounded_exactly() -> None:
    none = rate_below("r", 0, 40, 0.1)
    assert none.p_claimed == pytest.approx(np.exp(-4.0))
    assert none.interval is None
    counts = event_rate([1, 0] * 20)
    many = rate_below("r", 20, 40, 0.1, counts)
    assert many.p_against < 1e-6
    assert many.interval == (0.1 - counts.interval.high, 0.1 - counts.interval.low)
    few = rate_below("r", 1, 40, 0.1, event_rate([1] + [0] * 39))
    assert few.without_limits == "1 of 40 seeds had one, at most 11 % do (95 %)"


def test_every_finding_is_written_out_before_results_are_seen() -> None:
    headline = {1, 4, 5, 7, 8, 10, 11, 12, 13, 16, 17, 21, 25, 26}
    vehicles = {1, 4, 5, 7, 8, 13}
    ids = [f"F-{n:02}" for n in headline] + [f"F-{n:02}v" for n in vehicles]
    studies = ["F-18", "F-19", "F-29", "F-30", "F-30a", "F-30b", "F-30c"]
    noise = ["F-12n", "F-12nv", "F-13n", "F-13nv"]
    assert [f.id for f in FINDINGS] == sorted(ids + studies + noise)
    for f in FINDINGS:
        assert all((f.claim, f.estimand, f.needs, f.test, f.margin)), f.id
    studied = {"F-08", "F-08v", "F-17", "F-21", "F-25", *studies, *noise}
    assert {f.id for f in FINDINGS if f.study} == studied


@pytest.mark.parametrize("id", ["F-01", "F-04", "F-07", "F-13"])
def test_crashes_with_vehicles_are_judged_apart_from_barriers(id: str) -> None:
    barriers_alone = clear_campaign(id, 1.0)
    assert verdict(id, barriers_alone) is Verdict.SUPPORTED
    assert verdict(f"{id}v", barriers_alone) is not Verdict.SUPPORTED
    vehicles_alone = clear_campaign(f"{id}v", 1.0)
    assert verdict(f"{id}v", vehicles_alone) is Verdict.SUPPORTED
    assert verdict(id, vehicles_alone) is not Verdict.SUPPORTED


def test_speeds_of_impact_are_compared_where_both_sides_hit_a_vehicle() -> None:
    table = campaign("F-05v", TRUE["F-05v"], 1.0)
    rare = table.with_columns(
        max_impact_vehicle_kmh=pl.when((pl.col("config") == "1") & (pl.col("seed") > 2))
        .then(None)
        .otherwise("max_impact_vehicle_kmh")
    )
    (contrast,) = BY_ID["F-05v"].contrasts(rare)
    assert contrast.units == 3
    assert verdict("F-05v", rare.filter(pl.col("seed") > 2)) is Verdict.NOT_TESTABLE


def weathers_alike(seed: int, counts: dict[str, int]) -> list[Row]:
    """Runs of two configurations; the clear weathers are one drive, for weather cannot act there."""
    return [
        {
            "config": config,
            "weather": weather,
            "seed": seed,
            "fatal_collisions": n * int(config == "2"),
            "log_hash": f"{config} {seed} {weather if 'rain' in weather else 'clear'}",
        }
        for config in ("1", "2")
        for weather, n in counts.items()
    ]


@pytest.mark.req("R-7")
def test_the_same_two_drives_are_one_pair_however_many_weathers_they_stand_for() -> None:
    clear = {w: 1 for w in WEATHERS if w.startswith("clear")}
    table = pl.DataFrame(weathers_alike(1, clear | {"rain-noon": 5}))
    sides = (pl.col("config") == "2", pl.col("config") == "1")
    pairs, same = paired_runs(table, *sides, ("weather", "seed"), "fatal_collisions")
    assert not same
    assert sorted(pairs["difference"].to_list()) == [1.0, 5.0]
    assert per_seed(pairs, pl.col("difference")).to_list() == [3.0]  # not 8 / 4
    unknown = table.with_columns(log_hash=pl.lit(None, pl.String))
    assert len(paired_runs(unknown, *sides, ("weather", "seed"), "fatal_collisions")[0]) == 4


@pytest.mark.req("R-7")
def test_rates_count_each_drive_once() -> None:
    table = pl.DataFrame(
        [row for seed in (1, 2) for row in weathers_alike(seed, dict.fromkeys(WEATHERS[:3], 2))]
    )
    assert len(distinct(table)) == 4
    rate = RateBelow(
        what="all", events=pl.col("fatal_collisions").sum(), limit=Amount(5.0),
        where=pl.col("config") == "2",
    )  # fmt: skip
    found = rate.draw(table)
    assert found is not None
    assert (found.mean, found.units) == (3.0, 2)  # two a run, and two runs


@pytest.mark.req("R-7")
def test_what_moved_alike_is_one_drive_whatever_the_rest_of_its_log_says() -> None:
    """Decision T-3: a lamp that is seen at noon and not at night makes no second drive."""
    clear = {w: 1 for w in WEATHERS if w.startswith("clear")}
    table = pl.DataFrame(weathers_alike(1, clear | {"rain-noon": 5})).with_columns(
        motion_hash=pl.col("log_hash"), log_hash=pl.col("log_hash") + pl.col("weather")
    )
    sides = (pl.col("config") == "2", pl.col("config") == "1")
    pairs, _ = paired_runs(table, *sides, ("weather", "seed"), "fatal_collisions")
    assert sorted(pairs["difference"].to_list()) == [1.0, 5.0]
    assert len(distinct(table)) == 4
    older = table.drop("motion_hash")
    assert len(distinct(older)) == len(table)
    unknown = table.with_columns(motion_hash=pl.lit(None, pl.String))
    assert len(distinct(unknown)) == len(table)


def test_drives_that_moved_alike_and_were_seen_otherwise_are_not_the_same() -> None:
    """Equal motion must not hide what the sensors saw: dropout may still differ."""
    table = campaign("F-11", TRUE["F-11"], 5.0, noise=0.1)
    same = table.with_columns(motion_hash=pl.col("config") + pl.col("seed").cast(pl.String))
    assert verdict("F-11", same) is Verdict.SUPPORTED
