"""The sink that shows a run: the latest moment goes to the feed, and the loop is never held back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.cockpit import hud
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.marks import LightAhead, Lying, Marks, marks_of, patch_marks
from skidpad.cockpit.studio import FOR_PEOPLE, MAIN, Looks, Studio, View
from skidpad.cockpit.words import Link
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.setup import DT
from skidpad.core.states import ActorTable
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.roads.queries import RoadMap
from skidpad.sensors.finish.extras import Extra

MOST_PER_SECOND = 30.0  # pictures, of wall time
TOLD_EVENTS = 40
MARKED = (View.DRIVER, View.FOLLOW)


class Shown(NamedTuple):
    """Holds what a screen is told for a picture: surroundings, and plain data for the page."""

    outside: Outside
    told: Mapping[str, Any]  # goes to the page as it is


BESIDE = "beside"  # the word of the other run's picture
Beside = Callable[[Moment, View, frozenset[Extra]], tuple[Any, Mapping[str, Any]]]


class Screen(Sink):
    """Draws the views that are looked at, once the page has taken the picture before."""

    def __init__(
        self,
        feed: Feed,
        link: Link,
        map: RoadMap,
        ask: Callable[[], Shown],
        seed: int = 0,
        laid: Sequence[LaidSurface] = (),
        looks: Looks = FOR_PEOPLE,
    ) -> None:
        """laid: on parts of the road; looks: of the world in the pictures."""
        self.lying = Lying(map, laid)
        self.feed, self.link, self.map, self.ask, self.seed = feed, link, map, ask, seed
        self.looks = looks
        self.shown = self.dropped = self.collisions = 0
        self.events: deque[tuple[float, str]] = deque(maxlen=TOLD_EVENTS)
        self._at = 0.0
        self.crash: Pose | None = None  # where the ego's last contact was
        self.latest: Callable[[], list[tuple[str, str]]] = list  # of further sensors and functions
        self.signals: Callable[[int], NDArray[np.bool_]] | None = None  # (n, 2) lit in a tick
        self.beside: Beside | None = None  # another run in step with this one

    def begin(self, table: ActorTable) -> None:
        """Builds the scene for these actors as a run begins."""
        outside = self.ask().outside
        self.studio = Studio(self.map, table, outside, self.seed, looks=self.looks)
        self.cameras, self.light = self.studio.suite.cameras, LightAhead(self.map)

    def follow_readings(self, latest: Callable[[], list[tuple[str, str]]]) -> None:
        """Takes a function that gives the latest readings, which are shown beside the pictures."""
        self.latest = latest

    def follow_surface(self, laid: Sequence[LaidSurface]) -> None:
        """Takes what events lay on the road during a live drive; a replay knows it from the begin."""
        self.lying.later = laid

    def see(self, moment: Moment) -> None:
        """Notes a tick's events and shows it, or drops it, as a slow or absent page costs nothing."""
        t = round(moment.truth.tick * DT, 2)
        self.collisions += len(moment.truth.contacts)
        if moment.truth.contacts:
            self.crash = moment.truth.states.pose(0)
        self.events.extend((t, text) for text in hud.list_events(moment))
        if perf_counter() - self._at < 1.0 / MOST_PER_SECOND:
            return
        if self.feed.last_read < self.feed.last:
            self.dropped += self.feed.last_read > 0  # before the first page it is not missed
            return
        self.show(moment)

    def show(self, moment: Moment) -> None:
        """Draws the views of a moment and writes them to the feed."""
        shown, truth = self.ask(), moment.truth
        self.studio.change(shown.outside, self.link.extras)
        turns = None if self.signals is None else self.signals(truth.tick)
        images = self.studio.look(truth, self.crash, turns)
        views = [v for v in View if self._is_wanted(v)]
        planes = {v.value: shown for v, shown in self.studio.draw(images, views).items()}
        if self.beside is not None:
            planes[BESIDE], said = self.beside(moment, self.link.main, self.link.extras)
            shown = Shown(shown.outside, {**shown.told, BESIDE: said})
        self.shown += 1
        self._at = perf_counter()
        self.feed.write_picture(msgspec.json.encode(self._describe_moment(moment, shown)), planes)

    def _is_wanted(self, view: View) -> bool:
        """Returns True for the main view and all small ones that are not hidden."""
        if view is self.link.main:
            return True
        return view not in self.link.hidden and (view not in MAIN or view is View.TOP)

    def _describe_moment(self, moment: Moment, shown: Shown) -> dict[str, Any]:
        """Returns what the page is told of a moment: motion, stack, radar, marks, events and views."""
        frame, marks = moment.frame, {}
        ego = moment.truth.states.pose(0)
        for view in {self.link.main, View.TOP} & {*MARKED, View.TOP}:
            camera = self.cameras[view.value]
            patches = patch_marks(camera, self.lying.outlines(frame.tick), ego)
            if view in MARKED:
                light = self.light.mark(camera, moment)
                seen = marks_of(camera, frame.radar, moment.report, light)
            elif patches:
                seen = Marks([], None, "")
            else:
                continue
            marks[camera.id] = seen._replace(patches=patches)
        return {
            "tick": frame.tick,
            "t": round(frame.tick * DT, 2),
            "motion": hud.motion(moment),
            "stack": hud.opinion(moment),
            "radar": hud.radar(moment),
            "marks": marks,
            "main": self.link.main.value,
            "hidden": sorted(v.value for v in self.link.hidden),
            "extras": sorted(e.value for e in self.link.extras),
            "events": list(self.events),
            "collisions": self.collisions,
            "shown": self.shown,
            "dropped": self.dropped,
            "added": self.latest(),
            **shown.told,
        }
