"""The nine quantities of the friction study, and what they say, from the log of one run.

B-100 to B-106, B-144, B-145, B-149. The series stand in road coordinates of a straight road along
the world's x axis; steering is CARLA-handed as published, converted by `core.maths.lefthanded`.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from itertools import combinations
from math import degrees
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.maths.lefthanded import mirror_value
from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import ENDED, ActorKind, Outcome
from skidpad.recording.campaign.grip import GripMetrics
from skidpad.recording.run.log import RunLog

# What counts as lost control is our choice, no standard's: 49 CFR 571.126 (FMVSS 126) judges the decay
# of the yaw rate after a sine-with-dwell steer, which no scenario here performs.
V_SLIP = 3.0  # m/s, below which side slip says nothing
SLIP_LOST = 15.0  # deg, about twice the slip angle at which tyres saturate
YAW_LOST = 60.0  # deg from the road's direction: a spin
LOST_TIME = 0.3  # s that it must last
TOUCH = 0.1  # m between bodies that counts as touching
STEER_DEAD = 0.005  # steering smaller than this is no correction
EGO = 0


@cache
def penalties() -> dict[str, float]:
    """Returns the factors of the benchmark score, by infraction."""
    return msgspec.yaml.decode(
        (files("skidpad.evidence.grip") / "score.yaml").read_bytes(), type=dict[str, float]
    )


def grip_series(log: RunLog) -> NDArray[np.float32]:
    """Returns (T, 9) x, y, v, cvip, steer, brake, throttle of the ego, then x, y of the first NPC.

    x lateral (left positive), y along the road, m; brake is the pedal pressed or not (B-103).
    With several NPCs cvip takes the nearer at each tick (B-093).
    """
    a = log.actors
    out = np.zeros((len(log), 9), dtype=np.float32)
    out[:, 0], out[:, 1], out[:, 2] = a.y[:, EGO], a.x[:, EGO], log.v_ego
    out[:, 3] = centre_distance(log)
    out[:, 4] = mirror_value(1.0) * log.requested.steer
    out[:, 5], out[:, 6] = log.requested.brake > 0.0, log.requested.throttle
    if a.x.shape[1] > 1:
        out[:, 7], out[:, 8] = a.y[:, 1], a.x[:, 1]
    return out


def centre_distance(log: RunLog) -> Floats:
    """Returns (T,) m between box centres, ego to the nearest other vehicle; inf without one (B-102)."""
    a = log.actors
    distance = np.hypot(a.x[:, 1:] - a.x[:, :1], a.y[:, 1:] - a.y[:, :1]).astype(np.float64)
    distance[~log.present[:, 1:]] = np.inf
    nearest: Floats = distance.min(axis=1, initial=np.inf)
    return nearest


def grip_metrics(
    log: RunLog,
    outcome: Outcome,
    *,
    triggered: bool,
    route_length: float | None,
    ratio: float,
    off_road: NDArray[np.bool_] | None = None,
) -> GripMetrics:
    """Returns the row of a run; nearly all None for an empty log.

    route_length: m; ratio: of friction, at standstill; off_road: (T,) ticks with all wheels off
    every lane, None: never.
    """
    if len(log) == 0:
        return GripMetrics(triggered=triggered, ratio=ratio)
    contacts = log.contacts
    first = min((c.tick for c in contacts), default=int(log.tick[-1]) + 1)
    touching = npc_contact_row(log)
    before = int(np.searchsorted(log.tick, first))
    quiet = before if touching is None else min(before, touching)
    slips = side_slips(log)
    npcs = range(1, len(log.table))
    steps = np.hypot(np.diff(log.actors.x[:, EGO]), np.diff(log.actors.y[:, EGO]))
    distance = float(steps.sum())
    strayed = (
        0.0 if off_road is None or not distance else float(steps[off_road[1:]].sum()) / distance
    )
    route = route_share(outcome, distance, route_length)
    crashed = outcome in ENDED
    departed = off_road is not None and bool(off_road.any())
    nearest = centre_distance(log).min()
    return GripMetrics(
        triggered=triggered,
        completion=not crashed and not departed,
        score=None if route is None else score(route, log, contacts, strayed),
        route_completion=route,
        off_lanes_pct=100.0 * strayed,
        min_cvip_m=float(nearest) if np.isfinite(nearest) else None,
        loss_of_control_ego=loses_control(log, slips, EGO, before),
        loss_of_control_npc=any(loses_control(log, slips, i, quiet) for i in npcs),
        npc_contact=touching is not None,
        max_slip_ego_deg=_largest(slips[:before, EGO]),
        max_slip_npc_deg=_largest(slips[:quiet, 1:]),
        max_yaw_rate_npc_deg_s=degrees(_largest(log.actors.yaw_rate[:quiet, 1:])),
        steer_std=float(np.std(log.requested.steer)),
        steer_corrections=corrections(log.requested.steer, log.header.dt),
        ratio=ratio,
        mu=float(np.nanmean(log.mu[:, EGO])),
        impact_kmh=kmh_from_mps(contacts[0].v_closing) if contacts else None,
        duration_s=float(log.t[-1]),
        distance_m=distance,
    )


def route_share(outcome: Outcome, distance: float, route_length: float | None) -> float | None:
    """Returns the percent of the route: all of it when the scenario came to its end, else the way driven.

    0 when the stack failed; None where the way driven counts and there is no route. Lengths in m.
    """
    if outcome is Outcome.AGENT_ERROR:
        return 0.0
    if outcome not in ENDED:
        return 100.0
    return None if not route_length else 100.0 * min(distance / route_length, 1.0)


def score(
    route: float, log: RunLog, contacts: tuple[ContactEvent, ...], strayed: float = 0.0
) -> float:
    """Returns route completion in % times a penalty for each infraction (B-105).

    strayed: share of the way driven off all lanes; the benchmark multiplies by what remains (B-106).
    """
    factors = penalties()
    value = route * (1.0 - strayed)
    for contact in contacts:
        if contact.static:
            value *= factors["collision_static"]
        elif log.table.kind[contact.actor] == ActorKind.PEDESTRIAN:
            value *= factors["collision_pedestrian"]
        else:
            value *= factors["collision_vehicle"]
    return value


def side_slips(log: RunLog) -> Floats:
    """Returns (T, n) deg between where a vehicle looks and where it goes, by size; 0 below V_SLIP."""
    a = log.actors
    speed = np.hypot(a.vx, a.vy)
    turn = np.arctan2(a.vy, a.vx) - a.yaw
    slip = np.degrees((turn + np.pi) % (2.0 * np.pi) - np.pi)
    out: Floats = np.where(speed > V_SLIP, np.abs(slip), 0.0).astype(np.float64)
    return out


def loses_control(log: RunLog, slips: Floats, actor: int, end: int) -> bool:
    """Returns whether an actor slides or has spun for LOST_TIME in the rows before `end` (B-145)."""
    yaw = np.abs(np.degrees((log.actors.yaw[:end, actor] + np.pi) % (2.0 * np.pi) - np.pi))
    lost = (slips[:end, actor] > SLIP_LOST) | (yaw > YAW_LOST)
    return longest(lost) * log.header.dt >= LOST_TIME


def longest(flags: NDArray[np.bool_]) -> int:
    """Returns the length of the longest run of True; 0 without any."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[0::2]).max(initial=0))


def corrections(steer: Floats, dt: float) -> float:
    """Returns changes of steering direction per second, of moves larger than STEER_DEAD."""
    move = np.diff(steer)
    move = move[np.abs(move) > STEER_DEAD]
    turns = np.count_nonzero(np.diff(np.sign(move)))
    return float(turns / max(len(steer) * dt, dt))


def npc_contact_row(log: RunLog) -> int | None:
    """Returns the first row in which two NPCs touch, by their boxes; None: they never do."""
    rows = [_touching_row(log, i, j) for i, j in combinations(range(1, len(log.table)), 2)]
    return min((r for r in rows if r is not None), default=None)


def _touching_row(log: RunLog, i: int, j: int) -> int | None:
    """Returns the first row in which the boxes of two actors are within TOUCH; None: never."""
    a, t = log.actors, log.table
    dx, dy = a.x[:, j] - a.x[:, i], a.y[:, j] - a.y[:, i]
    apart = ~(log.present[:, i] & log.present[:, j])
    for own, other in ((i, j), (j, i)):
        for quarter, half in ((0.0, t.length[own]), (np.pi / 2.0, t.width[own])):
            axis = a.yaw[:, own] + quarter
            turn = a.yaw[:, other] - axis
            reach = 0.5 * (
                half
                + t.length[other] * np.abs(np.cos(turn))
                + t.width[other] * np.abs(np.sin(turn))
            )
            apart |= np.abs(dx * np.cos(axis) + dy * np.sin(axis)) > reach + TOUCH
    touching = np.flatnonzero(~apart)
    return int(touching[0]) if touching.size else None


def _largest(values: Any) -> float:
    """Returns the largest absolute value; 0 for none."""
    return float(np.max(np.abs(values), initial=0.0))
