"""Repeats of one thing within a pause become one event (C-140, C-141)."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

PAUSE = 2.0  # s (C-140)
SAME_TIME = 1e-6  # s, rounding of cycle times
Key = TypeVar("Key", bound=Hashable)


@dataclass(slots=True)
class Event(Generic[Key]):
    """Detections of `key` that belong together."""

    key: Key
    t_start: float  # s
    t_end: float
    count: int
    extreme: float


class TimeFilter(Generic[Key]):
    """Merges detections of the same key whose pause is under `pause` seconds; keys are separate."""

    def __init__(self, pause: float = PAUSE) -> None:
        self.pause = pause
        self.open: dict[Key, Event[Key]] = {}
        self.closed: list[Event[Key]] = []

    def add(self, key: Key, t: float, value: float, least: bool) -> bool:
        """Adds a detection at `t` s, not earlier than the one before; returns True when it begins an event.

        The event keeps the least or the greatest value; NaN is a value that was not there.
        """
        event = self.open.get(key)
        if event is None or t - event.t_end >= self.pause - SAME_TIME:
            if event is not None:
                self.closed.append(event)
            self.open[key] = Event(key, t, t, 1, value)
            return True
        event.t_end = t
        event.count += 1
        harder = value < event.extreme if least else value > event.extreme
        if harder or event.extreme != event.extreme:
            event.extreme = value
        return False

    def advance(self, t: float) -> list[Event[Key]]:
        """Returns the events that no detection at `t` s or later can extend; each is handed out once."""
        for key in [
            k for k, event in self.open.items() if t - event.t_end >= self.pause - SAME_TIME
        ]:
            self.closed.append(self.open.pop(key))
        done, self.closed = self.closed, []
        return done

    def finish(self) -> list[Event[Key]]:
        """Ends and returns all events that were not handed out yet."""
        return self.advance(float("inf"))
