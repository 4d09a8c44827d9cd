"""The ceiling that sensor noise sets: what the truth's own rule finds in what channels saw.

Every channel's objects are given to the actors that they really are (true association), smoothed
with hindsight over the whole drive, and judged by the rule of simulator truth. No identifier that
reads the same channels can be expected to do better, for it lacks the association, the hindsight
and the rule. What this one misses or finds too much is noise, occlusion and range.

For localisation it is a reference and no bound: no channel knows its own error, so the rule's limits
are laid on the offset of two channels, and other limits trade misses for false alarms.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import Cycle, TruthFrame
from skidpad.evidence.channels.judging.truth.marks import World, offsets
from skidpad.evidence.channels.judging.truth.marks import merge_marks as hazards_of
from skidpad.evidence.channels.judging.truth.simulator import simulator_truth
from skidpad.evidence.channels.matching import Span, merge_spans

Floats = NDArray[np.float64]
NEAR = 3.0  # m between an object and the actor that it is
WINDOW = 10  # cycles before and after: 1 s each way
LEAST = 5  # cycles seen in the window, else the actor is not known
MEDIAN = 3  # cycles before and after: a jump stays one, noise of single cycles goes
NAME = "reference with hindsight"


def ceiling(cycles: Sequence[Cycle], channels: Sequence[str]) -> tuple[Span, ...]:
    """Hazards by simulator truth's rule on each channel's smoothed world, all channels together."""
    known = [c for c in cycles if c.truth is not None]
    found: list[Span] = []
    for c in range(len(channels)):
        egos = _smoothed_egos(known, c)
        perceived = _perceived_truth(known, c, egos)
        rows = [k._replace(truth=t) for k, t in zip(known, perceived, strict=True)]
        found += [
            Span(h.hazard, h.t_start, h.t_end)
            for h in simulator_truth([r for r in rows if r.truth is not None], ())
        ]
    marks = [
        mark
        for a, b in combinations(range(len(channels)), 2)
        for mark in offsets(_offset(known, a, b), f"{channels[a]}+{channels[b]}")
    ]
    found += [Span(h.hazard, h.t_start, h.t_end) for h in hazards_of(marks, World.SIM)]
    return tuple(sorted(merge_spans(found), key=lambda s: s.t_start))


def _offset(cycles: Sequence[Cycle], a: int, b: int) -> Floats:
    """Rows t, dx, dy (k, 3) from channel a to b: medians of what both say around each cycle."""
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
    """(k, 5) the channel's own states, smoothed."""
    rows = [f.ego if (f := k.frames[c]) is not None else np.full(5, np.nan) for k in cycles]
    raw = np.array(rows).reshape(-1, 5)
    t = np.array([k.t for k in cycles])
    return smooth_states(t, raw)


def smooth_states(t: Floats, states: Floats) -> Floats:
    """States (k, 5) by straight lines through 1 s before and after; NaN where too little is known.

    Velocity is the line's slope; the heading stays as it was said.
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
    """What the channel knows of the true actors, in the form of the truth."""
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
    """Per actor the states (k, 5) that the channel reported of it; NaN: not seen."""
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
