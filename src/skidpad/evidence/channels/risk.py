"""Cross-channel risk (C-090 to C-097, decision C-8): plan of channel a in the world of channel b.

Oriented footprints move along time-stamped plans and predictions, all extended to 4 s at their
last velocity. Time to collision is the first overlap; only movers that never overlap have a
post-encroachment time: the smallest shift in time that would make them touch. These scores choose
the driving channel and feed hazard rules; they are not indicators and have no threshold.

Recommended risk is ordered as danger is: a conflict that is sooner, nearer to a hit, or a hit
instead of a miss never has less of it, and every hit has more than any miss. As proposed for the
publication (C-094), a miss by 0.002 s has 0.999 and a hit in 2.5 s 0.37.

Predictions hold the present speed, so they say nothing of a follower that could not brake in time.
Recommended risk therefore also asks which braking a follower needs when its lead brakes hard: the
braking for which the gap is just the safe distance of RSS (Shalev-Shwartz, Shammah and Shashua 2017,
arXiv:1708.06374, lemma 2); in the response time it moves as planned or predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.evidence.channels.boxes import HORIZON, STEP, Movers, ego_movers, world_movers
from skidpad.evidence.channels.conflicts import PET_SAFE, encroachment, first_overlap
from skidpad.evidence.channels.frames import usable

MISS_MOST = 0.1  # risk of the nearest miss; the hit at the very end of the horizon begins there
# Ours: a lead that brakes as hard as cars in traffic do, the response time of drivers that expect it,
# and the hardest braking of a car on a dry road. Below 1 s of time gap at equal speed there is risk.
LEAD_BRAKE, RESPONSE, HARDEST = 6.0, 1.0, 8.0  # m/s^2, s, m/s^2
CLOSE_MOST = 0.5  # risk of a gap behind a lead that even the hardest braking does not open in time
SAME_WAY = 0.866  # cosine of 30 deg, less turned vehicles follow each other


class RiskForm(str, Enum):
    """Names the formula by which times become a risk."""

    AS_PRINTED = "as_printed"  # max(1 - TTC/4 s, 1 - PET/2 s, 0), C-094
    RECOMMENDED = "recommended"


@dataclass(frozen=True, slots=True)
class RiskMatrix:
    """Risk of every plan in every world; rows are plans, columns worlds. NaN: not evaluated."""

    risk: Floats  # (n, n) in [0, 1]
    risk_ahead: Floats  # (n, n) from objects ahead of the ego alone
    risk_behind: Floats  # (n, n)
    ttc: Floats  # (n, n) s, inf: no overlap
    pet: Floats  # (n, n) s, inf: no conflict
    ttc_ahead: Floats  # (n, n) s, of objects ahead of the ego alone; inf: no overlap
    ttc_behind: Floats  # (n, n) s
    worst_ahead: NDArray[np.int64]  # (n, n) object index in the world's frame, -1: none
    worst_behind: NDArray[np.int64]

    @property
    def safety_scores(self) -> Floats:
        """Returns (n,) 1 - max over worlds of the risk (C-094); NaN without plan or world."""
        return np.array([1.0 - _worst_known(row) for row in self.risk.tolist()])

    @property
    def behind_share(self) -> Floats:
        """Returns (n,) the share of the risk that objects behind add beyond those ahead; NaN without risk."""
        out = []
        for row, row_ahead in zip(self.risk.tolist(), self.risk_ahead.tolist(), strict=True):
            worst = _worst_known(row)
            out.append((worst - _worst_known(row_ahead)) / worst if worst > 0.0 else np.nan)
        return np.array(out)


def _worst_known(row: list[float]) -> float:
    """Returns the greatest value of a row that is not nan; nan where there is none."""
    return max((v for v in row if v == v), default=np.nan)  # v == v: not NaN


@inner_kernel
def printed_risk(ttc: float, pet: float) -> float:
    """Returns the risk in [0, 1] of a time to collision and a PET in s (inf: none), as printed in C-094."""
    return max(1.0 - ttc / HORIZON, 1.0 - pet / PET_SAFE, 0.0)


@kernel
def ordered_risk(ttc: float, nearness: float) -> float:
    """Returns the risk of a hit after `ttc` s, or, where that is inf, of a miss with `nearness` in [0, 1]."""
    if ttc == np.inf:
        return MISS_MOST * nearness
    return MISS_MOST + (1.0 - MISS_MOST) * max(1.0 - ttc / HORIZON, 0.0)


@kernel
def braking_needed(gap: float, way: float, v: float, v_lead: float) -> float:
    """Returns the m/s^2 that a follower needs when its lead brakes at LEAD_BRAKE; inf: none is enough.

    gap: m, bumper to bumper. way: m that the follower drives in the response time, v: its speed then,
    v_lead: that of the lead now, m/s, at least 0. Source: RSS, lemma 2, solved for the braking.
    """
    left = gap + v_lead * v_lead / (2.0 * LEAD_BRAKE) - way
    if v == 0.0 and left > 0.0:
        return 0.0
    return v * v / (2.0 * left) if left > 0.0 else np.inf


@kernel
def close_risk(gap: float, way: float, v: float, v_lead: float) -> float:
    """Returns the risk of following: 0 where braking as the lead does is enough, CLOSE_MOST from HARDEST on.

    gap: m, bumper to bumper; way: m driven in the response time; v: m/s after it; v_lead: m/s of the
    lead now, at least 0.
    """
    needed = min(braking_needed(gap, way, v, v_lead), HARDEST)
    return CLOSE_MOST * max(needed - LEAD_BRAKE, 0.0) / (HARDEST - LEAD_BRAKE)


@inner_kernel
def _following_risk(
    motion: Floats, half: Floats, lead: Floats, lead_half: Floats, v_lead: float
) -> float:
    """Returns the risk of a box that moves as `motion` (SAMPLES, 4) behind one that now is at `lead` (4,).

    0 where it does not follow it. half, lead_half: (2,) m; v_lead: m/s along its heading.
    """
    me = motion[0]
    if me[2] * lead[2] + me[3] * lead[3] < SAME_WAY:
        return 0.0
    x, y = lead[0] - me[0], lead[1] - me[1]
    ahead, aside = me[2] * x + me[3] * y, me[2] * y - me[3] * x
    gap = ahead - half[0] - lead_half[0]
    if gap < 0.0 or abs(aside) > half[1] + lead_half[1]:
        return 0.0
    k = round(RESPONSE / STEP)
    way = 0.0
    step = 0.0
    for j in range(k + 1):
        step = np.hypot(motion[j + 1, 0] - motion[j, 0], motion[j + 1, 1] - motion[j, 1])
        if j < k:
            way += step
    return close_risk(gap, way, step / STEP, max(v_lead, 0.0))


@kernel
def _judge(
    ego: Movers, world: Movers, objects: Floats, pose: Floats, printed: bool, out: Floats
) -> None:
    """Writes TTC in s, PET in s, 1 for behind, and risk of each object into out (n, 4).

    pose: (5,) of the ego; times are inf where there is none.
    """
    c, s = np.cos(pose[2]), np.sin(pose[2])
    mine = ego.bounds[0]
    for i in range(objects.shape[0]):
        ttc = pet = np.inf
        nearness = 0.0
        other = world.bounds[i]
        apart = mine[0] > other[1] or mine[1] < other[0] or mine[2] > other[3] or mine[3] < other[2]
        if not apart:
            motion, half = world.motion[i], world.half[i]
            ttc = first_overlap(ego.motion[0], ego.half[0], motion, half)
            if ttc == np.inf:
                pet, nearness = encroachment(ego.motion[0], ego.half[0], motion, half)
        x, y = objects[i, 0] - pose[0], objects[i, 1] - pose[1]
        out[i, 0], out[i, 1] = ttc, pet
        out[i, 2] = 1.0 if x * c + y * s < 0.0 else 0.0
        if printed:
            out[i, 3] = printed_risk(ttc, pet)
            continue
        here, there = ego.motion[0], world.motion[i]
        v = pose[3] * here[0, 2] + pose[4] * here[0, 3]
        v_other = objects[i, 3] * there[0, 2] + objects[i, 4] * there[0, 3]
        behind = _following_risk(there, world.half[i], here[0], ego.half[0], v)
        ahead = _following_risk(here, ego.half[0], there[0], world.half[i], v_other)
        out[i, 3] = max(ordered_risk(ttc, nearness), behind, ahead)


@kernel
def _worst(judged: Floats) -> tuple[float, float, float, float, float, int, int]:
    """Returns risk ahead and behind, TTC ahead and behind, least PET, worst objects ahead and behind.

    judged: (n, 4) of `_judge`. An object is -1 where there is no risk on its side.
    """
    ahead = behind = 0.0
    ttc_ahead = ttc_behind = pet = np.inf
    i_ahead = i_behind = -1
    for i in range(judged.shape[0]):
        pet = min(pet, judged[i, 1])
        risk = judged[i, 3]
        if judged[i, 2] > 0.0:
            ttc_behind = min(ttc_behind, judged[i, 0])
            if risk > behind:
                behind, i_behind = risk, i
        else:
            ttc_ahead = min(ttc_ahead, judged[i, 0])
            if risk > ahead:
                ahead, i_ahead = risk, i
    return ahead, behind, ttc_ahead, ttc_behind, pet, i_ahead, i_behind


def risk_matrix(
    frames: Sequence[ChannelFrame | None], form: RiskForm = RiskForm.RECOMMENDED
) -> RiskMatrix:
    """Returns the risk of every channel's plan in every channel's world.

    `frames` as in a cycle: None for an absent channel, whose row and column stay NaN. Objects must
    be finite (see `frames.usable`).
    """
    n, printed = len(frames), form is RiskForm.AS_PRINTED
    risk, ahead, behind, ttc_ahead, ttc_behind, pet = np.full((6, n, n), np.nan)
    worst_ahead, worst_behind = np.full((2, n, n), -1, dtype=np.int64)
    egos = [ego_movers(frame) for frame in frames]
    worlds = [world_movers(frame) for frame in frames]
    for b, world in enumerate(worlds):
        frame_b = frames[b]
        if world is None or frame_b is None:
            continue
        judged = np.empty((len(frame_b.objects), 4))
        for a, ego in enumerate(egos):
            frame_a = frames[a]
            if ego is None or frame_a is None:
                continue
            _judge(ego, world, frame_b.objects, frame_a.ego, printed, judged)
            (
                ahead[a, b], behind[a, b], ttc_ahead[a, b], ttc_behind[a, b], pet[a, b],
                worst_ahead[a, b], worst_behind[a, b],
            ) = _worst(judged)  # fmt: skip
            risk[a, b] = max(ahead[a, b], behind[a, b])
    ttc = np.minimum(ttc_ahead, ttc_behind)
    return RiskMatrix(
        risk, ahead, behind, ttc, pet, ttc_ahead, ttc_behind, worst_ahead, worst_behind
    )


def safety_scores(frames: Sequence[ChannelFrame | None]) -> Floats:
    """Returns (n,) the safety score of each channel's plan in [0, 1]; NaN: not evaluated (C-094, C-095)."""
    return risk_matrix([usable(frame).frame if frame else None for frame in frames]).safety_scores
