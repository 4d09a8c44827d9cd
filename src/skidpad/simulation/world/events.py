"""What happened in the last step of a world, as its ground truth tells it."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.states import ContactEvent, LaneInvasion, TrafficContact


@dataclass(slots=True)
class StepEvents:
    """Contacts, lane invasions, and the rows of vehicles that were put elsewhere or fell over."""

    contacts: tuple[ContactEvent, ...] = ()  # of the ego, that began in this step
    background: tuple[TrafficContact, ...] = ()  # of all others, that began in this step
    invasions: tuple[LaneInvasion, ...] = ()
    put_back: tuple[int, ...] = ()  # stuck or astray
    moved_on: tuple[int, ...] = ()  # from afar to near the ego
    rolled: tuple[int, ...] = ()  # that came to lie on their side in this step
    notices: tuple[str, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether nothing happened of which a log or a driver's supervisor is told."""
        return not (
            self.contacts
            or self.background
            or self.invasions
            or self.put_back
            or self.moved_on
            or self.rolled
            or self.notices
        )
