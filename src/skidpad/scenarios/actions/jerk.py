"""Changes of speed whose acceleration rises and falls at limited rates (jerk)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import copysign, inf, sqrt

from skidpad.scenarios.movement.motion import SLOW
from skidpad.scenarios.scene import Actor, Scene


@dataclass(frozen=True, slots=True)
class Jerk:
    """Holds how fast an acceleration may change, m/s^3: upwards, and downwards."""

    up: float = inf
    down: float = inf

    @property
    def is_limited(self) -> bool:
        """Tells whether there is a limit at all."""
        return min(self.up, self.down) < inf


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of constant jerk: speed and acceleration at its begin, m/s, m/s^2."""

    duration: float  # s
    v: float
    a: float
    jerk: float

    def at(self, t: float) -> tuple[float, float]:
        """Returns speed and acceleration t s after its begin."""
        return self.v + t * (self.a + 0.5 * t * self.jerk), self.a + t * self.jerk

    @property
    def way(self) -> float:
        """Returns the way driven in it, m."""
        t = self.duration
        return t * (self.v + t * (0.5 * self.a + t * self.jerk / 6.0))


def smooth_pieces(
    v: float, end: float, most: float, jerk: Jerk, duration: float | None
) -> Iterator[Piece]:
    """Yields a change of speed: the acceleration rises, stays and falls, and is 0 at both ends.

    most: m/s^2; duration: s that it shall take, None for as fast as the limits allow. It takes
    longer where the limits leave no other choice.
    """
    size = end - v
    if abs(size) < SLOW:
        yield Piece(duration or 0.0, v, 0.0, 0.0)
        return
    rise, fall = (jerk.up, jerk.down) if size > 0.0 else (jerk.down, jerk.up)
    ramps = 1.0 / rise + 1.0 / fall  # s per m/s^2 of the peak
    peak = inf if ramps == 0.0 else sqrt(2.0 * abs(size) / ramps)
    if duration is not None and duration * duration > 2.0 * ramps * abs(size):
        root = sqrt(duration * duration - 2.0 * ramps * abs(size))
        peak = 2.0 * abs(size) / (duration + root)
    peak = min(peak, most)
    sign = copysign(1.0, size)
    held = max(abs(size) / peak - 0.5 * peak * ramps, 0.0)
    up = Piece(peak / rise, v, 0.0, sign * rise if rise < inf else 0.0)
    reached = v + sign * 0.5 * peak * up.duration
    hold = Piece(held, reached, sign * peak, 0.0)
    down = Piece(
        peak / fall, reached + sign * peak * held, sign * peak, -sign * fall if fall < inf else 0.0
    )
    yield from (up, hold, down)


def round_corners(
    v: float, a: float, points: Sequence[tuple[float, float]], jerk: Jerk
) -> list[Piece] | None:
    """Returns a course along straight lines between speeds, with its corners rounded.

    points: durations, s, and the speeds at their ends. The acceleration is `a` at the begin and 0 at
    the end. None where two corners overlap.
    """
    lines: list[tuple[float, float]] = []  # acceleration, and speed at time 0
    t, before = 0.0, v
    for duration, end in points:
        slope = (end - before) / duration
        if not lines or abs(slope - lines[-1][0]) > SAME_SLOPE:
            lines.append((slope, before - slope * t))
        t, before = t + duration, end
    if abs(lines[-1][0]) > SAME_SLOPE:
        lines.append((0.0, before))
    pieces: list[Piece] = []
    now, slope, level = 0.0, a, v
    for k, (aimed, its_level) in enumerate(lines):
        change = aimed - slope
        rate = jerk.up if change > 0.0 else -jerk.down
        lasts = change / rate
        begin = (its_level - level) / -change - 0.5 * lasts if k else 0.0
        if begin < now:
            return None
        pieces.append(Piece(begin - now, v, slope, 0.0))
        v += slope * (begin - now)
        pieces.append(Piece(lasts, v, slope, rate if abs(rate) < inf else 0.0))
        v += 0.5 * (slope + aimed) * lasts
        now, slope = begin + lasts, aimed
        level = v - slope * now
    return pieces


SAME_SLOPE = 1e-6  # m/s^2


def pieces_under_way(
    v: float, a: float, end: float, most: float, jerk: Jerk, duration: float | None
) -> list[Piece] | None:
    """Returns a change of speed that begins with the acceleration `a` and ends without one.

    most: m/s^2; duration: s that it shall take, None for as fast as the limits allow. None where the
    acceleration lies beyond what the change needs.
    """
    size = end - v
    mean = size / duration if duration else copysign(most, size)
    first = jerk.up if mean > a else -jerk.down
    last = -jerk.down if mean > 0.0 else jerk.up
    if first * last >= 0.0:
        return None
    ramps, gain = 0.5 / first - 0.5 / last, size + 0.5 * a * a / first
    if ramps == 0.0 or gain / ramps < 0.0:
        return None
    peak = copysign(sqrt(gain / ramps), mean)
    time = a / first + (duration or 0.0)
    room = time * time - 4.0 * ramps * gain
    if duration is not None and time > 0.0 and room > 0.0:
        peak = 2.0 * gain / (time + sqrt(room))
    peak = copysign(min(abs(peak), most), peak)
    if peak == 0.0 or (peak - a) / first < 0.0:
        return None
    held = max((size - 0.5 * (peak * peak - a * a) / first + 0.5 * peak * peak / last) / peak, 0.0)
    rise = Piece((peak - a) / first, v, a, first if abs(first) < inf else 0.0)
    reached = v + 0.5 * (peak + a) * rise.duration
    hold = Piece(held, reached, peak, 0.0)
    fall = Piece(-peak / last, reached + peak * held, peak, last if abs(last) < inf else 0.0)
    return [rise, hold, fall]


def settle(v: float, a: float, jerk: Jerk) -> Piece:
    """Returns the piece that brings an acceleration `a` under way to 0 at the limit of jerk.

    Its duration is 0 where a is 0 or jerk is not limited.
    """
    rate = jerk.down if a > 0.0 else jerk.up
    if a == 0.0 or rate == inf:
        return Piece(0.0, v, 0.0, 0.0)
    return Piece(abs(a) / rate, v, a, -copysign(rate, a))


def pieces_over(v: float, end: float, most: float, jerk: Jerk, way: float) -> list[Piece]:
    """Returns a change of speed that takes `way` m, both speeds of one sign.

    It takes a longer way where the limits leave no other choice.
    """

    def change(duration: float | None) -> tuple[list[Piece], float]:
        pieces = list(smooth_pieces(v, end, most, jerk, duration))
        return pieces, abs(sum(piece.way for piece in pieces))

    pieces, least = change(None)
    if least >= way or abs(end - v) < SLOW:
        return pieces
    short = sum(piece.duration for piece in pieces)
    long = 2.0 * way / abs(v + end)
    while change(long)[1] < way:
        short, long = long, 2.0 * long
    for _ in range(BISECTIONS):
        middle = 0.5 * (short + long)
        short, long = (middle, long) if change(middle)[1] < way else (short, middle)
    return change(long)[0]


BISECTIONS = 50
ROUNDING = 1e-9  # s, of sums of steps


class SmoothProfile:
    """A speed profile under way, piece by piece."""

    def __init__(self, actor: Actor, began: float, pieces: list[Piece], end: float) -> None:
        self.actor, self.began, self.pieces, self.end = actor, began, pieces, end

    def step(self, scene: Scene) -> bool:
        """Sets the speed demanded for the end of this step; True when the last speed is reached."""
        if self.actor.longitudinal is not self:
            return True
        t, guide = scene.t + scene.dt - self.began, self.actor.guide
        for piece in self.pieces:
            if t < piece.duration - ROUNDING:
                guide.v, guide.a = piece.at(t)
                return False
            t -= piece.duration
        guide.v, guide.a = self.end, 0.0
        return True
