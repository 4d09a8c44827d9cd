"""How much a true hazard of the stratum of risky drivers counts (importance sampling)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import nan
from typing import NamedTuple

from skidpad.core.errors import FileError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.judging.truth.marks import JUMP_KIND, TrueHazard
from skidpad.evidence.channels.matching import Span


class Weights(NamedTuple):
    """What a recording says of what was drawn more often than it occurs; 1: as it occurs."""

    drivers: Mapping[str, tuple[float, float]] = {}  # by name: of his headway and of his cut-ins
    jumps: float = 1.0  # of a channel's position

    def weigh(self, hazard: TrueHazard) -> Span:
        """Returns a true hazard as a span that counts by the habit that brought it about.

        Being tailgated comes from a follower's headway, tailgating from a cut-in, a jump from the
        channel; anything else counts 1.
        """
        match hazard.hazard:
            case HazardType.INCONSISTENT_LOCALISATION if hazard.kind == JUMP_KIND:
                weight = self.jumps
            case HazardType.EGO_TAILGATED:
                weight = self._mean(hazard, 0)
            case HazardType.EGO_TAILGATING:
                weight = self._mean(hazard, 1)
            case _:
                weight = 1.0
        return Span(hazard.hazard, hazard.t_start, hazard.t_end, weight=weight)

    def _mean(self, hazard: TrueHazard, column: int) -> float:
        """Returns the mean of a column over the hazard's known drivers, 1 where none is known."""
        own = [self.drivers[a][column] for a in hazard.about if a in self.drivers]
        return sum(own) / len(own) if own else 1.0


def weights_from(context: Mapping[str, str]) -> Weights:
    """Returns the weights in a recording's context, 1 where it has none; FileError where they are damaged."""
    text, jumps = context.get("weights", "{}"), context.get("weight_of_jumps", "1")
    try:
        drivers = {f"actor {i}": (float(a), float(b)) for i, (a, b) in json.loads(text).items()}
    except (ValueError, TypeError, AttributeError):
        raise FileError(
            f"the recording's words `weights` must be JSON of two numbers per actor, got {text[:60]!r}"
        ) from None
    try:
        weight = float(jumps)
    except ValueError:
        weight = nan
    if not 0.0 < weight <= 1.0:  # nor is NaN
        raise FileError(
            f"the recording's word `weight_of_jumps` must be a number in (0, 1], got {jumps[:60]!r}"
        )
    return Weights(drivers, weight)
