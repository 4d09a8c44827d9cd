"""Channel frames to protobuf messages and back; every shape is checked on the way in."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Context, Decision, TruthFrame
from skidpad.core.errors import FileError
from skidpad.recording.channels import channels_pb2 as pb

POLYGON_LIMIT = 64  # vertices; a shape with more is not a shape but damage


def message_from_frame(frame: ChannelFrame) -> pb.Channel:
    """Returns a channel's frame as a protobuf message."""
    message = pb.Channel(
        t=frame.t,
        ego=frame.ego.tolist(),
        ego_polygon=frame.ego_polygon.ravel().tolist(),
        plan=frame.plan.ravel().tolist(),
        objects=frame.objects.ravel().tolist(),
        polygon_size=frame.polygon_size.tolist(),
        polygons=_flatten_polygons(frame.polygons, frame.polygon_size),
        predictions=frame.predictions.ravel().tolist(),
        prediction_t=frame.prediction_t.tolist(),
    )
    if np.any(frame.ids >= 0):
        message.ids.extend(frame.ids.tolist())
    if np.any(frame.classes >= 0):
        message.classes.extend(frame.classes.tolist())
    return message


def frame_from_message(message: pb.Channel) -> ChannelFrame:
    """Returns the frame in `message`; FileError when its arrays do not fit together."""
    n = _rows("objects", len(message.objects), 5)
    p = len(message.prediction_t)
    size, polygons = _split_polygons(message.polygon_size, message.polygons, n)
    predictions = _floats(message.predictions)
    if predictions.size != 2 * n * p:
        raise FileError(f"predictions: {predictions.size} numbers, expected {2 * n * p}")
    return ChannelFrame(
        t=message.t,
        ego=_ego(message.ego),
        ego_polygon=_table("ego_polygon", message.ego_polygon, 2),
        plan=_table("plan", message.plan, 3),
        objects=_floats(message.objects).reshape(n, 5),
        polygons=polygons,
        polygon_size=size,
        predictions=predictions.reshape(n, p, 2),
        prediction_t=_floats(message.prediction_t),
        ids=_labels("ids", message.ids, n),
        classes=_labels("classes", message.classes, n),
    )


def message_from_truth(truth: TruthFrame) -> pb.Truth:
    """Returns the true world as a protobuf message."""
    return pb.Truth(
        t=truth.t,
        ego=truth.ego.tolist(),
        ego_polygon=truth.ego_polygon.ravel().tolist(),
        ego_mu=truth.ego_mu,
        actors=truth.actors.ravel().tolist(),
        polygon_size=truth.polygon_size.tolist(),
        polygons=_flatten_polygons(truth.polygons, truth.polygon_size),
        ids=truth.ids.tolist(),
        classes=truth.classes.tolist(),
        mu=truth.mu.tolist(),
    )


def truth_from_message(message: pb.Truth) -> TruthFrame:
    """Returns the true world in `message`; FileError when its arrays do not fit together."""
    n = _rows("actors", len(message.actors), 5)
    size, polygons = _split_polygons(message.polygon_size, message.polygons, n)
    mu = _floats(message.mu)
    if mu.size != n:
        raise FileError(f"mu: {mu.size} numbers, expected {n}")
    return TruthFrame(
        t=message.t,
        ego=_ego(message.ego),
        ego_polygon=_table("ego_polygon", message.ego_polygon, 2),
        ego_mu=message.ego_mu,
        actors=_floats(message.actors).reshape(n, 5),
        polygons=polygons,
        polygon_size=size,
        ids=_labels("ids", message.ids, n),
        classes=_labels("classes", message.classes, n),
        mu=mu,
    )


class MessageKind(NamedTuple):
    """How items of one type are written as protobuf messages and read again."""

    name: str  # of the message
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]


KINDS: dict[type, MessageKind] = {
    ChannelFrame: MessageKind("Channel", message_from_frame, frame_from_message),
    TruthFrame: MessageKind("Truth", message_from_truth, truth_from_message),
    Decision: MessageKind(
        "Decision",
        lambda d: pb.Decision(t=d.t, driving=d.driving, reason=d.reason, scores=list(d.scores)),
        lambda m: Decision(m.t, m.driving, m.reason, tuple(m.scores)),
    ),
    Context: MessageKind(
        "Context",
        lambda c: pb.Context(t=c.t, entries=c.entries),
        lambda m: Context(m.t, dict(sorted(m.entries.items()))),  # a map on the wire has no order
    ),
}


def padded_polygons(shapes: Iterable[Floats]) -> tuple[NDArray[np.int64], Floats]:
    """Returns sizes (n,) and polygons (n, k, 2) padded with NaN, from shapes of (k_i, 2)."""
    rows = list(shapes)
    size = np.array([len(shape) for shape in rows], dtype=np.int64)
    polygons = np.full((len(rows), int(size.max(initial=0)), 2), np.nan)
    for row, shape in zip(polygons, rows, strict=True):
        row[: len(shape)] = shape
    return size, polygons


def _flatten_polygons(polygons: Floats, size: NDArray[np.int64]) -> list[float]:
    """Returns the used vertices of all polygons as one flat list x, y, ..."""
    used = np.arange(polygons.shape[1]) < size[:, None]
    flat: list[float] = polygons[used].ravel().tolist()
    return flat


def _split_polygons(
    size_field: Iterable[int], polygon_field: Iterable[float], n: int
) -> tuple[NDArray[np.int64], Floats]:
    """Returns sizes (n,) and polygons (n, k, 2), nan beyond their size; raises FileError if wrong."""
    size = np.fromiter(size_field, np.int64)
    flat = _floats(polygon_field)
    if size.size != n or flat.size != 2 * int(size.sum()):
        raise FileError(f"polygons: {size.size} sizes and {flat.size} numbers for {n} objects")
    k = int(size.max(initial=0))
    if k > POLYGON_LIMIT:
        raise FileError(f"polygons: {k} vertices, at most {POLYGON_LIMIT} are read")
    polygons = np.full((n, k, 2), np.nan)
    polygons[np.arange(k) < size[:, None]] = flat.reshape(-1, 2)
    return size, polygons


def _floats(values: Iterable[float]) -> Floats:
    """Returns the values as an array of floats."""
    return np.fromiter(values, np.float64)


def _rows(field: str, length: int, width: int) -> int:
    """Returns how many rows of `width` numbers there are; raises FileError for a rest."""
    if length % width:
        raise FileError(f"{field}: {length} numbers are not rows of {width}")
    return length // width


def _table(field: str, values: Iterable[float], width: int) -> Floats:
    """Returns (n, width) the flat values as rows; raises FileError where they do not fill them."""
    flat = _floats(values)
    return flat.reshape(_rows(field, flat.size, width), width)


def _ego(values: Iterable[float]) -> Floats:
    """Returns (5,) the ego's state; raises FileError for another number of values."""
    ego = _floats(values)
    if ego.size != 5:
        raise FileError(f"ego: {ego.size} numbers, expected 5")
    return ego


def _labels(field: str, values: Iterable[int], n: int) -> NDArray[np.int64]:
    """Returns (n,) the labels, -1 each where none are given; raises FileError for another number."""
    labels = np.fromiter(values, np.int64)
    if labels.size == 0:
        return np.full(n, -1, dtype=np.int64)
    if labels.size != n:
        raise FileError(f"{field}: {labels.size} numbers, expected {n} or none")
    return labels
