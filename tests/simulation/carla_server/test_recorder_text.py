"""What the recorder's queries find: contacts by kind, and who stands."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.simulation.carla_server.recording.packets import (
    NO_ACTOR,
    RECORDS,
    Added,
    LogFrame,
    LogHead,
    Packet,
)
from skidpad.simulation.carla_server.recording.recorder_text import list_blocked, list_collisions

HEAD = LogHead(1, 0, "town")
BORN = [
    Added(5, 1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "vehicle.audi.tt", ((4, "role_name", "hero"),)),
    Added(6, 2, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "walker.pedestrian.0001"),
]


def frame(
    number: int, elapsed: float, contacts: list[tuple[int, int]], places: dict[int, float]
) -> LogFrame:
    """A frame with contacts and with actors at x in cm."""
    hits = [(0, a, b, a == 5, b == 5) for a, b in contacts]
    at = [(id, (x, 0.0, 0.0), (0.0, 0.0, 0.0)) for id, x in places.items()]
    records = {Packet.COLLISION: hits, Packet.POSITION: at}
    made = {packet: np.array(rows, RECORDS[packet]) for packet, rows in records.items()}
    return LogFrame(number, 0.5, elapsed, BORN if number == 1 else [], dict(made))


FRAMES = [
    frame(1, 0.0, [], {5: 100.0, 6: 0.0}),
    frame(2, 0.5, [(5, 6), (5, NO_ACTOR)], {5: 150.0, 6: 0.0}),
    frame(3, 1.0, [(5, 6)], {5: 150.0}),
]


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [("a", "a", 2), ("v", "w", 1), ("h", "a", 2), ("w", "v", 0), ("v", "o", 1), ("h", "h", 0)],
)
def test_a_contact_is_listed_once_and_by_kind(first: str, second: str, found: int) -> None:
    text = list_collisions(HEAD, FRAMES, first, second)
    rows = text.split("\n")[5:]
    assert sum("vehicle.audi.tt" in row for row in rows) == found


def test_who_stands_is_blocked_for_as_long_as_it_stands() -> None:
    text = list_blocked(HEAD, FRAMES, seconds=0.5, cm=10.0)
    rows = [row.split() for row in text.split("\n") if "vehicle" in row or "walker" in row]
    assert rows == [["0", "6", "walker.pedestrian.0001", "1"], ["0", "5", "vehicle.audi.tt", "0"],
                    ["0", "5", "vehicle.audi.tt", "0"]]  # fmt: skip
