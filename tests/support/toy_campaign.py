"""A campaign of trifles: its runs take no time, so that what is common to campaigns can be tested."""

from dataclasses import dataclass

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes.recipe import Driven, Recipe
from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns, Timing, metric

SHARES = {"sure": 1.0, "even": 0.5}


@dataclass(frozen=True)
class Toss:
    cell: str
    number: int
    share: float = 0.5  # of heads
    deadline_s: float = 60.0

    @property
    def name(self):
        return f"{self.cell}-{self.number:03d}"

    def to_identity(self):
        return {"cell": self.cell, "number": self.number, "share": self.share}


@dataclass(frozen=True, kw_only=True)
class Key:
    cell: str
    number: int
    outcome: str


@dataclass(frozen=True, kw_only=True)
class Heads:
    heads: bool | None = metric("heads", "toy")


def key(toss, outcome):
    return Key(cell=toss.cell, number=toss.number, outcome=outcome.value)


def toss(out, toss):
    from skidpad.core.vocabulary import Outcome

    heads = (toss.number + 1) * toss.share % 1.0 < toss.share
    return Driven(
        key=key(toss, Outcome.COMPLETED), metrics=Heads(heads=heads), timing=Timing(wall_s=0.0)
    )


def nothing():
    pass


RECIPE = Recipe(
    command="toy",
    columns=Columns(Key, Heads, ("cell", "number")),
    entry=Entry[Key, Heads],
    key=key,
    drive=toss,
    warm_up=nothing,
    success=lambda metrics: metrics.heads,
    success_means="heads",
)


def campaign(n=4):
    """n tosses each of two cells: in one of them always heads."""
    return Campaign(RECIPE, [Toss(c, k, p) for k in range(n) for c, p in SHARES.items()])
