"""The kinds of crashes, which add up to all of them."""

from __future__ import annotations

from dataclasses import dataclass

import polars as pl


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind: columns that are added, columns that are taken off."""

    title: str
    plus: tuple[str, ...]
    minus: tuple[str, ...] = ()
    meaning: str = ""


CONTACTS = (
    Kind("contact above 20 km/h", ("contacts_heavy",), (), "change of speed, with a road user"),
    Kind("contact of 5 to 20 km/h", ("contacts_medium",), (),
         "or slower, with a person or two wheels"),
)  # fmt: skip
# Rows without grades are older than 2026-11-25, when a touch at the side still counted as one from behind.
UNGRADED = (
    Kind("into a vehicle", ("crashes_vehicle",), ("rear_ended",), "the ego drove into a vehicle"),
    Kind("struck from behind or touched sideways", ("rear_ended",), (),
         "by another vehicle; rows of this age do not tell the two apart"),
)  # fmt: skip
DEPARTURES = (
    Kind("into a barrier", ("collisions_static",), (), "or anything else that stands"),
    Kind("off the road", ("off_road",), (), "left all lanes and was put back"),
    Kind("facing the wrong way", ("wrong_way",), (), "and was turned round"),
)  # fmt: skip


def kinds_of(graded: bool) -> tuple[Kind, ...]:
    """The kinds that add up to all crashes; results of older versions have no grades of contacts."""
    return (*(CONTACTS if graded else UNGRADED), *DEPARTURES)


def count(kind: Kind, runs: pl.DataFrame) -> int:
    """How many of a kind there were in these runs."""
    total = sum(int(runs[c].sum() or 0) for c in kind.plus)
    return max(0, total - sum(int(runs[c].sum() or 0) for c in kind.minus))
