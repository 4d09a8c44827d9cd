"""What avoids the failure of a recorded run by the bound of `search.bound`: from log and map to boxes."""

from __future__ import annotations

from functools import partial
from math import ceil, pi

import numpy as np

from skidpad.core.arrays import Flags, Floats
from skidpad.core.geometry import wrap_angle
from skidpad.recording.run.log import RunLog
from skidpad.roads.queries import RoadMap
from skidpad.search.bound import (
    REACTION,
    Motion,
    Path,
    Start,
    Track,
    boxes_overlap,
    continue_track,
    find_avoidance,
    first_known_row,
    is_in_sight,
    predict_motion,
    replace_places,
    take_rows,
)

BEFORE = 10.0  # s before a failure in which its beginning is looked for
AFTER = 3.0  # s after it, up to which manoeuvres are judged
STATIC = 0.5  # m, size of the box that stands for what was touched and is no road user


def find_run_avoidance(log: RunLog, road: RoadMap, tick: int, actor: int | None) -> str:
    """Return what would have avoided a failure from the state it began in; "" where nothing does.

    Args:
        log: of the run.
        road: its map.
        tick: of the contact, or of the departure.
        actor: row of what was touched, -1 for what stands; None for a departure.
    """
    last = min(int(log.tick.searchsorted(tick)), len(log) - 1) - 1
    dt = log.header.dt
    first = max(last - round(BEFORE / dt), 0)
    if last <= first or np.isnan(log.mu[first : last + 1, 0]).any():
        return ""
    rows = np.arange(first, last + 1)
    tracks = [track_of(log, i) for i in range(len(log.table.names))]
    standing = [_standing(log, tick)] if actor == -1 else []
    seen = _foreseen(log, road, tracks, actor, rows, standing)
    begin = first + first_known_row(seen)
    mu = float(log.mu[begin : last + 1, 0].mean(axis=1).min())
    n = last + 1 - begin + round(AFTER / dt)
    start, path = _start(log, road, begin)
    others = _others(log, road, tracks, actor, begin, last)
    others += [replace_places(s, *(np.full(n, c) for c in s[:3])) for s in standing]
    return find_avoidance(start, path, others, road.edge.beyond, mu, dt, n, REACTION)


def track_of(log: RunLog, actor: int) -> Track:
    """Returns the recorded box of an actor in all ticks of the log."""
    a, i = log.actors, actor
    x, y, yaw = (np.asarray(c[:, i], dtype=np.float64) for c in (a.x, a.y, a.yaw))
    return Track(
        x, y, yaw, log.present[:, i], float(log.table.length[i]), float(log.table.width[i])
    )


def motion_of(log: RunLog, actor: int) -> Motion:
    """Returns the recorded speed along the heading in m/s, and the yaw rate in rad/s, of an actor."""
    a = log.actors
    series = (a.vx, a.vy, a.yaw, a.yaw_rate)
    vx, vy, yaw, rate = (np.asarray(c[:, actor], dtype=np.float64) for c in series)
    return Motion(vx * np.cos(yaw) + vy * np.sin(yaw), np.nan_to_num(rate))


def _foreseen(
    log: RunLog, road: RoadMap, tracks: list[Track], actor: int | None, rows: np.ndarray,
    standing: list[Track],
) -> Flags:  # fmt: skip
    """Returns (rows,) whether constant motion leads to the failure, and what is touched can be seen.

    actor: row of what is touched, as in `find_run_avoidance`. Seeing is asked only back to the last gap.
    """
    ego = predict_motion(tracks[0], motion_of(log, 0), rows)
    if actor is None or actor < 0:
        z = np.repeat(log.actors.z[rows, 0], ego.x.shape[1])
        flat = (ego.x.ravel(), ego.y.ravel(), z)
        leads_off = (road.edge.beyond(*flat) > 0.0).reshape(ego.x.shape).any(axis=1)
        for thing in standing:
            leads_off |= boxes_overlap(ego, thing).any(axis=1)
        return np.asarray(leads_off)
    other = predict_motion(tracks[actor], motion_of(log, actor), rows)
    foreseen = boxes_overlap(ego, other).any(axis=1) & log.present[rows, actor]
    third = [t for i, t in enumerate(tracks) if i not in (0, actor)]
    for k in range(len(rows) - 1, -1, -1):  # what lies before the last gap is not asked for
        if foreseen[k]:
            foreseen[k] = is_in_sight(tracks[0], tracks[actor], third, int(rows[k]))
        if not foreseen[k]:
            break
    return np.asarray(foreseen)


def _start(log: RunLog, road: RoadMap, row: int) -> tuple[Start, Path]:
    """Returns the ego's state in a row and the path of its lane from there on; straight on off the lanes."""
    track, motion = track_of(log, 0), motion_of(log, 0)
    x, y, yaw = (float(c[row]) for c in track[:3])
    z, v = float(log.actors.z[row, 0]), max(float(motion.speed[row]), 0.0)
    far = ceil(v * (BEFORE + AFTER + REACTION)) + 20
    straight = np.array([[0.0, 0.0], [float(far), 0.0]])
    curvature = float(motion.yaw_rate[row]) / v if v > 0.5 else 0.0
    of = partial(
        Start, speed=v, curvature=curvature, length=track.length, width=track.width
    )  # fmt: skip
    point = road.project(x, y, z)
    traced = None if point is None else road.trace_ahead(point, 1.0, far, heading=yaw)
    off_angle = 0.0 if point is None else wrap_angle(yaw - point.heading)
    if point is None or traced is None or len(traced) < 2 or abs(off_angle) > 0.5 * pi:
        way = straight[:, 0]
        return of(), Path(
            way, x + way * np.cos(yaw), y + way * np.sin(yaw), np.full(2, z), np.full(2, yaw),
            np.zeros(2),
        )  # fmt: skip
    places = np.vstack([[point.x, point.y, point.z, point.curvature], traced])
    return of(offset=point.offset, angle=off_angle), _path(places, point.heading, far)


def _path(places: Floats, heading: float, far: int) -> Path:
    """Returns a path through places (n, 4) x, y, z, curvature, at least `far` m long.

    heading: rad at its begin. It goes on straight where the road ends.
    """
    way = np.append(0.0, np.cumsum(np.hypot(np.diff(places[:, 0]), np.diff(places[:, 1]))))
    chords = np.arctan2(np.diff(places[:, 1]), np.diff(places[:, 0]))
    middle = 0.5 * (way[1:] + way[:-1])
    known = np.unwrap(np.append(heading, chords))
    headings = np.interp(way, np.append(0.0, middle), known)
    x, y, z, curvature = places.T
    if way[-1] < far:
        more = far - way[-1]
        way = np.append(way, [way[-1] + 1e-6, way[-1] + more])
        x = np.append(x, [x[-1], x[-1] + more * np.cos(headings[-1])])
        y = np.append(y, [y[-1], y[-1] + more * np.sin(headings[-1])])
        z, headings = np.append(z, [z[-1]] * 2), np.append(headings, [headings[-1]] * 2)
        curvature = np.append(curvature, [0.0, 0.0])
    return Path(way, x, y, z, headings, curvature)


def _others(
    log: RunLog, road: RoadMap, tracks: list[Track], actor: int | None, begin: int, last: int
) -> list[Track]:
    """Return the boxes of all others from `begin` on; what was touched goes on as if it was not."""
    dt = log.header.dt
    end = min(last + round(AFTER / dt) + 1, len(log))
    found = []
    for i, track in enumerate(tracks):
        if i == 0 or not track.present[begin:end].any():
            continue
        if i != actor:
            found.append(take_rows(track, begin, end))
            continue
        x, y, yaw = (float(c[last]) for c in track[:3])
        point = road.project(x, y, float(log.actors.z[last, i]))
        follows = point is not None and abs(wrap_angle(yaw - point.heading)) < 0.25 * pi
        along = point.heading if point is not None and follows else yaw
        cut, speed = take_rows(track, begin, last + 1), motion_of(log, i).speed[begin : last + 1]
        found += continue_track(cut, speed, last - begin, round(AFTER / dt), dt, along)
    return found


def _standing(log: RunLog, tick: int) -> Track:
    """Return a small box at the place of a contact with what is no road user."""
    contact = next(c for c in log.contacts if c.tick == tick and c.actor < 0)
    place = np.array(contact.x), np.array(contact.y), np.zeros(())
    return Track(*place, np.ones((), dtype=bool), STATIC, STATIC)
