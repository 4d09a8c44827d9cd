"""The findings that speak of collisions: once for all interventions, once for vehicle crashes alone.

What the sources count holds barriers and wrong ways too (A-247); a reader who asks about traffic asks
for crashes with vehicles. Each claim is judged on both, the second under its own id with a v behind.
"""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from skidpad.evidence.contrasts import Outweighs, Paired, highest, lowest
from skidpad.evidence.drive.collisions import BEND_RADIUS
from skidpad.evidence.drive.sides import (
    BY_RUN,
    CLEAR,
    COLLISIONS,
    RAIN,
    SPEED,
    config,
    configs,
)
from skidpad.evidence.rates import RateBelow
from skidpad.evidence.verdicts import Finding

ORDER = (("0", "3"), ("3", "2"), ("2", "1"), ("1", "4"))


class Crashes(NamedTuple):
    """What is counted as a crash."""

    column: str
    mark: str  # behind the finding's id
    name: str  # as a claim says it
    counted: str  # as an estimand says it


IN_BENDS = f"configurations 1 and 2 on a map with bends tighter than {BEND_RADIUS:g} m"
FATAL = Crashes("fatal_collisions", "", "collisions", "interventions")
VEHICLE = Crashes("crashes_vehicle", "v", "crashes with vehicles", "crashes with vehicles")


def _order(kind: Crashes) -> Finding:
    """Returns finding F-01: crashes of this kind do not fall steadily with automation."""
    return Finding(
        f"F-01{kind.mark}",
        f"{kind.name.capitalize()} do not fall steadily with automation: 0 > 3 > 2 > 1 > 4.",
        f"difference of {kind.counted} per run between neighbours in that order",
        "all configurations and weathers",
        tuple(configs(kind.column, more, less, COLLISIONS) for more, less in ORDER),
    )


def _paradox(kind: Crashes) -> Finding:
    """Returns finding F-04: lane centring adds crashes of this kind."""
    return Finding(
        f"F-04{kind.mark}",
        f"Lane centring adds {kind.name}, because it lets the car go faster into bends.",
        f"{kind.counted} and speed in bends, configuration 2 minus 1",
        IN_BENDS,
        (
            configs(kind.column, "2", "1", COLLISIONS),
            configs("bend_speed_kmh", "2", "1", SPEED),
        ),
    )


def _limiter(kind: Crashes) -> Finding:
    """Returns finding F-07: a limit of 80 km/h removes crashes of this kind."""
    return Finding(
        f"F-07{kind.mark}",
        f"A limit of 80 km/h removes the {kind.name}.",
        f"{kind.counted}: rate of configuration 4 against a limit; configuration 3 minus 4",
        "configurations 3 and 4",
        (
            RateBelow(
                what="the rate of configuration 4", events=pl.col(kind.column).sum(),
                limit=COLLISIONS, where=config("4").are,
            ),
            configs(kind.column, "3", "4", COLLISIONS),
        ),
    )  # fmt: skip


def _speed_decides(kind: Crashes) -> Finding:
    """Returns finding F-08: speed, not perception, decides on crashes of this kind."""
    return Finding(
        f"F-08{kind.mark}",
        f"Speed, not perception, decides on {kind.name}.",
        f"effect of the target speed on {kind.counted} minus that of injected dropout",
        "its own study: target speed x injected dropout",
        (
            Paired(
                column=kind.column, more=highest("target_kmh"), less=lowest("target_kmh"),
                by=("seed",), amount=COLLISIONS,
            ),
            Outweighs(
                column=kind.column, factor="target_kmh", other="dropout_injected",
                by=("seed",), margin=COLLISIONS,
            ),
        ),
        study=True,
    )  # fmt: skip


def _rain(kind: Crashes) -> Finding:
    """Returns finding F-13: rain gives configuration 3 more crashes of this kind."""
    return Finding(
        f"F-13{kind.mark}",
        f"Rain makes configuration 3 have more {kind.name}.",
        f"{kind.counted} per run, rain minus clear",
        "configuration 3 in rain and clear at one time of day",
        (
            Paired(
                column=kind.column, more=RAIN, less=CLEAR, by=("time_of_day", "seed"),
                amount=COLLISIONS, where=config("3"),
            ),
        ),
    )  # fmt: skip


FASTER = Finding(
    "F-05",
    "Lane centring raises the speed.",
    "mean speed, its 95th percentile and speed in bends, configuration 2 minus 1",
    IN_BENDS,
    tuple(configs(f"{which}_speed_kmh", "2", "1", SPEED) for which in ("mean", "p95", "bend")),
)
HARDER = Finding(
    "F-05v",
    "Lane centring raises the speed at which vehicles are hit.",
    "largest closing speed at a crash with a vehicle, configuration 2 minus 1, of the seeds and "
    "weathers in which both had one",
    "configurations 1 and 2, both with crashes with vehicles",
    (
        Paired(
            column="max_impact_vehicle_kmh", more=config("2"), less=config("1"), by=BY_RUN,
            amount=SPEED,
        ),
    ),
)  # fmt: skip

CRASH_FINDINGS: tuple[Finding, ...] = (
    *(
        make(kind)
        for make in (_order, _paradox, _limiter, _speed_decides, _rain)
        for kind in (FATAL, VEHICLE)
    ),
    FASTER,
    HARDER,
)
