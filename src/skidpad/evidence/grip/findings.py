"""The headline findings of the friction study as data (decision X-7).

Each takes the results table of a campaign, with the column `delay_s` where series were compared.
"""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from skidpad.evidence.contrasts import complete, contrast, differences
from skidpad.evidence.verdicts import Contrast, Finding, paired

SHARE = 0.05  # of runs: a smaller change of completion does not matter
CERTAIN = 0.9  # of runs
METRES = 0.2
SECONDS = 0.2
STEER = 0.005
BASELINES = ("rain_0", "icy_0")
RAIN = ("rain_20", "rain_40", "rain_60", "rain_80", "rain_100")
CUT_IN, LEAD, FRONT = "ghost_cut_in", "lead_slowdown", "front_accident"
BY = ("scenario", "weather", "seed")
ORIGINAL, REDUCED = pl.col("friction") == "original", pl.col("friction") == "reduced"
PROPER = pl.col("cutin") == "fixed"


def proper(table: pl.DataFrame, scenario: str | None = None, *weathers: str) -> pl.DataFrame:
    """Runs of the campaign proper, of one scenario and some weathers."""
    rows = table.filter(PROPER)
    if scenario is not None:
        rows = rows.filter(pl.col("scenario") == scenario)
    return rows.filter(pl.col("weather").is_in(weathers)) if weathers else rows


def lost(table: pl.DataFrame, scenario: str, *weathers: str) -> list[Contrast]:
    """Completion that friction takes: original minus reduced, one contrast per weather."""
    return complete(
        [
            contrast(
                proper(table, scenario, w),
                f"completion in {scenario}, {w}: original minus reduced",
                "completion", ORIGINAL, REDUCED, BY, SHARE,
            )
            for w in weathers
        ]
    )  # fmt: skip


def kept(table: pl.DataFrame, scenario: str, *weathers: str) -> list[Contrast]:
    """Friction takes less completion than the margin."""
    rows = proper(table, scenario, *weathers)
    values, same = differences(rows, ORIGINAL, REDUCED, BY, "completion")
    label = f"{SHARE:g} minus the completion lost in {scenario}, {', '.join(weathers)}"
    return [paired(label, (SHARE - values).to_numpy(), 0.0, same)] if len(values) else []


def more_than(table: pl.DataFrame, scenario: str, high: str, low: str) -> list[Contrast]:
    """With reduced friction more runs complete in one weather than in the other."""
    rows = proper(table, scenario).filter(REDUCED)
    more, less = pl.col("weather") == high, pl.col("weather") == low
    label = f"completion in {scenario} with reduced friction: {high} minus {low}"
    return contrast(rows, label, "completion", more, less, ("seed",), SHARE)


def bf01(table: pl.DataFrame) -> list[Contrast]:
    """How often the outcome of a pair changes; and in which direction on the whole."""
    rows = proper(table).filter(~pl.col("weather").is_in(BASELINES))
    values, same = differences(rows, ORIGINAL, REDUCED, BY, "completion")
    if not len(values):
        return []
    changed = (values != 0).cast(pl.Float64) - SHARE
    return [
        paired(
            f"share of pairs with another outcome, minus {SHARE:g}", changed.to_numpy(), 0.0, same
        ),
        paired("completion, original minus reduced", values.to_numpy(), SHARE, same),
    ]


def bf02(table: pl.DataFrame) -> list[Contrast]:
    """A certain crash: nearly all runs."""
    rows = proper(table, LEAD, "icy_70", "icy_100").filter(REDUCED)
    crashed = (1.0 - rows.sort(*BY)["completion"].drop_nulls().cast(pl.Float64)) - CERTAIN
    certain = (
        [
            paired(
                f"share of crashes with reduced friction, minus {CERTAIN:g}",
                crashed.to_numpy(),
                0.0,
            )
        ]
        if len(crashed)
        else []
    )
    return complete(
        [lost(table, LEAD, "icy_70", "icy_100"), certain, kept(table, LEAD, "icy_10", "icy_30")]
    )


def bf03(table: pl.DataFrame) -> list[Contrast]:
    """A step between 30 and 70, none after."""
    rows = proper(table, LEAD).filter(REDUCED)
    thick, thicker = (pl.col("weather") == w for w in ("icy_70", "icy_100"))
    values, _ = differences(rows, thick, thicker, ("seed",), "completion")
    flat = (
        [
            paired(
                f"{SHARE:g} minus completion lost from icy_70 to icy_100",
                (SHARE - values).to_numpy(),
                0.0,
            )
        ]
        if len(values)
        else []
    )
    return complete([more_than(table, LEAD, "icy_30", "icy_70"), flat])


def bf04(table: pl.DataFrame) -> list[Contrast]:
    """Cut-in at icy_30."""
    return lost(table, CUT_IN, "icy_30")


def bf05(table: pl.DataFrame) -> list[Contrast]:
    """Safer on thick ice, because the other vehicle loses control."""
    rows = proper(table, CUT_IN, "icy_70", "icy_100")
    gained = contrast(
        rows, "completion on thick ice: reduced minus original",
        "completion", REDUCED, ORIGINAL, BY, SHARE,
    )  # fmt: skip
    return complete([gained, npc_loses(rows)])


def npc_loses(rows: pl.DataFrame) -> list[Contrast]:
    """Another vehicle loses control more often with reduced friction."""
    label = "runs in which another vehicle loses control: reduced minus original"
    return contrast(rows, label, "loss_of_control_npc", REDUCED, ORIGINAL, BY, SHARE)


def bf06(table: pl.DataFrame) -> list[Contrast]:
    """Thin ice is worse than thick ice."""
    return complete(
        [
            lost(table, FRONT, "icy_10"),
            more_than(table, FRONT, "icy_30", "icy_10"),
            more_than(table, FRONT, "icy_100", "icy_10"),
        ]
    )


def bf07(table: pl.DataFrame) -> list[Contrast]:
    """Only one of three scenarios."""
    rows = proper(table, FRONT, *RAIN)
    hurt = contrast(
        rows, "completion of the front accident in rain: original minus reduced",
        "completion", ORIGINAL, REDUCED, BY, SHARE,
    )  # fmt: skip
    return complete([hurt, kept(table, CUT_IN, *RAIN), kept(table, LEAD, *RAIN)])


def bf09(table: pl.DataFrame) -> list[Contrast]:
    """Column delay_s, of reduced runs; a run that no constant shift explains has none."""
    if "delay_s" not in table.columns:
        return []
    rows = proper(table, CUT_IN, "icy_100").filter(REDUCED).sort("seed")
    if not len(rows):
        return []
    delay = rows["delay_s"].fill_null(0.0).to_numpy()
    return [paired("delay in s, cut-in at icy_100", delay, SECONDS)]


def bf10(table: pl.DataFrame) -> list[Contrast]:
    """Least distance, step by step."""
    rows = proper(table, LEAD).filter(REDUCED)
    steps = (("icy_0", "icy_10"), ("icy_10", "icy_30"), ("icy_30", "icy_70"))
    return complete(
        [
            contrast(
                rows, f"least distance in m: {a} minus {b}", "min_cvip_m",
                pl.col("weather") == a, pl.col("weather") == b, ("seed",), METRES,
            )
            for a, b in steps
        ]
    )  # fmt: skip


def bf11(table: pl.DataFrame) -> list[Contrast]:
    """Spread of the steering command."""
    rows = proper(table, FRONT, "icy_100", "rain_100")
    label = "deviation of steering, front accident: reduced minus original"
    return contrast(rows, label, "steer_std", REDUCED, ORIGINAL, BY, STEER)


def bf12(table: pl.DataFrame) -> list[Contrast]:
    """Spins in the cut-in on ice."""
    return npc_loses(proper(table, CUT_IN, "icy_30", "icy_70", "icy_100"))


def bf13(table: pl.DataFrame) -> list[Contrast]:
    """Equal drives at ratio 1."""
    rows = proper(table).filter(pl.col("weather").is_in(BASELINES))
    values, same = differences(rows, ORIGINAL, REDUCED, BY, "completion")
    label = f"{SHARE:g} minus the change of completion at ratio 1"
    return [paired(label, (SHARE - values.abs()).to_numpy(), 0.0, same)] if len(values) else []


def bf18(table: pl.DataFrame) -> list[Contrast]:
    """Three variants at the baseline."""
    rows = table.filter((pl.col("scenario") == CUT_IN) & ORIGINAL)

    def step(more: str, less: str) -> list[Contrast]:
        high, low = pl.col("cutin") == more, pl.col("cutin") == less
        label = f"completion of the cut-in: {more} minus {less}"
        return contrast(rows, label, "completion", high, low, ("weather", "seed"), SHARE)

    return complete([step("original", "unfixed"), step("fixed", "unfixed")])


TEST = "paired by scenario, weather and seed; sign changes; bootstrap interval"
MARGIN = f"{SHARE:g} of runs"


def _finding(
    id: str, claim: str, estimand: str, needs: str, contrasts: object, margin: str = MARGIN
) -> Finding:
    return Finding(
        id=id, claim=claim, estimand=estimand, needs=needs, test=TEST, margin=margin,
        contrasts=contrasts,  # type: ignore[arg-type]
    )  # fmt: skip


ALL = "all scenarios and weathers with both frictions"
FINDINGS: Sequence[Finding] = (
    _finding("BF-01", "Weather without physics misleads.",
             "share of pairs whose outcome changes; mean completion", ALL, bf01),
    _finding("BF-02", "Thick ice makes a lead slowdown a certain crash.",
             "completion lost at icy_70 and icy_100, share of crashes; none lost up to icy_30",
             "lead slowdown on ice", bf02),
    _finding("BF-03", "In a lead slowdown a threshold lies between ice 30 and 70; beyond, nothing changes.",
             "completion with reduced friction between ice levels", "lead slowdown on ice", bf03),
    _finding("BF-04", "At icy_30 friction turns the cut-in into an accident.",
             "completion lost at icy_30", "cut-in at icy_30", bf04),
    _finding("BF-05", "At icy_70 and icy_100 the cut-in looks safer, as the other vehicle slides away.",
             "completion gained; runs in which the other vehicle loses control", "cut-in on ice", bf05),
    _finding("BF-06", "In the front accident thin ice is worse than thick ice.",
             "completion lost at icy_10, and between ice levels", "front accident on ice", bf06),
    _finding("BF-07", "Rain hurts only the front accident.",
             "completion lost in rain, by scenario", "all scenarios in rain", bf07),
    _finding("BF-09", "With less grip the same events happen later by a constant shift.",
             "delay of the speed series", "cut-in at icy_100, with series", bf09, f"{SECONDS:g} s"),
    _finding("BF-10", "The least distance falls as ice thickens in the lead slowdown.",
             "least distance between neighbouring ice levels", "lead slowdown on ice", bf10,
             f"{METRES:g} m"),
    _finding("BF-11", "With reduced friction steering spreads wider.",
             "deviation of the steering command", "front accident at icy_100 and rain_100", bf11,
             f"{STEER:g} of full steer"),
    _finding("BF-12", "In the cut-in on ice the other vehicle spins out.",
             "runs in which another vehicle loses control", "cut-in on ice", bf12),
    _finding("BF-13", "Nothing changes at ratio 1.",
             "change of completion at rain_0 and icy_0", "rain_0 and icy_0", bf13),
    _finding("BF-18", "A spawn delay alone breaks the cut-in, and a shorter merge distance repairs it.",
             "completion of the variants, friction untouched",
             "--cutin original,unfixed,fixed at rain_0", bf18),
)  # fmt: skip
