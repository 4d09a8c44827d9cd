"""A stored run as a producer: the same screen, with a time that goes in any direction."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from time import perf_counter
from typing import Any

from skidpad.cockpit import hud
from skidpad.cockpit.again import drive_again
from skidpad.cockpit.companion import Companion
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.film import write_film
from skidpad.cockpit.opening import open_source
from skidpad.cockpit.screen import Screen, Shown
from skidpad.cockpit.source import Source, index_at, opening_tick
from skidpad.cockpit.studio import FOR_PEOPLE, MAIN, Looks, View
from skidpad.cockpit.turn_signals import TurnSignals
from skidpad.cockpit.words import Link
from skidpad.core.errors import OutputError, SkidpadError
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Bodywork, Quality, Scenery
from skidpad.recording.run.surfaces import read_surfaces

PATIENCE = 0.02  # s between two looks at the words
FILMS = "films"  # folder within the run's
FASTEST = 10.0  # times real time, when no rate is given
TAKES_WITHIN = 0.25  # s that the page is given to take a picture before the next is drawn anyway


def replay_job(feed_name: str, pipe: Connection, about: dict[str, Any]) -> str:
    """Shows a run, perhaps with another one beside it, until the page ends it; returns a sentence."""
    source = open_source(Path(about["path"]), about["hazard"])
    other = None if about["beside"] is None else open_source(Path(about["beside"]))
    feed, link = Feed(feed_name), Link(pipe)
    try:
        replayer = Replayer(
            source,
            feed,
            link,
            other=other,
            looks=Looks(
                Scenery(about["scenery"]), Bodywork(about["bodywork"]), Quality(about["quality"])
            ),
        )
        link.seek = opening_tick(source) if about["at"] is None else round(about["at"] / DT)
        replayer.run()
    finally:
        feed.close()
    return f"replayed {about['path']}"


class Replayer:
    """Plays a source to the page: keeps the moment that is shown, and when that was."""

    def __init__(
        self, source: Source, feed: Feed, link: Link,
        clock: Callable[[], float] = perf_counter, other: Source | None = None,
        looks: Looks = FOR_PEOPLE,
    ) -> None:  # fmt: skip
        """other: a run that is shown beside this one, at the same time since its begin.

        looks: of the world in the pictures of both.
        """
        self.looks = looks
        self.source, self.link, self.clock, self.other = source, link, clock, other
        self.k = 0
        self.note = ""  # what the page is told beside everything else
        self.dt = source.step * DT
        laid = read_surfaces(source.folder)
        self.screen = Screen(
            feed, link, source.map, self._describe_moment, source.seed, laid, looks
        )
        self.screen.signals = TurnSignals(source).at
        self.screen.begin(source.table)
        if other is not None:
            self.screen.beside = Companion(other, source.tick(0), looks)
        self._base, self._since, self._rate = 0, clock(), 1.0  # moment from which it plays, ...
        self._shown_k, self._shown_at = -1, 0.0

    def run(self) -> None:
        """Shows the replay until the page ends it; time stands until a page has taken a picture."""
        self.turn()
        self.show()
        while self.screen.feed.last_read == 0 and not self.link.ended:
            self.link.drain(PATIENCE)
        self._from(self.k)
        while not self.link.ended:
            heard = self.link.drain(PATIENCE)
            if self.link.film is not None:
                self._film(self.link.film)
            if self.link.again is not None:
                self._drive_again(self.link.again)
            self.turn()
            if heard or (self.k != self._shown_k and self._is_taken()):
                self.show()

    def turn(self) -> None:
        """Goes to the moment that the clock has reached, or that the page asked for."""
        link, last = self.link, self.source.ticks - 1
        if link.seek is not None:
            self._from(index_at(self.source, link.seek))
            link.seek = None
        elif link.paused:
            self._from(min(self.k + link.steps, last))
            link.steps = 0
        else:
            rate = link.rate if link.rate > 0.0 else FASTEST
            if rate != self._rate:
                self._from(self.k)
                self._rate = rate
            done = int((self.clock() - self._since) * rate / self.dt)
            self.k = min(self._base + done, last)

    def _film(self, seconds: float) -> None:
        """Writes a film of so many s from here on, beside the run; the page waits and is told the path."""
        self.link.film = None
        source = self.source
        last = min(self.k + max(round(seconds / self.dt), 1), source.ticks - 1)
        view = self.link.main if self.link.main in MAIN else View.FOLLOW
        t = source.tick(self.k) * DT
        path = source.folder / FILMS / f"{view.value}-{t:07.2f}s.mp4"
        try:
            write_film(source, range(self.k, last + 1), view, path, self.other, self.looks)
            self.note = f"film: {path}"
        except OutputError as error:
            self.note = str(error)
        self._from(self.k)

    def _drive_again(self, change: str) -> None:
        """Drives the run with one thing changed and shows both from the opening on; the page waits."""
        self.link.again = None
        self.note = "driving it again, please wait ..."
        self.show()
        try:
            self.other = drive_again(self.source, change)
            self.screen.beside = Companion(self.other, self.source.tick(0), self.looks)
            self.note = f"beside it: {self.other.folder}"
        except SkidpadError as error:
            self.note = str(error)
        self._from(index_at(self.source, opening_tick(self.source)))
        self.show()

    def _is_taken(self) -> bool:
        """Returns True when the page has the last picture, or takes longer than TAKES_WITHIN s."""
        feed = self.screen.feed
        return feed.last_read >= feed.last or self.clock() - self._shown_at > TAKES_WITHIN

    def _from(self, k: int) -> None:
        """Goes on from moment `k`, at the present time."""
        self.k = self._base = k
        self._since = self.clock()

    def show(self) -> None:
        """Shows the picture of the present moment."""
        self.screen.crash = self.source.crash(self.k)
        self.screen.show(self.source.moment(self.k))
        self._shown_k, self._shown_at = self.k, self.clock()

    def _describe_moment(self) -> Shown:
        """Returns what is outside at the present moment and what the page is told of it."""
        seat, link = self.source.seat(self.k), self.link
        told = {
            "kind": "replay",
            "seat": {
                **hud.seat(seat.outside, seat.manual, seat.method, seat.lamps),
                "functions": None
                if seat.functions is None
                else sorted(f.value for f in seat.functions),
            },
            "rate": link.rate,
            "paused": link.paused,
            "note": self.note,
            "events": self._events(),
            "collisions": self.source.collisions(self.k),
            "added": self.source.readings(self.k),
        }
        return Shown(seat.outside, told)

    def _events(self) -> list[tuple[float, str]]:
        """Returns the last twelve marks up to this moment: time in s and text."""
        tick = self.source.tick(self.k)
        marks = [e for e in self.source.marks if e[0] <= tick]
        return [(round(t * DT, 2), text) for t, _, text in marks[-12:]]
