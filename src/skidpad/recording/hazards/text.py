"""Worlds of channels as compact lines of text (C-150, C-158, decision C-13).

Whole numbers of 1 cm, 1 mrad, 1 cm/s and 1 ms; `~` stands for a value that is not a number.
Positions are what is left after moving on at the last reported velocity, all else is the
difference to the line before, so what moves steadily costs one digit per number. Poses come every
cycle, plans and predictions every 0.5 s, shapes when a vertex has moved by more than 5 cm.

    W t_ms                                    a cycle (milliseconds since the one before)
    E c x y ...                               shape of channel c's ego
    F c age x y heading vx vy                 channel c's ego; age of its message in ms
    L c t x y ...                             its plan
    T c t ...                                 times of its predictions
    S c slot id class x y ...                 object `slot` from now on: identity, class and shape
    O c slot x y heading vx vy ...            its objects of the cycle, six numbers each
    Q c slot x y ...                          prediction of the object in `slot`
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle

HEADER = "SKIDPAD HAZARDS 1"
PATHS_EVERY_MS = 500
SHAPE_TOLERANCE = 5  # cm
NUMBER_LIMIT = 10**15  # a greater size is written as not a number
_POSE_SCALE = np.array([100.0, 100.0, 1000.0, 100.0, 100.0])  # cm, cm, mrad, cm/s, cm/s
Pose = list["int | None"]  # x, y in cm, heading in mrad, vx, vy in cm/s
Numbers = list["int | None"]


@dataclass(slots=True)
class Object:
    """What both sides know about an object in a slot."""

    id: int
    label: int
    shape: Numbers
    pose: Pose = field(default_factory=lambda: [0] * 5)


@dataclass(slots=True)
class Channel:
    """What both sides know about a channel."""

    ego_shape: Numbers = field(default_factory=list)
    ego: Pose = field(default_factory=lambda: [0] * 5)
    slots: dict[int, Object] = field(default_factory=dict)
    next_slot: int = 0  # never used again, so that both sides agree on what a slot holds
    times: Numbers = field(default_factory=list)
    paths_at: int | None = None  # ms
    seen_at: int = 0  # ms


def encode_worlds(worlds: Sequence[Cycle], n_channels: int) -> list[str]:
    """Returns the worlds of a hazard as lines of text."""
    channels = [Channel() for _ in range(n_channels)]
    lines: list[str] = []
    last = 0
    for cycle in worlds:
        now = _scale_to_integer(cycle.t, 1000) or 0
        lines.append(f"W {now - last}")
        last = now
        for c, frame in enumerate(cycle.frames):
            if frame is not None:
                lines.extend(_encode_frame(c, channels[c], frame, now))
    return lines


def _encode_frame(c: int, channel: Channel, frame: ChannelFrame, now: int) -> list[str]:
    """Returns the lines of a channel's frame at `now` ms, and updates the channel's state."""
    lines = []
    shape = _flat(frame.ego_polygon, 100)
    if _has_moved(shape, channel.ego_shape):
        channel.ego_shape = shape
        lines.append(_line("E", c, shape))
    dt = now - channel.seen_at
    (ego,) = _poses(frame.ego[None])
    age = now - (_scale_to_integer(frame.t, 1000) or 0)
    lines.append(_line("F", c, [age, *_differences(ego, moved_on(channel.ego, dt))]))
    channel.ego, channel.seen_at = ego, now
    slots = _assign_slots(channel, frame)
    lines.extend(_encode_objects(c, channel, frame, slots, dt))
    if channel.paths_at is None or now - channel.paths_at >= PATHS_EVERY_MS:
        channel.paths_at = now
        lines.extend(_encode_paths(c, channel, frame, slots))
    return lines


def _encode_objects(
    c: int, channel: Channel, frame: ChannelFrame, slots: list[int], dt: int
) -> list[str]:
    """Returns the lines of a frame's objects; `dt` ms have gone since the channel's last."""
    lines = []
    row: Numbers = []
    poses, shapes = _poses(frame.objects), _shapes(frame)
    for i, slot in enumerate(slots):
        shape = shapes[i]
        id_, label = int(frame.ids[i]), int(frame.classes[i])
        known = channel.slots.get(slot)
        if (
            known is None
            or known.id != id_
            or known.label != label
            or _has_moved(shape, known.shape)
        ):
            pose: Pose = known.pose if known else [0] * 5
            known = channel.slots[slot] = Object(id_, label, shape, pose)
            lines.append(_line("S", c, [slot, id_, label, *shape]))
        pose = poses[i]
        row += [slot, *_differences(pose, moved_on(known.pose, dt))]
        known.pose = pose
    lines.append(_line("O", c, row))
    return lines


def _encode_paths(c: int, channel: Channel, frame: ChannelFrame, slots: list[int]) -> list[str]:
    """Returns the lines of plan and predictions; a straight rest of a prediction is left out."""
    plan: Numbers = []
    t = _curvature(_flat(frame.plan[:, 2], 1000))
    x = _curvature(_flat(frame.plan[:, 0], 100))
    y = _curvature(_flat(frame.plan[:, 1], 100))
    for triple in zip(t, x, y, strict=True):
        plan += triple
    lines = [_line("L", c, plan)]
    times = _flat(frame.prediction_t, 1000)
    if times != channel.times:
        channel.times = times
        lines.append(_line("T", c, times))
    if not times:
        return lines
    for i, slot in enumerate(slots):
        pose = channel.slots[slot].pose
        path: Numbers = []
        steps = _flat(frame.predictions[i], 100)
        xs, ys = _curvature(steps[0::2], pose[0]), _curvature(steps[1::2], pose[1])
        for pair in zip(xs, ys, strict=True):
            path += pair
        while path[-2:] == [0, 0]:  # straight on at constant speed to the end
            path = path[:-2]
        lines.append(_line("Q", c, [slot, *path]))
    return lines


def _assign_slots(channel: Channel, frame: ChannelFrame) -> list[int]:
    """Returns a slot per object: its identity's, else the nearest free known one within 3 m, else new."""
    free = dict(channel.slots)
    slots = []
    poses = _poses(frame.objects)
    by_id = {known.id: slot for slot, known in channel.slots.items() if known.id >= 0}
    for i, pose in enumerate(poses):
        slot = by_id.get(int(frame.ids[i])) if frame.ids[i] >= 0 else _nearest_slot(free, pose)
        if slot is None or slot not in free:
            slot = channel.next_slot
            channel.next_slot += 1
        free.pop(slot, None)
        slots.append(slot)
    if frame.ids.size == 0 or frame.ids[0] < 0:
        for slot in free:  # without identities a vanished object's slot must not linger
            del channel.slots[slot]
    return slots


def _nearest_slot(free: dict[int, Object], pose: Pose) -> int | None:
    """Returns the free slot nearest to the pose, within 3 m and without an id; None if none."""
    best, best_square = None, 300**2
    x, y = pose[0], pose[1]
    if x is None or y is None:
        return None
    for slot, known in free.items():
        if known.id >= 0 or known.pose[0] is None or known.pose[1] is None:
            continue
        square = (known.pose[0] - x) ** 2 + (known.pose[1] - y) ** 2
        if square < best_square:
            best, best_square = slot, square
    return best


def _scale_to_integer(value: float, scale: int) -> int | None:
    """Returns the value times the scale, rounded; None where it is nan or too large."""
    number = value * scale
    return round(number) if abs(number) < NUMBER_LIMIT else None  # also NaN


def _poses(rows: Floats) -> list[Pose]:
    """Returns states (n, 5) as whole numbers of cm, mrad and cm/s."""
    flat = _flat(rows * _POSE_SCALE, 1)
    return [flat[i : i + 5] for i in range(0, len(flat), 5)]


def _flat(table: Floats, scale: int) -> Numbers:
    """Returns all numbers of a table times the scale as whole numbers, row by row."""
    scaled = table.ravel() * scale
    if np.all(np.abs(scaled) < NUMBER_LIMIT):  # also false for NaN
        whole: Numbers = np.rint(scaled).astype(np.int64).tolist()
        return whole
    return [_scale_to_integer(v, scale) for v in table.ravel().tolist()]


def _shapes(frame: ChannelFrame) -> list[Numbers]:
    """Returns the vertices of each object's shape as whole numbers of cm."""
    n, k, _ = frame.polygons.shape
    if np.all(frame.polygon_size == k):  # the common case: nothing is padded
        flat = _flat(frame.polygons, 100)
        return [flat[2 * k * i : 2 * k * (i + 1)] for i in range(n)]
    return [_flat(frame.polygons[i, : frame.polygon_size[i]], 100) for i in range(n)]


def _has_moved(shape: Numbers, known: Numbers) -> bool:
    """Returns True when a shape differs from the known one by more than SHAPE_TOLERANCE."""
    if shape == known:
        return False
    if len(shape) != len(known):
        return True
    return any(
        (a is None) != (b is None) or abs((a or 0) - (b or 0)) > SHAPE_TOLERANCE
        for a, b in zip(shape, known, strict=True)
    )


def moved_on(pose: Pose, dt_ms: int) -> Pose:
    """Returns the pose (cm, mrad, cm/s) `dt_ms` ms later at its own velocity; None counts as 0."""
    x, y, heading, vx, vy = (v or 0 for v in pose)
    return [x + vx * dt_ms // 1000, y + vy * dt_ms // 1000, heading, vx, vy]


def _differences(values: Numbers, base: Numbers) -> Numbers:
    """Returns the values less the base, None where a value is absent."""
    return [None if v is None else v - (b or 0) for v, b in zip(values, base, strict=True)]


def _curvature(values: Numbers, before: int | None = None) -> Numbers:
    """Returns differences of differences; the first value is relative to `before`."""
    out: Numbers = []
    last, step = before or 0, 0
    for i, v in enumerate(values):
        if v is None:
            out.append(None)
            continue
        out.append(v - last - step)
        step = v - last if i > 0 or before is not None else 0
        last = v
    return out


def _line(kind: str, c: int, numbers: Numbers) -> str:
    """Returns a line of text: kind, channel and numbers, "~" for None."""
    return " ".join([kind, str(c), *("~" if v is None else str(v) for v in numbers)])
