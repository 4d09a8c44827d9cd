"""What a learned identifier finds in a recording that has been judged (decision C-15)."""

from __future__ import annotations

from dataclasses import replace

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.identifier.model import Model, probability_of
from skidpad.evidence.channels.judging.causes import NO_RULE, mistakes
from skidpad.evidence.channels.judging.curves import Sweep, of_learned, spans, sweep_counts
from skidpad.evidence.channels.judging.segments import Segment, evaluated_from
from skidpad.evidence.channels.matching import Span

LEARNED = "learned on {} truth"


def with_model(segment: Segment, model: Model) -> Segment:
    """Returns the segment with what the model finds added, by the detectors that never saw its route.

    An empty segment is returned unchanged.
    """
    if not segment.t.size:
        return segment
    begin = evaluated_from(segment.t)
    found: dict[str, tuple[Span, ...]] = {}
    sweeps: dict[str, dict[HazardType, Sweep]] = {}
    for truth in sorted({truth for truth, _ in model.detectors}):
        detectors = model.identifier(truth, segment.route)
        name = LEARNED.format(truth)
        sweeps[name] = of_learned(detectors, segment.t, segment.rows, begin)
        events = (
            span
            for hazard, d in detectors.items()
            for span in spans(
                hazard,
                segment.t,
                probability_of(d.forest, segment.t, segment.rows),
                d.limit,
                d.confirm,
                begin,
            )
        )
        found[name] = tuple(sorted(events, key=lambda s: s.t_start))
    made = mistakes(found, segment.truths, segment.t, segment.motion, lambda *_: NO_RULE)
    return replace(
        segment,
        detected={**segment.detected, **found},
        points=(*segment.points, *sweep_counts(sweeps, segment.truths)),
        mistakes=(*segment.mistakes, *made),
    )
