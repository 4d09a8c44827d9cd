"""How a car was driven, counted from its log: what the studies of single functions compare.

Limits here tell events apart; those without a source are ours and were set before any study was run.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Flags
from skidpad.core.vocabulary import Supervision, Tier
from skidpad.recording.run.log import RunLog

BRAKING = (Tier.HARD_STOP, Tier.EMERGENCY)
FOLLOWING = (Tier.ACC_HOLD, Tier.ACC_OPEN, Tier.ACC_CLOSE)
CRUISING = (Tier.CRUISE, Tier.COAST)
NEAR = 40.0  # m around the ego that must be empty for braking "for nothing"
SURGE_TIME = 2.0  # s before emergency braking in which the car still pulled away
SURGE_THROTTLE = 0.3
SPIN_ANGLE = np.deg2rad(15.0)  # between where the car points and where it moves
SPIN_SPEED = 5.0  # m/s, below it the angle says little
CALM = 3.0  # s after a contact or a relocation that do not count
COOL_DOWN = 3.0  # s after a relocation in which a contact starts no recovery
JERK_OVER = 0.5  # s between the speeds from which jerk is taken


def phantom_brakings(log: RunLog) -> int:
    """Returns how often emergency braking began although nothing was within NEAR of the ego.

    Whatever stands or drives there, in any lane: a strict reading of "for nothing".
    """
    a = log.actors
    distance = np.hypot(a.x - a.x[:, :1], a.y - a.y[:, :1])
    distance[:, 0] = np.inf
    empty = np.where(log.present, distance, np.inf).min(axis=1) > NEAR
    return int(np.sum(_begins(_emergency(log)) & empty))


def surges(log: RunLog) -> int:
    """Returns how often emergency braking began within SURGE_TIME of pulling away in free cruise (F-18)."""
    pulling = np.isin(log.report.tier, CRUISING) & (log.applied.throttle > SURGE_THROTTLE)
    recent = _within(pulling & _free(log), SURGE_TIME, log.header.dt)
    return int(np.sum(_begins(_emergency(log)) & recent))


def mode_changes_per_min(log: RunLog) -> float | None:
    """Returns changes between following and free cruise per minute of both (F-19); None: neither."""
    follows, cruises = (np.isin(log.report.tier, t) & _free(log) for t in (FOLLOWING, CRUISING))
    either = follows | cruises
    if not either.any():
        return None
    changed = either[1:] & either[:-1] & (follows[1:] != follows[:-1])
    return float(60.0 * changed.sum() / (either.sum() * log.header.dt))


def jerk_rms(log: RunLog) -> float | None:
    """Returns the root mean square of longitudinal jerk in m/s^3 over steps of 0.5 s; None: too short.

    Ticks of the supervisor, and soon after a contact or relocation, are left out.
    """
    step = max(1, round(JERK_OVER / log.header.dt))
    v = log.ego.speed[::step]
    calm = (_free(log) & ~_disturbed_ticks(log))[::step]
    if len(v) < 3:
        return None
    jerk = np.diff(v, 2) / (step * log.header.dt) ** 2
    use = calm[:-2] & calm[1:-1] & calm[2:]
    return float(np.sqrt(np.mean(jerk[use] ** 2))) if use.any() else None


def spins(log: RunLog) -> int:
    """Returns how often the car began to move more than SPIN_ANGLE off its heading by itself (F-29)."""
    a = log.actors
    vx, vy, yaw = (c[:, 0].astype(np.float64) for c in (a.vx, a.vy, a.yaw))
    forward = np.cos(yaw) * vx + np.sin(yaw) * vy
    aside = np.cos(yaw) * vy - np.sin(yaw) * vx
    slides = np.abs(np.arctan2(aside, forward)) > SPIN_ANGLE
    slides &= (np.hypot(vx, vy) > SPIN_SPEED) & _free(log) & ~_disturbed_ticks(log)
    return int(np.sum(_begins(slides)))


def hits_in_cool_down(log: RunLog) -> int:
    """Returns how many relocations were followed by a contact of the ego within COOL_DOWN (F-30)."""
    lag = COOL_DOWN / log.header.dt
    hits = np.array([c.tick for c in log.contacts], dtype=np.int64)
    return sum(bool(np.any((hits > r.tick) & (hits - r.tick <= lag))) for r in log.relocations)


def _free(log: RunLog) -> Flags:
    """Returns (n,) True in the ticks in which no supervisor had the ego."""
    free: Flags = log.supervision == Supervision.NONE
    return free


def _emergency(log: RunLog) -> Flags:
    """Returns (n,) True in the ticks without a supervisor in which the stack reports a tier of BRAKING."""
    braking: Flags = np.isin(log.report.tier, BRAKING) & _free(log)
    return braking


def _begins(mask: Flags) -> Flags:
    """Returns (n,) True where the mask is True and was False the tick before."""
    begins: Flags = mask & ~np.concatenate([[False], mask[:-1]])
    return begins


def _within(mask: Flags, seconds: float, dt: float) -> Flags:
    """Returns (n,) True in ticks at most `seconds` after one of `mask`, that one included; dt: s per tick."""
    last = np.maximum.accumulate(np.where(mask, np.arange(len(mask)), -(10**9)))
    recent: Flags = np.arange(len(mask)) - last <= round(seconds / dt)
    return recent


def _disturbed_ticks(log: RunLog) -> Flags:
    """Returns (n,) True in ticks at most CALM s after a contact or a relocation."""
    mask = np.zeros(len(log), dtype=np.bool_)
    events = [c.tick for c in log.contacts] + [r.tick for r in log.relocations]
    rows = np.clip(np.searchsorted(log.tick, np.array(events, dtype=np.int64)), 0, len(log) - 1)
    mask[rows] = True
    return _within(mask, CALM, log.header.dt)
