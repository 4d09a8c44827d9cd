"""What a stored log must be before it is computed with: parts that fit, numbers that are some."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import DetectionStatus, LightSource, LightState, Supervision, Tier
from skidpad.recording.run.log import RunLog

WORDS: dict[str, type[IntEnum]] = {  # fields of the stack's report that are numbers of words
    "status": DetectionStatus,
    "tier": Tier,
    "light_state": LightState,
    "light_source": LightSource,
    "hsv": LightState,
}


def require_sound(log: RunLog) -> None:
    """ValueError that says what of a log cannot be."""
    _require_indices(log)
    _require_numbers(log)
    _require_words(log)


def _require_indices(log: RunLog) -> None:
    """ValueError unless ticks rise and what counts something points into it."""
    n = len(log.table)
    if (np.diff(log.tick) <= 0).any() or (log.tick < 0).any():
        raise ValueError("ticks must rise")
    if len(log) and (int(log.weather.min()) < 0 or int(log.weather.max()) >= len(log.weathers)):
        raise ValueError("weather is none of its weathers")
    if not set(log.supervision.tolist()) <= set(Supervision):
        raise ValueError("supervision is no phase")
    if not n or not 0.0 < log.header.dt < 10.0:
        raise ValueError("there must be an ego and a time step")
    if any(not -1 <= e.actor < n for e in log.events if isinstance(e, ContactEvent)):
        raise ValueError("a contact with an actor that is not there")


def _require_numbers(log: RunLog) -> None:
    """Raises ValueError unless the ego and all present actors have finite places."""
    here = log.present.copy()
    here[:, 0] = True
    if not all(np.isfinite(values[here]).all() for values in log.actors):
        raise ValueError("whoever is present needs a place and a motion in numbers")
    if not all(np.isfinite(values).all() for values in log.ego):
        raise ValueError("what the ego says of itself must be numbers")


def _require_words(log: RunLog) -> None:
    """ValueError for a number that stands for no word."""
    for name, words in WORDS.items():
        values = getattr(log.report, name)
        if not np.isin(values[~np.isnan(values)], list(words)).all():
            raise ValueError(f"{name} of the stack is none of its words")
