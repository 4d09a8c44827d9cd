"""The indicators of two channels together, and what they remember (C-050 to C-060, C-070 to C-079)."""

from __future__ import annotations

from collections import deque
from math import isfinite

import numpy as np

from skidpad.core.arrays import Ints
from skidpad.core.channels import ChannelFrame
from skidpad.evidence.channels.indicators import prediction, similarity
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.indicators.channel import (
    NAN,
    SAME_CYCLE,
    ChannelIndicators,
    Values,
    nearest,
)
from skidpad.evidence.channels.indicators.settings import IndicatorSettings

SHIFT_SHORT = 0.5  # s, decision C-6
SHIFT_LONG = 10.0  # s
AGREEING = (  # their mean is the agreement of two channels
    Indicator.EGO_LOCATION,
    Indicator.EGO_ORIENTATION,
    Indicator.OBJECT_COUNT,
    Indicator.OBJECT_LOCATION,
    Indicator.OBJECT_ORIENTATION,
    Indicator.OBJECT_AREA,
    Indicator.OBJECT_TRAJECTORY,
    Indicator.EGO_TRAJECTORY,
    Indicator.CROSS_PATH,
)


class PairIndicators:
    """Two channels, cycle by cycle: `similarity` then `prediction`, or `silent` when one is."""

    def __init__(
        self, a: ChannelIndicators, b: ChannelIndicators, settings: IndicatorSettings
    ) -> None:
        self.a, self.b, self.settings = a, b, settings
        self.matched: Ints | None = None  # rows (k, 2) of the objects that both report
        window = similarity.VARIANCE_WINDOW
        self._locations = deque([NAN] * window, window)
        self._paths = deque([NAN] * window, window)
        self._offsets: deque[tuple[float, float, float]] = deque()  # t, b to a in m

    def silent(self) -> None:
        """Notes a cycle in which a channel said nothing: no matches; variances are nan until refilled."""
        self.matched = None
        self._locations.append(NAN)
        self._paths.append(NAN)

    def similarity(self, a: ChannelFrame, b: ChannelFrame) -> Values:
        """Returns agreement of ego poses and objects now; keeps the matched objects for `prediction`."""
        self.matched = similarity.match_points(a.objects, b.objects, self.settings.pairing_distance)
        location, orientation, area = similarity.object_similarity(
            a.objects, self.a.areas, b.objects, self.b.areas, self.matched
        )
        return {
            **self._ego(a, b),
            Indicator.OBJECT_COUNT: similarity.count_similarity(self.a.reported, self.b.reported),
            Indicator.OBJECT_LOCATION: location,
            Indicator.OBJECT_ORIENTATION: orientation,
            Indicator.OBJECT_AREA: area,
            Indicator.CLASS_AGREEMENT: similarity.class_agreement(
                a.classes, b.classes, self.matched
            ),
        }

    def _ego(self, a: ChannelFrame, b: ChannelFrame) -> Values:
        """Returns the values of the ego's location, orientation and shift between both channels."""
        score = similarity.location_similarity(a.ego, b.ego)
        self._locations.append(score)
        t = max(a.t, b.t)
        dx, dy = (a.ego[:2] - b.ego[:2]).tolist()
        if isfinite(dx + dy):
            self._offsets.append((t, dx, dy))
        while self._offsets and not t - SHIFT_LONG - SAME_CYCLE <= self._offsets[0][0] <= t:
            self._offsets.popleft()
        return {
            Indicator.EGO_LOCATION: score,
            Indicator.EGO_LOCATION_VARIANCE: similarity.sample_variance(np.array(self._locations)),
            Indicator.EGO_ORIENTATION: similarity.angle_similarity(
                float(a.ego[2]), float(b.ego[2])
            ),
            Indicator.EGO_SHIFT_SHORT: self._shift(t - SHIFT_SHORT, dx, dy),
            Indicator.EGO_SHIFT_LONG: self._shift(t - SHIFT_LONG, dx, dy),
        }

    def _shift(self, since: float, dx: float, dy: float) -> float:
        """Returns by how many m the channels' places have moved apart since that time; nan where unknown.

        since: s; dx, dy: m from b to a now.
        """
        earlier = nearest(self._offsets, since)
        return NAN if earlier is None else float(np.hypot(dx - earlier[1], dy - earlier[2]))

    def prediction(self, similar: Values) -> Values:
        """Returns the agreement of both channels' plans and predictions, its variance, and the mean.

        Call it once per cycle, after `similarity`, whose result is `similar`: the variance is that of
        the plans' agreement over all cycles so far. The mean is over AGREEING, `similar` included. What
        is unknown is NaN and left out of the mean, which is NaN if nothing is known.
        """
        assert self.matched is not None
        a, b, decay = self.a, self.b, self.settings.decay
        m = min(a.inside, b.inside)
        path = prediction.cross_channel_agreement(a.ways[:m], b.ways[:m])
        self._paths.append(path)
        values = {
            Indicator.OBJECT_TRAJECTORY: prediction.object_trajectory_similarity(
                a.object_ways, a.object_inside, b.object_ways, b.object_inside, self.matched, decay
            ),
            Indicator.EGO_TRAJECTORY: prediction.trajectory_similarity(
                a.ways[:m], b.ways[:m], decay
            ),
            Indicator.CROSS_PATH: path,
            Indicator.CROSS_PATH_VARIANCE: similarity.sample_variance(np.array(self._paths)),
        }
        every = {**similar, **values}
        known = [every[i] for i in AGREEING if isfinite(every[i])]
        values[Indicator.AGREEMENT] = float(np.mean(known)) if known else NAN
        return values
