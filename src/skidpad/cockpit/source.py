"""What can be replayed: moments in any order, whatever file they come from."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from skidpad.campaign.driving.loop import Moment
from skidpad.cockpit.indicators import FAR, NEAR, every
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import LampSwitch, Outside
from skidpad.core.run import Function
from skidpad.core.setup import DT
from skidpad.core.states import ActorTable, StackReport, VehicleCommand
from skidpad.roads.queries import RoadMap


@dataclass(frozen=True, slots=True)
class Seat:
    """How the desk stood in a tick."""

    tick: int  # from which on
    outside: Outside
    manual: bool
    method: str
    functions: tuple[Function, ...] | None
    lamps: LampSwitch | None


class Said:
    """What drove then, as far as it was logged."""

    def __init__(self, report: StackReport, mode: str) -> None:
        self.report, self.mode = report, mode

    def begin(self, table: ActorTable) -> None:
        """Does nothing, as a source drives no actor."""

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Raises NotImplementedError, as a source drives no actor."""
        raise NotImplementedError


class Curves(NamedTuple):
    """What is drawn along the time, at moments of one distance."""

    speed: list[float]  # km/h
    tier: list[int | None]  # that acted
    ttc: list[float | None]  # s, the least up to the next one, to what is in the ego's way
    gap: list[float | None]  # m, bumper to bumper, the least up to the next one, to the same
    grip: list[float | None]  # mean friction of the ego's tyres; None: not recorded
    violated: Sequence[int] = ()  # indicators of a monitor beyond their bounds; (): none looked on
    hazards: Sequence[
        tuple[int, int, str]
    ] = ()  # first and last tick, and what a monitor called it
    limit: Sequence[float | None] = ()  # km/h of the speed envelope; (): the run has none


class Source(Protocol):
    """Gives the moments of a run that was driven; one that logs no contacts or sensors had none."""

    folder: Path  # beside which films are written
    map: RoadMap
    seed: int
    step: int  # ticks between two moments
    marks: list[tuple[int, str, str]]  # tick, kind and text of what is worth a mark

    @property
    def table(self) -> ActorTable:
        """Returns the actors of the source, the ego first."""
        ...

    @property
    def ticks(self) -> int:
        """Returns how many moments there are."""
        ...

    def tick(self, k: int) -> int:
        """Returns the tick of moment k."""
        ...

    def moment(self, k: int) -> Moment:
        """Returns moment k, 0 <= k < ticks."""
        ...

    def seat(self, k: int) -> Seat:
        """Returns what the person at the desk had set in moment k."""
        ...

    def crash(self, k: int) -> Pose | None:
        """Returns the ego's pose at its contact that is nearest in time; None: there was none."""
        del k
        return None

    def collisions(self, k: int) -> int:
        """Returns how many contacts of the ego there were up to moment k."""
        del k
        return 0

    def readings(self, k: int) -> list[tuple[str, str]]:
        """Returns what further sensors and functions said in moment k: names and numbers as text."""
        del k
        return []

    def curves(self, part: slice | None = None) -> Curves:
        """Returns what is drawn along the time, at the moments of `part`; None: at about CURVE of them."""
        ...


def index_at(source: Source, tick: int) -> int:
    """Returns the index of the first moment that is not before a tick, or of the last one."""
    return min(bisect_left(range(source.ticks), tick, key=source.tick), source.ticks - 1)


BEFORE = 5.0  # s, with which a replay begins before what is worth seeing


def opening_tick(source: Source) -> int:
    """Returns the tick BEFORE s ahead of the crash at the highest speed, else of the first hazard.

    The first one of the source where there is neither.
    """
    crashes = [tick for tick, kind, _ in source.marks if kind == "crash"]
    hazards = [first for first, _, _ in source.curves().hazards]
    begin = source.tick(0)
    if crashes:
        worst = max(crashes, key=lambda tick: _speed_before(source, tick))
    elif hazards:
        worst = hazards[0]
    else:
        return begin
    return max(worst - round(BEFORE / DT), begin)


def _speed_before(source: Source, tick: int) -> float:
    """Returns the ego's speed in m/s one moment before the tick."""
    k = max(index_at(source, tick) - 1, 0)
    return source.moment(k).frame.ego.speed


def timeline(source: Source) -> dict[str, Any]:
    """Returns what the page draws along the time: speed, gap, grip, time to collision, events, tiers."""
    return {
        "first": source.tick(0),
        "last": source.tick(source.ticks - 1),
        "step": source.step,
        "stride": every(source.ticks).step * source.step,  # ticks between two values of a curve
        "dt": DT,
        "near": NEAR,
        "far": FAR,
        **source.curves()._asdict(),
        "events": source.marks,
    }


def curves_beside(source: Source) -> dict[str, Any]:
    """Returns what the page draws along the time of a run beside another one, from its begin on."""
    curves = source.curves()
    return {
        "stride": every(source.ticks).step * source.step,  # ticks between two values
        "speed": curves.speed,
        "gap": curves.gap,
        "ttc": curves.ttc,
        "grip": curves.grip,
    }
