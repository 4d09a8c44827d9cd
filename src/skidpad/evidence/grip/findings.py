"""The headline findings of the friction study as data (decision X-7).

Each takes the results table of a campaign, with the column `delay_s` where series were compared.
"""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import Amount, Claim, Mean, Paired, Rows, rows_of
from skidpad.evidence.verdicts import Finding

SHARE = Amount(0.05, "of runs")  # a smaller change of completion does not matter
CERTAIN = 0.9  # of runs
METRES = Amount(0.2, "m")
SECONDS = Amount(0.2, "s")
STEER = Amount(0.005, "of full steer")
BASELINES = ("rain_0", "icy_0")
RAIN = ("rain_20", "rain_40", "rain_60", "rain_80", "rain_100")
CUT_IN, LEAD, FRONT = "ghost_cut_in", "lead_slowdown", "front_accident"
BY = ("scenario", "weather", "seed")
ORIGINAL, REDUCED = rows_of("friction", "original"), rows_of("friction", "reduced")
BASELINE = Rows("the baselines", pl.col("weather").is_in(BASELINES))


def proper(*more: Rows) -> Rows:
    """Returns the runs of the campaign proper that are in all of these rows."""
    name = ", ".join(rows.name for rows in more)
    return Rows(name, pl.all_horizontal(pl.col("cutin") == "fixed", *(rows.are for rows in more)))


def scene(scenario: str, *weathers: str) -> Rows:
    """Returns the runs of one scenario in some weathers, in all without any."""
    rows = rows_of("scenario", scenario)
    return proper(rows, rows_of("weather", *weathers)) if weathers else proper(rows)


def frictions(
    where: Rows, column: str = "completion", amount: Amount = SHARE, claim: Claim = Claim.MORE
) -> Paired:
    """Returns the claim that `column` is larger with original than with reduced friction.

    claim: what is said instead of that, e.g. hardly more.
    """
    return Paired(
        column=column, more=ORIGINAL, less=REDUCED, by=BY, amount=amount, claim=claim, where=where
    )


def claims_more(where: Rows, column: str, margin: Amount = SHARE) -> Paired:
    """Returns the claim that `column` is larger with reduced than with original friction."""
    return Paired(column=column, more=REDUCED, less=ORIGINAL, by=BY, amount=margin, where=where)


def claims_kept(scenario: str, *weathers: str) -> Paired:
    """Returns the claim that friction takes less completion than the margin."""
    return frictions(scene(scenario, *weathers), claim=Claim.HARDLY_MORE)


def weathers(
    scenario: str, more: str, less: str, column: str = "completion", amount: Amount = SHARE,
    claim: Claim = Claim.MORE,
) -> Paired:  # fmt: skip
    """Returns the claim that with reduced friction `column` is larger in weather `more` than in `less`."""
    return Paired(
        column=column, more=rows_of("weather", more), less=rows_of("weather", less),
        by=("seed",), amount=amount, claim=claim,
        where=proper(rows_of("scenario", scenario), REDUCED),
    )  # fmt: skip


def cut_ins(more: str, less: str) -> Paired:
    """Returns the claim that more runs complete in one variant of the cut-in, friction untouched."""
    return Paired(
        column="completion", more=rows_of("cutin", more), less=rows_of("cutin", less),
        by=("weather", "seed"), amount=SHARE,
        where=Rows(CUT_IN, (pl.col("scenario") == CUT_IN) & ORIGINAL.are),
    )  # fmt: skip


ALL = "all scenarios and weathers with both frictions"
WEATHERED = proper(Rows("all other weathers", ~BASELINE.are))
FINDINGS: tuple[Finding, ...] = (
    Finding(
        "BF-01", "Weather without physics misleads.",
        "share of pairs whose outcome changes; mean completion", ALL,
        (frictions(WEATHERED, claim=Claim.OFTEN_OTHER), frictions(WEATHERED)),
    ),
    Finding(
        "BF-02", "Thick ice makes a lead slowdown a certain crash.",
        "completion lost at icy_70 and icy_100, share of crashes; none lost up to icy_30",
        "lead slowdown in icy_70, icy_100, and one of icy_10 and icy_30",
        (
            frictions(scene(LEAD, "icy_70")),
            frictions(scene(LEAD, "icy_100")),
            Mean(
                label=f"share of crashes with reduced friction, minus {CERTAIN:g}",
                value=1.0 - pl.col("completion").cast(pl.Float64) - CERTAIN,
                where=(scene(LEAD, "icy_70", "icy_100").are & REDUCED.are), by=BY,
            ),
            claims_kept(LEAD, "icy_10", "icy_30"),
        ),
    ),
    Finding(
        "BF-03",
        "In a lead slowdown a threshold lies between ice 30 and 70; beyond, nothing changes.",
        "completion with reduced friction between ice levels",
        "lead slowdown in icy_30, icy_70 and icy_100",
        (
            weathers(LEAD, "icy_30", "icy_70"),
            weathers(LEAD, "icy_70", "icy_100", claim=Claim.HARDLY_MORE),
        ),
    ),
    Finding(
        "BF-04", "At icy_30 friction turns the cut-in into an accident.",
        "completion lost at icy_30", "cut-in at icy_30",
        (frictions(scene(CUT_IN, "icy_30")),),
    ),
    Finding(
        "BF-05", "At icy_70 and icy_100 the cut-in looks safer, as the other vehicle slides away.",
        "completion gained; runs in which the other vehicle loses control",
        "cut-in in icy_70 or icy_100",
        (
            claims_more(scene(CUT_IN, "icy_70", "icy_100"), "completion"),
            claims_more(scene(CUT_IN, "icy_70", "icy_100"), "loss_of_control_npc"),
        ),
    ),
    Finding(
        "BF-06", "In the front accident thin ice is worse than thick ice.",
        "completion lost at icy_10, and between ice levels",
        "front accident in icy_10, icy_30 and icy_100",
        (
            frictions(scene(FRONT, "icy_10")),
            weathers(FRONT, "icy_30", "icy_10"),
            weathers(FRONT, "icy_100", "icy_10"),
        ),
    ),
    Finding(
        "BF-07", "Rain hurts only the front accident.", "completion lost in rain, by scenario",
        "all scenarios in rain",
        (frictions(scene(FRONT, *RAIN)), claims_kept(CUT_IN, *RAIN), claims_kept(LEAD, *RAIN)),
    ),
    Finding(
        "BF-09", "With less grip the same events happen later by a constant shift.",
        "delay of the speed series; 0 where no constant shift explains the run",
        "cut-in at icy_100, with series",
        (
            Mean(
                label="delay in s, cut-in at icy_100", value=pl.col("delay_s").fill_null(0.0),
                margin=SECONDS, where=(scene(CUT_IN, "icy_100").are & REDUCED.are), by=("seed",),
            ),
        ),
    ),
    Finding(
        "BF-10", "The least distance falls as ice thickens in the lead slowdown.",
        "least distance between neighbouring ice levels",
        "lead slowdown in icy_0, icy_10, icy_30 and icy_70",
        tuple(
            weathers(LEAD, thin, thick, "min_cvip_m", METRES)
            for thin, thick in (("icy_0", "icy_10"), ("icy_10", "icy_30"), ("icy_30", "icy_70"))
        ),
    ),
    Finding(
        "BF-11", "With reduced friction steering spreads wider.",
        "deviation of the steering command", "front accident at icy_100 and rain_100",
        (claims_more(scene(FRONT, "icy_100", "rain_100"), "steer_std", STEER),),
    ),
    Finding(
        "BF-12", "In the cut-in on ice the other vehicle spins out.",
        "runs in which another vehicle loses control", "cut-in in icy_30, icy_70 or icy_100",
        (claims_more(scene(CUT_IN, "icy_30", "icy_70", "icy_100"), "loss_of_control_npc"),),
    ),
    Finding(
        "BF-13", "Nothing changes at ratio 1.", "change of completion at rain_0 and icy_0",
        "rain_0 and icy_0",
        (frictions(proper(BASELINE), claim=Claim.EQUAL),),
        built_in="a ratio of 1 multiplies friction by one",
    ),
    Finding(
        "BF-18", "A spawn delay alone breaks the cut-in, and a shorter merge distance repairs it.",
        "completion of the variants, friction untouched", "--cutin original,unfixed,fixed at rain_0",
        (cut_ins("original", "unfixed"), cut_ins("fixed", "unfixed")),
        built_in="the shorter merge distance was chosen for this result",
    ),
)  # fmt: skip
