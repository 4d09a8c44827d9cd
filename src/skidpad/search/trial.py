"""One trial of a search: a point of the space, driven once, and what it came to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import atan2, pi

from msgspec import structs

from skidpad.campaign.runs.run import Run, run
from skidpad.core.errors import InputError
from skidpad.core.geometry import Pose, kmh_from_mps
from skidpad.core.maths.space import Space
from skidpad.core.run import REFERENCE, ReferenceDriver, RunSpec
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.drive.severity import Contact
from skidpad.recording.campaign.searches import FRONT, Trial
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.motion import motion_hash
from skidpad.roads.bundled import load_map
from skidpad.scenarios.movement.measures import between
from skidpad.search.avoidance import find_run_avoidance
from skidpad.search.margin import NO_CONFLICT, Closeness, closeness, is_failure
from skidpad.search.space import apply_values

SIDES = (FRONT, "left side", "rear", "right side")  # of the ego, from ahead to the left


@dataclass(frozen=True, slots=True)
class Point:
    """What a worker is given."""

    template: RunSpec
    space: Space
    number: int
    unit: tuple[float, ...]
    objective: str

    def spec(self) -> RunSpec:
        """Return the run of the point."""
        return apply_values(self.template, self.space.values(self.unit))


def drive_point(point: Point) -> Trial:
    """Drives a point in this process and returns its trial; a file that refuses its values is a fault."""
    values = point.space.values(point.unit)
    blank = Trial(number=point.number, unit=point.unit, values=values, margin=NO_CONFLICT)
    try:
        driven = run(point.spec())
    except InputError as error:
        return structs.replace(blank, fault=str(error))
    return describe_run(blank, driven, point.objective)


def describe_run(blank: Trial, driven: Run, objective: str) -> Trial:
    """Returns `blank` with everything that a run says; a run that failed is a fault."""
    log = driven.log
    if driven.outcome is Outcome.AGENT_ERROR or not len(log):
        last = driven.error.strip().rpartition("\n")[2]
        return structs.replace(blank, fault=last or "the run ended before its first tick")
    near = closeness(log, load_map(driven.road), driven.off_road, objective)
    columns = list_columns(log, near)
    if near.margin <= 0.0 and driven.log.header.about["config"] != REFERENCE:
        columns["bound"] = _bound_of(driven, near)
    return structs.replace(blank, simulated_s=float(log.t[-1]), **columns)


def _bound_of(driven: Run, near: Closeness) -> str:
    """Returns what avoids the contact of a failure, or its departure where that came first; "": nothing."""
    log, road = driven.log, load_map(driven.road)
    contact = near.contact if near.contact is not None and is_failure(near.contact) else None
    departed = None if near.departed_s is None else round(near.departed_s / log.header.dt)
    if contact is None or (departed is not None and departed < contact.tick):
        assert departed is not None
        return find_run_avoidance(log, road, departed, None)
    return find_run_avoidance(log, road, contact.tick, contact.actor)


def list_columns(log: RunLog, near: Closeness) -> dict[str, object]:
    """Returns the columns of a trial from its log: margins, motion hash and the contact, if any."""
    columns: dict[str, object] = {
        name: getattr(near, name)
        for name in ("margin", "min_gap_m", "min_ttc_s", "max_drac_mps2", "departed_s")
    }
    columns["motion"] = motion_hash(log)
    if near.contact is not None:
        contact = near.contact
        columns |= {
            "contact_kmh": kmh_from_mps(contact.v_graded),
            "contact_s": contact.tick * log.header.dt,
            "other": contact.other,
            "side": side_of(log, contact),
        }
    return columns


def side_of(log: RunLog, contact: Contact) -> str:
    """Return the side of the ego on which another actor was; the front for what stands."""
    if contact.actor < 0:
        return SIDES[0]
    row = max(int(log.tick.searchsorted(contact.tick)) - 1, 0)
    a, i = log.actors, contact.actor
    ego = Pose(float(a.x[row, 0]), float(a.y[row, 0]), 0.0, yaw=float(a.yaw[row, 0]))
    ahead, left = between(ego, float(a.x[row, i]), float(a.y[row, i]))
    length = 0.5 * float(log.table.length[0] + log.table.length[i])
    width = 0.5 * float(log.table.width[0] + log.table.width[i])
    turn = atan2(left / width, ahead / length)  # as if both were squares
    return SIDES[round(turn / (0.5 * pi)) % 4]


def with_reference(template: RunSpec) -> RunSpec:
    """Return the same run with the reference driver at the wheel (decision T-5)."""
    return structs.replace(template, driver=ReferenceDriver())


def unit_tuple(point: Iterable[float]) -> tuple[float, ...]:
    """Return a point as trials store it."""
    return tuple(float(x) for x in point)
