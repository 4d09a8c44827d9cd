"""How elements of a storyboard live: their states, transitions, and what of them is noted."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

Path = tuple[str, ...]


class State(str, Enum):
    """Life of a storyboard element."""

    STANDBY = "standbyState"
    RUNNING = "runningState"
    COMPLETE = "completeState"


class Move(str, Enum):
    """How a storyboard element changes its state."""

    START = "startTransition"
    END = "endTransition"
    STOP = "stopTransition"
    SKIP = "skipTransition"


@dataclass(frozen=True, slots=True)
class Happening:
    """Something of the storyboard that happened at t, s: a transition, or what a condition says."""

    t: float
    path: Path
    what: str
