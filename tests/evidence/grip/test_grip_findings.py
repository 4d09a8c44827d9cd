"""Findings of the friction study: each verdict follows from the data, and inverted data flip it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.grip.findings import BASELINES, CUT_IN, FINDINGS, FRONT, LEAD, RAIN
from skidpad.evidence.verdicts import Verdict, judge

SEEDS = range(1, 41)
ICE = ("icy_10", "icy_30", "icy_70", "icy_100")
Row = dict[str, object]


def table(change: Callable[[Row, np.random.Generator], None]) -> pl.DataFrame:
    rng = np.random.default_rng(5)
    rows = []
    for scenario in (CUT_IN, LEAD, FRONT):
        for weather in (*BASELINES, *RAIN, *ICE):
            for friction in ("original", "reduced"):
                for seed in SEEDS:
                    row = {
                        "scenario": scenario, "weather": weather, "friction": friction,
                        "seed": seed, "cutin": "fixed", "outcome": "completed",
                        "completion": True, "loss_of_control_npc": False, "min_cvip_m": 10.0,
                        "steer_std": 0.02, "delay_s": 0.0,
                        "log_hash": f"{scenario}{weather}{friction}{seed}",
                    }  # fmt: skip
                    change(row, rng)
                    rows.append(row)
    for cutin in ("original", "unfixed"):
        for seed in SEEDS:
            row = dict(
                rows[0], scenario=CUT_IN, weather="rain_0", cutin=cutin, seed=seed,
                log_hash=f"{cutin}{seed}", friction="original", completion=True,
            )  # fmt: skip
            change(row, rng)
            rows.append(row)
    return pl.DataFrame(rows, infer_schema_length=None)


def fails(row: Row, p: float, rng: np.random.Generator) -> None:
    if rng.random() < p:
        row["completion"] = False


def is_(row: Row, scenario: str, *weathers: str, friction: str = "reduced") -> bool:
    return (
        row["scenario"] == scenario
        and row["weather"] in weathers
        and row["friction"] == friction
        and row["cutin"] == "fixed"
    )


def bf01(row: Row, rng: np.random.Generator) -> None:
    if row["friction"] == "reduced":
        fails(row, 0.5, rng)


def bf02(row: Row, rng: np.random.Generator) -> None:
    if is_(row, LEAD, "icy_70", "icy_100"):
        fails(row, 1.0, rng)


def bf04(row: Row, rng: np.random.Generator) -> None:
    if is_(row, CUT_IN, "icy_30"):
        fails(row, 0.7, rng)


def bf05(row: Row, rng: np.random.Generator) -> None:
    if is_(row, CUT_IN, "icy_70", "icy_100", friction="original"):
        fails(row, 0.6, rng)
    if is_(row, CUT_IN, *ICE):
        row["loss_of_control_npc"] = True


def bf06(row: Row, rng: np.random.Generator) -> None:
    if is_(row, FRONT, "icy_10"):
        fails(row, 0.9, rng)


def bf07(row: Row, rng: np.random.Generator) -> None:
    if is_(row, FRONT, *RAIN):
        fails(row, 0.5, rng)


def bf09(row: Row, rng: np.random.Generator) -> None:
    if is_(row, CUT_IN, "icy_100"):
        row["delay_s"] = float(rng.normal(2.0, 0.5))


def bf10(row: Row, rng: np.random.Generator) -> None:
    depth = {"icy_0": 0, "icy_10": 1, "icy_30": 2, "icy_70": 3}
    if row["weather"] in depth and row["scenario"] == LEAD:
        row["min_cvip_m"] = 10.0 - depth[str(row["weather"])] + float(rng.normal(0.0, 0.2))


def bf11(row: Row, rng: np.random.Generator) -> None:
    if is_(row, FRONT, "icy_100", "rain_100"):
        row["steer_std"] = 0.05 + float(rng.normal(0.0, 0.005))


def bf18(row: Row, rng: np.random.Generator) -> None:
    if row["cutin"] == "unfixed":
        fails(row, 0.9, rng)


WORLDS = {
    "BF-01": bf01, "BF-02": bf02, "BF-03": bf02, "BF-04": bf04, "BF-05": bf05, "BF-06": bf06,
    "BF-07": bf07, "BF-09": bf09, "BF-10": bf10, "BF-11": bf11, "BF-12": bf05, "BF-18": bf18,
}  # fmt: skip
CLAIMS = {f.id: f for f in FINDINGS}


def inverted(world: pl.DataFrame) -> pl.DataFrame:
    """Original and reduced change places, ice levels their order, the delay its sign."""
    swap = {"original": "reduced", "reduced": "original"}
    levels = dict(zip(("icy_0", *ICE), reversed(("icy_0", *ICE)), strict=True))
    variants = {"original": "unfixed", "unfixed": "original"}
    return world.with_columns(
        friction=pl.when(pl.col("cutin") == "fixed")
        .then(pl.col("friction").replace(swap))
        .otherwise(pl.col("friction")),
        weather=pl.col("weather").replace(levels),
        cutin=pl.col("cutin").replace(variants),
        delay_s=-pl.col("delay_s"),
    )


@pytest.mark.req("X-6", "X-7")
@pytest.mark.parametrize("name", list(WORLDS))
def test_a_world_in_which_it_is_true_supports_it(name):
    (judged,) = judge([CLAIMS[name]], [table(WORLDS[name])])
    assert judged.verdict is Verdict.SUPPORTED, judged.text


@pytest.mark.req("X-7")
@pytest.mark.parametrize("name", list(WORLDS))
def test_a_world_in_which_nothing_happens_does_not_support_it(name):
    (judged,) = judge([CLAIMS[name]], [table(lambda row, rng: None)])
    assert judged.verdict in (Verdict.CONTRADICTED, Verdict.UNDECIDED), judged.text


@pytest.mark.req("X-7")
@pytest.mark.parametrize("name", [n for n in WORLDS if n not in ("BF-01",)])
def test_an_inverted_world_contradicts_it(name):
    (judged,) = judge([CLAIMS[name]], [inverted(table(WORLDS[name]))])
    assert judged.verdict is Verdict.CONTRADICTED, judged.text


def test_equal_drives_at_ratio_1_are_so_by_construction():
    same = table(lambda row, rng: row.update(log_hash=f"{row['scenario']}{row['seed']}"))
    (judged,) = judge([CLAIMS["BF-13"]], [same])
    assert judged.verdict is Verdict.BY_CONSTRUCTION


def test_without_its_runs_a_finding_is_not_testable():
    some = table(bf04).filter(pl.col("scenario") == LEAD, pl.col("cutin") == "fixed")
    for name in ("BF-04", "BF-07", "BF-18"):
        (judged,) = judge([CLAIMS[name]], [some])
        assert judged.verdict is Verdict.NOT_TESTABLE


def test_all_headline_findings_are_there():
    numbers = (1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 18)
    assert [f.id for f in FINDINGS] == [f"BF-{n:02d}" for n in numbers]


def test_a_difference_too_small_to_matter_does_not_support_however_sure_it_is():
    def tiny(row: Row, rng: np.random.Generator) -> None:
        if is_(row, FRONT, "icy_100", "rain_100"):
            row["steer_std"] = 0.02 + 1e-5

    (judged,) = judge([CLAIMS["BF-11"]], [table(tiny)])
    assert judged.p is not None
    assert judged.p < 0.05
    assert judged.verdict is Verdict.CONTRADICTED
