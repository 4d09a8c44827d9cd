"""Messages of the page to the producer of its pictures, and the state that they lead to."""

from __future__ import annotations

from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import msgspec
from msgspec import Struct

from skidpad.cockpit.studio import View
from skidpad.core.errors import require_range
from skidpad.core.inputs import Crowd, Functions, Input, Lamps, LampSwitch, Pedals, Sky
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra

RATES = (0.1, 20.0)  # times real time


class Do(Struct, frozen=True, tag="do"):
    """The person does something in the drive."""

    input: Input


class Pace(Struct, frozen=True, tag="pace"):
    """How fast it goes on: times real time; 0: as fast as it can."""

    rate: float = 1.0

    def __post_init__(self) -> None:
        if self.rate:
            require_range("rate", self.rate, *RATES)


class Pause(Struct, frozen=True, tag="pause"):
    """Pauses the drive, or lets it go on."""

    on: bool


class Step(Struct, frozen=True, tag="step"):
    """Asks for some ticks more while the replay stands."""

    ticks: int = 1


class Seek(Struct, frozen=True, tag="seek"):
    """Asks for a tick of the replay."""

    tick: int


class Show(Struct, frozen=True, tag="show"):
    """Which view fills the page, and which are hidden to save time (A-271)."""

    main: View
    hidden: tuple[View, ...] = ()
    extras: tuple[Extra, ...] = tuple(
        sorted(Extra)
    )  # additions for people; none: the plain picture


class Film(Struct, frozen=True, tag="film"):
    """Write a film of so many seconds from here on."""

    seconds: float = 10.0


class Again(Struct, frozen=True, tag="again"):
    """Drive the run once more with one thing changed, and show that beside it."""

    change: str


class End(Struct, frozen=True, tag="end"):
    """Ends the drive or the replay."""


Word = Do | Pace | Pause | Step | Seek | Show | Film | Again | End


def encode(word: Word) -> bytes:
    """Encodes a word for the pipe."""
    return msgspec.json.encode(word)


class Link:
    """Holds the producer's end of the pipe and the state that the page's words have set so far."""

    def __init__(self, pipe: Connection | None) -> None:
        """pipe: None: no message ever comes."""
        self.pipe = pipe
        self.inputs: list[Input] = []
        self.rate = 1.0
        self.paused = self.ended = False
        self.steps = 0
        self.seek: int | None = None
        self.film: float | None = None  # s of a film that is to be written
        self.again: str | None = None  # a change with which the run is to be driven again
        self.main, self.hidden = View.DRIVER, frozenset[View]()
        self.extras = ALL_EXTRAS
        self.reshown = False  # another view is asked for

    def drain(self, patience: float = 0.0) -> bool:
        """Takes the words that came; waits at most `patience` s for a first. True: there was one.

        When the page's process has ended, `ended` is set.
        """
        if self.pipe is None:
            return False
        heard = False
        try:
            while self.pipe.poll(0.0 if heard else patience):
                self._take(msgspec.json.decode(self.pipe.recv_bytes(), type=Word))
                heard = True
        except (EOFError, OSError):  # the page's process has ended: so does the drive
            self.ended, self.pipe = True, None
        return heard

    def _take(self, word: Word) -> None:
        """Takes over one word of the page into the state of the link."""
        match word:
            case Do():
                self.inputs.append(word.input)
            case Pace():
                self.rate = word.rate
            case Pause():
                self.paused, self.steps = word.on, 0
            case Step():
                self.steps += max(word.ticks, 0)
            case Seek():
                self.seek = word.tick
            case Film():
                self.film = word.seconds
            case Again():
                self.again = word.change
            case Show():
                self.main, self.hidden = word.main, frozenset(word.hidden)
                self.extras = frozenset(word.extras)
                self.reshown = True
            case End():
                self.ended = True


class Live:
    """Gives a person's inputs as they come; of a kind where the last one counts, one per tick."""

    def __init__(self, link: Link) -> None:
        self.link = link
        link.inputs.insert(0, Lamps(LampSwitch.AUTO))

    @property
    def ended(self) -> bool:
        """Returns True when the person, or the page's process, has ended the drive."""
        return self.link.ended

    def at(self, tick: int) -> Sequence[Input]:
        """Returns what was done since the last call, whatever the tick."""
        del tick
        self.link.drain()
        inputs, self.link.inputs = self.link.inputs, []
        return drop_void_inputs(inputs)


LAST_COUNTS = (Pedals, Sky, Lamps, Functions, Crowd)


def drop_void_inputs(inputs: Sequence[Input]) -> list[Input]:
    """Returns the inputs without those that a later one of the same kind makes void."""
    kept: list[Any] = []
    for one in inputs:
        if isinstance(one, LAST_COUNTS):
            kept = [other for other in kept if type(other) is not type(one)]
        kept.append(one)
    return kept
