"""The reference with hindsight: what the truth's own rule finds in what channels saw.

Every channel's objects are given to the actors that they really are (true association), smoothed
with hindsight over the whole drive, and judged by the rule of simulator truth. No identifier that
reads one channel at a time has the association, the hindsight and the rule. What this one misses or
finds too much is noise, occlusion and range. It is no bound: identifiers may fuse channels, and other
limits trade misses for false alarms, so it is a curve over its limit: the m that would be left when
the leader brakes, and for localisation a factor on the truth's limits, which are laid on the offset
of two channels, as no channel knows its own error.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import Cycle, TruthFrame
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.judging.truth.marks import (
    Mark,
    World,
    lasting,
    merge_marks,
    offsets,
)
from skidpad.evidence.channels.judging.truth.simulator import MIN_DURATION, tail_marks
from skidpad.evidence.channels.matching import Span, merge_spans

NEAR = 3.0  # m between an object and the actor that it is
WINDOW = 10  # cycles before and after: 1 s each way
LEAST = 5  # cycles seen in the window, else the actor is not known
MEDIAN = 3  # cycles before and after: a jump stays one, noise of single cycles goes
NAME = "reference with hindsight"
SPARES = (-20.0, -10.0, -5.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 5.0, 10.0)  # m
FACTORS = (0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0)
TAILS = (HazardType.EGO_TAILGATING, HazardType.EGO_TAILGATED)
OF_TRUTH = {HazardType.INCONSISTENT_LOCALISATION: 1.0} | dict.fromkeys(TAILS, 0.0)
Swept = Mapping[HazardType, Mapping[float, Sequence[Span]]]


def reference(cycles: Sequence[Cycle], channels: Sequence[str], begin: float) -> Swept:
    """Returns hazards from `begin` s on by the truth's rule on each channel's smoothed world, by limit.

    Limits are SPARES in m for tailgating and FACTORS for localisation. Cycles without truth are left
    out.
    """
    known = [c for c in cycles if c.truth is not None]
    seen = [_tails(known, c) for c in range(len(channels))]
    tails = {
        spare: _merge_to_spans(
            mark
            for marks in seen
            for mark in lasting([m for m in marks if m.clearance <= spare], MIN_DURATION)
        )
        for spare in SPARES
    }
    apart = {
        f"{channels[a]}+{channels[b]}": _offset(known, a, b)
        for a, b in combinations(range(len(channels)), 2)
    }
    places = {
        factor: _merge_to_spans(
            m for name, rows in apart.items() for m in offsets(rows, name, factor)
        )
        for factor in FACTORS
    }
    limits = {HazardType.INCONSISTENT_LOCALISATION: places} | dict.fromkeys(TAILS, tails)
    return {
        hazard: {
            limit: tuple(s for s in spans if s.hazard is hazard and s.t_end >= begin)
            for limit, spans in of.items()
        }
        for hazard, of in limits.items()
    }


def at_the_truths_limits(swept: Swept) -> tuple[Span, ...]:
    """Returns the spans at the limits of the truth itself, in order of their start."""
    spans = [s for hazard, of in swept.items() for s in of[OF_TRUTH[hazard]]]
    return tuple(sorted(spans, key=lambda s: s.t_start))


def _merge_to_spans(marks: Iterable[Mark]) -> list[Span]:
    """Returns the spans of the marks, those of one hazard with pauses under 2 s as one."""
    hazards = merge_marks(list(marks), World.SIM)
    return merge_spans(Span(h.hazard, h.t_start, h.t_end) for h in hazards)


def _tails(cycles: Sequence[Cycle], c: int) -> list[Mark]:
    """Returns marks of close following in the world of channel number c, within the largest limit."""
    perceived = _perceived_truth(cycles, c, _smoothed_egos(cycles, c))
    rows = [k._replace(truth=t) for k, t in zip(cycles, perceived, strict=True) if t is not None]
    return tail_marks(rows, max(SPARES))


def _offset(cycles: Sequence[Cycle], a: int, b: int) -> Floats:
    """Returns rows t, dx, dy (k, 3) from channel number a to b: medians of both around each cycle."""
    rows = [
        (k.t, *(two.ego[:2] - one.ego[:2]))
        for k in cycles
        if (one := k.frames[a]) is not None and (two := k.frames[b]) is not None
    ]
    raw: Floats = np.array(rows, dtype=np.float64).reshape(-1, 3)
    raw = raw[np.isfinite(raw).all(axis=1)]
    out: Floats = raw.copy()
    for k in range(len(raw)):
        out[k, 1:] = np.median(raw[max(k - MEDIAN, 0) : k + MEDIAN + 1, 1:], axis=0)
    return out


def _smoothed_egos(cycles: Sequence[Cycle], c: int) -> Floats:
    """Returns (k, 5) the own states of channel number c, smoothed; NaN where too little is known."""
    rows = [f.ego if (f := k.frames[c]) is not None else np.full(5, np.nan) for k in cycles]
    raw = np.array(rows).reshape(-1, 5)
    t = np.array([k.t for k in cycles])
    return smooth_states(t, raw)


def smooth_states(t: Floats, states: Floats) -> Floats:
    """Returns states (k, 5) by straight lines through 1 s before and after; NaN where too little is known.

    t: (k,) s. Velocity is the line's slope; the heading is that of the nearest state. Fewer than
    LEAST states in the window are too little.
    """
    out = np.full_like(states, np.nan)
    seen = np.asarray(np.isfinite(states).all(axis=1))
    for k in range(len(states)):
        rows = np.arange(max(k - WINDOW, 0), min(k + WINDOW + 1, len(states)))
        rows = rows[seen[rows] & (np.abs(t[rows] - t[k]) <= 0.1 * WINDOW + 0.05)]
        if len(rows) < LEAST or not rows[0] - 1 <= k <= rows[-1] + 1:
            continue
        dt = t[rows] - t[k]
        mean = dt.mean()
        spread = ((dt - mean) ** 2).sum()
        for axis in (0, 1):
            p = states[rows, axis]
            slope = ((dt - mean) * (p - p.mean())).sum() / spread
            out[k, axis] = p.mean() - slope * mean
            out[k, 3 + axis] = slope
        out[k, 2] = states[rows[np.argmin(np.abs(dt))], 2]
    return out


def _perceived_truth(cycles: Sequence[Cycle], c: int, egos: Floats) -> list[TruthFrame | None]:
    """Returns what channel number c knows of the true actors, as a truth per cycle; None without its ego.

    egos: (k, 5) of `_smoothed_egos`.
    """
    t = np.array([k.t for k in cycles])
    tracks = _tracks(cycles, c)
    states = {actor: smooth_states(t, raw) for actor, raw in tracks.items()}
    out: list[TruthFrame | None] = []
    for k, cycle in enumerate(cycles):
        truth = cycle.truth
        assert truth is not None
        if not np.isfinite(egos[k]).all():
            out.append(None)
            continue
        rows = [
            i
            for i, actor in enumerate(truth.ids.tolist())
            if actor in states and np.isfinite(states[actor][k]).all()
        ]
        actors = [states[int(truth.ids[i])][k] for i in rows]
        out.append(
            truth._replace(
                ego=egos[k],
                actors=np.array(actors).reshape(-1, 5),
                polygons=truth.polygons[rows],
                polygon_size=truth.polygon_size[rows],
                ids=truth.ids[rows],
                classes=truth.classes[rows],
                mu=truth.mu[rows],
            )
        )
    return out


def _tracks(cycles: Sequence[Cycle], c: int) -> dict[int, Floats]:
    """Returns by actor the states (k, 5) that channel number c reported of it; NaN: not seen."""
    tracks: dict[int, Floats] = {}
    for k, cycle in enumerate(cycles):
        frame, truth = cycle.frames[c], cycle.truth
        if frame is None or truth is None or not len(frame.objects) or not len(truth.actors):
            continue
        # a position error of the channel moves all its objects: association is that of the truth
        shift = np.nan_to_num(frame.ego[:2] - truth.ego[:2])
        apart = np.hypot(
            *(frame.objects[:, None, :2] - shift - truth.actors[None, :, :2]).transpose(2, 0, 1)
        )
        for i, actor in enumerate(np.argmin(np.nan_to_num(apart, nan=np.inf), axis=1)):
            if apart[i, actor] < NEAR:
                track = tracks.setdefault(int(truth.ids[actor]), np.full((len(cycles), 5), np.nan))
                track[k] = frame.objects[i]
    return tracks
