"""Criteria that a scenario file states by ScenarioRunner's names, judged on the log of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import cos

import numpy as np

from skidpad.core.geometry import kmh_from_mps
from skidpad.core.text.wording import count_text
from skidpad.evidence.drive.prepared import Drive
from skidpad.recording.run.staging import FileCriterion


@dataclass(frozen=True, slots=True)
class Result:
    """What became of one criterion. wrong: a sentence, "" when it is met, None: not judged here."""

    name: str
    wrong: str | None


def judge_criteria(drive: Drive, criteria: Sequence[FileCriterion]) -> list[Result]:
    """Returns the results of the criteria in the order of the file."""
    return [Result(c.name, _wrong(drive, c)) for c in criteria]


def _wrong(drive: Drive, criterion: FileCriterion) -> str | None:
    """Returns what is wrong by a criterion, "" if nothing; None where it cannot be judged."""
    judge = JUDGES.get(criterion.name)
    if judge is None:
        return None
    if criterion.name in NEEDS_LIMIT and criterion.limit is None:
        return None
    return judge(drive, criterion.limit or 0.0)


def _collision(drive: Drive, limit: float) -> str:
    """Returns how many contacts the ego had, "" for none; the limit is not used."""
    del limit
    n = len(drive.log.contacts)
    return "" if n == 0 else f"the ego had {count_text(n, 'contact')}"


def _distance(drive: Drive, limit: float) -> str:
    """Returns why the ego did not drive far enough; "" where it did."""
    way = _way(drive)
    return "" if way >= limit else f"the ego drove {way:.1f} m, {limit:g} m are asked for"


def _keep_lane(drive: Drive, limit: float) -> str:
    """Returns how many markings the ego crossed, "" for none; the limit is not used."""
    del limit
    n = len(drive.log.invasions)
    return "" if n == 0 else f"the ego crossed {count_text(n, 'marking')}"


def _on_road(drive: Drive, limit: float) -> str:
    """Returns when the ego first had all wheels off every lane, "" for never; `limit` is not used."""
    del limit
    rows = np.flatnonzero(drive.strays)
    if not len(rows):
        return ""
    return f"the ego had all wheels off every lane at {drive.log.t[rows[0]]:.2f} s"


def _right_way(drive: Drive, limit: float) -> str:
    """Returns when the ego first drove against its lane, "" for never; the limit is not used."""
    del limit
    place = drive.place
    turn = np.cos(drive.log.actors.yaw[:, 0] - place.heading)
    rows = np.flatnonzero((place.lane >= 0) & (turn < AGAINST) & (drive.v > ROLLING))
    return (
        "" if not len(rows) else f"the ego drove against its lane at {drive.log.t[rows[0]]:.2f} s"
    )


def _at_most(drive: Drive, limit: float) -> str:
    """Returns the ego's top speed in words where it was above `limit` m/s, else ""."""
    v = float(drive.v.max(initial=0.0))
    return "" if v <= limit else f"the ego drove {_kmh(v)}, at most {_kmh(limit)} are allowed"


def _on_average(drive: Drive, limit: float) -> str:
    """Returns the ego's mean speed in words where it was below `limit` m/s, else ""."""
    v = float(drive.v.mean()) if len(drive.v) else 0.0
    return "" if v >= limit else f"the ego drove {_kmh(v)} on average, {_kmh(limit)} are asked for"


def _kmh(v: float) -> str:
    """Returns a speed in m/s as text in km/h."""
    return f"{kmh_from_mps(v):.1f} km/h"


def _way(drive: Drive) -> float:
    """Returns the length of the ego's way in m."""
    a = drive.log.actors
    return float(np.hypot(np.diff(a.x[:, 0]), np.diff(a.y[:, 0])).sum())


AGAINST = cos(2.0 * np.pi / 3.0)  # 120 degrees to the lane's direction, as in ScenarioRunner
ROLLING = 0.5  # m/s
NEEDS_LIMIT = ("DrivenDistanceTest", "MaxVelocityTest", "AverageVelocityTest")
JUDGES: Mapping[str, Callable[[Drive, float], str]] = {
    "CollisionTest": _collision,
    "DrivenDistanceTest": _distance,
    "KeepLaneTest": _keep_lane,
    "OnSidewalkTest": _on_road,
    "OffRoadTest": _on_road,
    "WrongLaneTest": _right_way,
    "MaxVelocityTest": _at_most,
    "AverageVelocityTest": _on_average,
}
