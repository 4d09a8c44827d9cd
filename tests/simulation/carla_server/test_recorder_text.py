"""What the recorder's calls print is what CARLA prints, so that programs can read it."""

from __future__ import annotations

import re

import pytest

from skidpad.simulation.carla_server.recording.recorder_text import (
    describe_recording,
    list_blocked,
    list_collisions,
)

HEAD = {"map": "town", "date": "11/25/26 10:00:00"}
TURN = [1.0, 90.0, 2.0]  # pitch, yaw, roll
TICKS = [
    [7, 10.0, [[5, [1.0, 2.0, 3.0], TURN], [6, [0.0, 0.0, 0.0], TURN]], [],
     [[5, "vehicle.audi.tt", {"role_name": "hero"}], [6, "walker.pedestrian.0001", {}]],
     [[5, 0.25, 0.5, 0.0, 0, 2]]],
    [8, 10.5, [[5, [1.5, 2.0, 3.0], TURN], [6, [0.0, 0.0, 0.0], TURN]], [[5, 6], [5, 0]], [],
     [[5, 0.0, 0.0, 1.0, 1, -1]]],
    [9, 11.0, [[5, [1.5, 2.0, 3.0], TURN]], [[5, 6]], [], [[5, 0.0, 0.0, 1.0, 1, -1]]],
]  # fmt: skip

# by hand, from the wording of CarlaRecorderQuery.cpp
EVENTS = """Version: 1
Map: town
Date: 11/25/26 10:00:00

Frame 1 at 0 seconds
 Create 5: vehicle.audi.tt (1) at (100, 200, 300)
  role_name = hero
 Create 6: walker.pedestrian.0001 (2) at (0, 0, 0)
Frame 2 at 0.5 seconds
 Collision id 0 between 5 (hero)  with 6
 Collision id 1 between 5 (hero)  with 4294967295
Frame 3 at 1 seconds
 Destroy 6
 Collision id 0 between 5 (hero)  with 6

Frames: 3
Duration: 1 seconds
"""


def test_events_are_printed_in_carlas_words() -> None:
    assert describe_recording(HEAD, TICKS, 10.0, show_all=False) == EVENTS


def test_every_frame_has_places_in_cm_and_controls() -> None:
    text = describe_recording(HEAD, TICKS, 10.0, show_all=True)
    assert "  Id: 5 Location: (150, 200, 300) Rotation (2, 1, 90)\n" in text
    assert "  Id: 5 Steering: 0.25 Throttle: 0.5 Brake 0 Handbrake: 0 Gear: 2\n" in text
    assert re.findall(r"^Frame (\d+) at", text, re.MULTILINE) == ["1", "2", "3"]
    # ScenarioRunner's parser takes steer, throttle, brake, handbrake and gear from these words
    words = next(row for row in text.split("\n") if "Steering" in row)[2:].split(" ")
    assert [words[k] for k in (1, 3, 5, 7, 9, 11)] == ["5", "0.25", "0.5", "0", "0", "2"]


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [("a", "a", 2), ("v", "w", 1), ("h", "a", 2), ("w", "v", 0), ("v", "o", 1), ("h", "h", 0)],
)
def test_a_contact_is_listed_once_and_by_kind(first: str, second: str, found: int) -> None:
    text = list_collisions(HEAD, TICKS, 10.0, first, second)
    rows = text.split("\n")[5:]
    assert sum("vehicle.audi.tt" in row for row in rows) == found


def test_who_stands_is_blocked_for_as_long_as_it_stands() -> None:
    text = list_blocked(HEAD, TICKS, 10.0, seconds=0.5, cm=10.0)
    rows = [row.split() for row in text.split("\n") if "vehicle" in row or "walker" in row]
    assert rows == [["0", "6", "walker.pedestrian.0001", "1"], ["0", "5", "vehicle.audi.tt", "0"],
                    ["0", "5", "vehicle.audi.tt", "0"]]  # fmt: skip
