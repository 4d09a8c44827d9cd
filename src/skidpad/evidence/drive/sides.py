"""Which runs of the matrix a claim compares, and which differences do not matter."""

from __future__ import annotations

from skidpad.evidence.contrasts import Amount, Claim, Paired, Rows, rows_of

COLLISIONS = Amount(0.1, "collisions per run")  # fewer does not matter
INVASIONS = Amount(0.2, "markings per run")
PHANTOMS = Amount(0.2, "brakings per run")
SPEED = Amount(2.0, "km/h")
POINT = Amount(1.0, "percentage point")
POINTS = Amount(5.0, "percentage points")
METRES = Amount(0.2, "m")
VARIANCE = Amount(5.0, "m2")
SECONDS = Amount(1.0, "s per run")
TTC = Amount(0.1, "s")
BY_RUN = ("weather", "seed")
ASSISTED = rows_of("config", "1", "2", "3", "4", name="configurations 1 to 4")
NIGHT = rows_of("time_of_day", "night")
DAY = Rows("day", ~NIGHT.are)
RAIN = rows_of("precipitation_kind", "rain")
CLEAR = Rows("clear", ~RAIN.are)


def config(name: str) -> Rows:
    """Returns the runs of one configuration."""
    return rows_of("config", name, name=f"configuration {name}")


def configs(column: str, more: str, less: str, margin: Amount) -> Paired:
    """Returns the claim that `column` is larger in configuration `more` than in `less`."""
    return Paired(column=column, more=config(more), less=config(less), by=BY_RUN, amount=margin)


def variants(column: str, more: str, less: str, margin: Amount) -> Paired:
    """Returns the claim that `column` is larger in variant `more` of a study than in `less`."""
    return Paired(
        column=column, more=rows_of("variant", more), less=rows_of("variant", less),
        by=("config", "weather", "seed"), amount=margin,
    )  # fmt: skip


def at_night(column: str, amount: Amount, claim: Claim = Claim.MORE) -> Paired:
    """Returns the claim that `column` is larger at night than by day, or what `claim` says."""
    return Paired(
        column=column, more=NIGHT, less=DAY, by=("config", "precipitation_kind", "seed"),
        amount=amount, claim=claim, where=ASSISTED,
    )  # fmt: skip


def ttc_hardly_more(more: str, less: str) -> Paired:
    """Returns one side of an equivalence: the minimum is hardly larger in configuration `more`."""
    return Paired(
        column="min_ttc_s", more=config(more), less=config(less), by=BY_RUN, amount=TTC,
        claim=Claim.HARDLY_MORE,
    )  # fmt: skip
