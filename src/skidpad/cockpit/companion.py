"""Another run beside the one that is shown, in step with it: its picture, a line of words, its curves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.loop import Moment
from skidpad.cockpit import hud
from skidpad.cockpit.source import Source, curves_beside, index_at
from skidpad.cockpit.studio import FOR_PEOPLE, Looks, Studio, View, plane
from skidpad.cockpit.turn_signals import TurnSignals
from skidpad.core.setup import DT
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra


class Companion:
    """Draws another run at the same time since its begin as the moment it is called with."""

    def __init__(self, source: Source, first: int, looks: Looks = FOR_PEOPLE) -> None:
        """first: the tick with which the other run begins; looks: of the world in its pictures."""
        self.source, self.first = source, first
        self._curves = curves_beside(source)
        self._signals = TurnSignals(source)
        outside = source.seat(0).outside
        self.studio = Studio(source.map, source.table, outside, source.seed, looks=looks)

    def __call__(
        self, moment: Moment, view: View, extras: frozenset[Extra] = ALL_EXTRAS
    ) -> tuple[NDArray[Any], Mapping[str, Any]]:
        """Returns the image of a view of the other run, and what is said beside it."""
        source = self.source
        k = index_at(source, moment.truth.tick - self.first + source.tick(0))
        mine = source.moment(k)
        truth = mine.truth
        self.studio.change(source.seat(k).outside, extras)
        images = self.studio.look(truth, source.crash(k), self._signals.at(truth.tick))
        said = {
            "t": round(truth.tick * DT, 2),
            "speed_kmh": hud.motion(mine)["speed_kmh"],
            "mode": mine.driver.mode,
            "weather": source.seat(k).outside.weather.name,
            "collisions": source.collisions(k),
            "curves": self._curves,
        }
        return np.array(plane(images[view.value])), said
