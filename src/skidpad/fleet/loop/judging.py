"""How many errors a monitor makes in a scene, held against the world that all channels report.

The truth is `evidence.channels.judging.truth`, which shares no code with the rules that it judges;
it needs no simulator, so a real fleet is judged alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from skidpad.core.channels import Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.judging.truth.worldmodel import world_model_truth
from skidpad.evidence.channels.matching import Span, match
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings


@dataclass(frozen=True, slots=True)
class Errors:
    """What one monitor did in one scene."""

    false: int
    missed: int
    found: frozenset[HazardType]  # kinds, right or wrong

    @property
    def total(self) -> int:
        """Returns the number of false alarms and missed hazards."""
        return self.false + self.missed


def errors_of(
    cycles: Sequence[Cycle], channels: Sequence[str], settings: Sequence[MonitorSettings]
) -> list[Errors]:
    """Returns the errors of each of several monitors in the same scene, of the scored hazards alone."""
    true = [
        Span(h.hazard, h.t_start, h.t_end)
        for h in world_model_truth(cycles, channels)
        if h.hazard in SCORED_HAZARDS
    ]
    return [_errors(cycles, channels, one, true) for one in settings]


def _errors(
    cycles: Sequence[Cycle], channels: Sequence[str], settings: MonitorSettings, true: list[Span]
) -> Errors:
    """Counts false and missed hazards of scored kinds, with all kinds found."""
    monitor = Monitor(channels, settings)
    for cycle in cycles:
        monitor.update(cycle)
    events = monitor.hazards.finish()
    found = [Span(e.key, e.t_start, e.t_end) for e in events if e.key in SCORED_HAZARDS]
    matching = match(found, true)
    kinds = frozenset(e.key for e in events)
    return Errors(len(matching.false_alarms), len(matching.missed), kinds)
