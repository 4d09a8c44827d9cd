"""Reads worlds of channels back from lines of text; see `text.py` for the lines."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.errors import FileError
from skidpad.recording.channels.codec import padded_polygons
from skidpad.recording.hazards.text import NUMBER_LIMIT, Channel, Numbers, Object, Pose, moved_on

LINE_LIMIT = 2_000_000  # characters
CYCLE_LIMIT = 10_000
ID_LIMIT = 2**63  # identities are the largest numbers of the format


def decode_worlds(lines: Iterable[str], n_channels: int) -> tuple[Cycle, ...]:
    """Returns the worlds of lines of `encode_worlds`; FileError gives the number of a faulty line.

    The first line counts as line 2, since a head line comes before it in a record.
    """
    decoder = _Decoder(n_channels)
    for number, line in enumerate(lines, start=2):
        try:
            if len(line) > LINE_LIMIT:
                raise FileError(f"is longer than {LINE_LIMIT} characters")
            decoder.line(line)
        except (FileError, ValueError, IndexError, KeyError) as error:
            raise FileError(f"line {number} of the record: {error}") from error
    return decoder.finish()


@dataclass(slots=True)
class _Draft:
    """A frame while its lines are read."""

    t: int  # ms
    ego: Pose
    slots: list[int] = field(default_factory=list)
    plan: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    predictions: dict[int, Floats] = field(default_factory=dict)


class _Decoder:
    """Reads lines one by one."""

    def __init__(self, n_channels: int) -> None:
        self.channels = [Channel() for _ in range(n_channels)]
        self.cycles: list[Cycle] = []
        self.now: int | None = None
        self.drafts: dict[int, _Draft] = {}

    def line(self, line: str) -> None:
        """Takes in one line; raises FileError where it does not fit."""
        kind, *tokens = line.split(" ")
        numbers = [_number(token) for token in tokens if token]
        if kind == "W":
            self._end_cycle()
            if len(self.cycles) >= CYCLE_LIMIT:
                raise FileError(f"a record holds at most {CYCLE_LIMIT} cycles")
            (step,) = numbers
            self.now = (self.now or 0) + _whole(step)
            return
        if self.now is None:
            raise FileError("a cycle must begin with a line W")
        c = _whole(numbers.pop(0))
        if not 0 <= c < len(self.channels):
            raise FileError(f"channel {c} is not one of {len(self.channels)}")
        self._channel_line(kind, c, numbers)

    def _channel_line(self, kind: str, c: int, numbers: Numbers) -> None:
        """Takes in the numbers of one kind of line of channel `c`."""
        channel = self.channels[c]
        if kind == "E":
            channel.ego_shape = _even(numbers)
        elif kind == "F":
            self._ego(c, channel, numbers)
        elif kind == "S":
            self._object(channel, numbers)
        elif kind == "O":
            self._objects(c, channel, numbers)
        elif kind == "L":
            self._plan(c, numbers)
        elif kind == "T":
            channel.times = numbers
        elif kind == "Q":
            self._prediction(c, channel, numbers)
        else:
            raise FileError(f"unknown kind {kind[:20]!r}")

    def _ego(self, c: int, channel: Channel, numbers: Numbers) -> None:
        """Moves the channel's ego on and begins its draft of this cycle."""
        age, *pose = numbers
        if len(pose) != 5 or self.now is None:
            raise FileError("an ego has an age and five numbers")
        self.dt = self.now - channel.seen_at
        channel.ego = _sums(pose, moved_on(channel.ego, self.dt))
        channel.seen_at = self.now
        self.drafts[c] = _Draft(self.now - _whole(age), channel.ego)

    def _object(self, channel: Channel, numbers: Numbers) -> None:
        """Keeps shape, id and label of the object in a slot."""
        slot, id_, label = (_whole(v) for v in numbers[:3])
        known = channel.slots.get(slot)
        pose: Pose = known.pose if known else [0] * 5
        channel.slots[slot] = Object(id_, label, _even(numbers[3:]), pose)

    def _objects(self, c: int, channel: Channel, numbers: Numbers) -> None:
        """Moves the listed objects on and adds them to the channel's draft."""
        if len(numbers) % 6:
            raise FileError("objects have six numbers each")
        draft = self.drafts[c]
        for i in range(0, len(numbers), 6):
            slot = _whole(numbers[i])
            known = channel.slots[slot]
            known.pose = _sums(numbers[i + 1 : i + 6], moved_on(known.pose, self.dt))
            draft.slots.append(slot)

    def _plan(self, c: int, numbers: Numbers) -> None:
        """Keeps the plan of the channel's draft, (n, 3) x, y in m and time in s."""
        if len(numbers) % 3:
            raise FileError("a plan has three numbers per point")
        t, x, y = (_sum_differences(numbers[k::3]) for k in range(3))
        self.drafts[c].plan = np.column_stack(
            [_metric(x, 100), _metric(y, 100), _metric(t, 1000)]
        ).reshape(-1, 3)

    def _prediction(self, c: int, channel: Channel, numbers: Numbers) -> None:
        """Keeps the prediction of a slot, (p, 2) in m, missing points straight on."""
        slot, p = _whole(numbers[0]), len(channel.times)
        path = numbers[1:]
        if len(path) > 2 * p or len(path) % 2:
            raise FileError(f"a prediction has at most {p} points")
        path += [0] * (2 * p - len(path))
        pose = channel.slots[slot].pose
        self.drafts[c].predictions[slot] = np.column_stack(
            [
                _metric(_sum_differences(path[0::2], pose[0]), 100),
                _metric(_sum_differences(path[1::2], pose[1]), 100),
            ]
        )

    def _end_cycle(self) -> None:
        """Ends the cycle begun before, if any, with the frames drafted."""
        if self.now is None:
            return
        frames = tuple(
            self._frame(channel, self.drafts[c]) if c in self.drafts else None
            for c, channel in enumerate(self.channels)
        )
        self.cycles.append(Cycle(len(self.cycles), self.now / 1000, frames))
        self.drafts = {}

    def _frame(self, channel: Channel, draft: _Draft) -> ChannelFrame:
        """Returns the channel's frame from its draft, in m, s and rad."""
        known = [channel.slots[slot] for slot in draft.slots]
        size, polygons = padded_polygons(_metric(o.shape, 100).reshape(-1, 2) for o in known)
        times = _metric(channel.times, 1000) if draft.predictions else np.zeros(0)
        predictions = np.full((len(known), len(times), 2), np.nan)
        for i, slot in enumerate(draft.slots):
            if slot in draft.predictions:
                predictions[i] = draft.predictions[slot]
        return ChannelFrame(
            t=draft.t / 1000,
            ego=_state(draft.ego),
            ego_polygon=_metric(channel.ego_shape, 100).reshape(-1, 2),
            plan=draft.plan,
            objects=np.array([_state(o.pose) for o in known]).reshape(-1, 5),
            polygons=polygons,
            polygon_size=size,
            predictions=predictions,
            prediction_t=times,
            ids=np.array([o.id for o in known], dtype=np.int64),
            classes=np.array([o.label for o in known], dtype=np.int64),
        )

    def finish(self) -> tuple[Cycle, ...]:
        """Returns all cycles that were read."""
        self._end_cycle()
        return tuple(self.cycles)


def _sums(values: Numbers, base: Numbers) -> Numbers:
    """Returns the values plus the base, None where a value is absent."""
    return [None if v is None else v + (b or 0) for v, b in zip(values, base, strict=True)]


def _sum_differences(values: Numbers, before: int | None = None) -> Numbers:
    """Returns the values whose `_curvature` these are."""
    out: Numbers = []
    last, step = before or 0, 0
    for i, v in enumerate(values):
        if v is None:
            out.append(None)
            continue
        value = v + last + step
        if abs(value) > NUMBER_LIMIT:
            raise FileError("a path leaves the range of numbers")
        step = value - last if i > 0 or before is not None else 0
        last = value
        out.append(value)
    return out


def _number(token: str) -> int | None:
    """Returns the token's integer, None for "~", which stands for an absent number."""
    if token == "~":
        return None
    if len(token) > 20:
        raise FileError(f"the number {token[:20]!r} is too long")
    value = int(token)
    if abs(value) >= ID_LIMIT:
        raise FileError(f"the number {token!r} is out of range")
    return value


def _whole(value: int | None) -> int:
    """Returns the number; raises FileError where it is absent."""
    if value is None:
        raise FileError("a count or time is missing")
    return value


def _even(numbers: Numbers) -> Numbers:
    """Returns the numbers of a shape; raises FileError unless they are at most 64 pairs."""
    if len(numbers) % 2 or len(numbers) > 128:
        raise FileError("a shape has at most 64 vertices of x and y")
    return numbers


def _metric(numbers: Numbers, scale: int) -> Floats:
    """Returns the numbers divided by the scale, nan where absent."""
    return np.array([np.nan if v is None else v / scale for v in numbers], dtype=np.float64)


def _state(pose: Pose) -> Floats:
    """Returns (5,) x, y in m, heading in rad and velocity in m/s, nan where absent."""
    x, y, heading, vx, vy = pose
    scaled = _metric([x, y, vx, vy], 100)
    angle = np.nan if heading is None else heading / 1000
    return np.array([scaled[0], scaled[1], angle, scaled[2], scaled[3]])
