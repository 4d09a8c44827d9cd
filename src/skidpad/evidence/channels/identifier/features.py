"""What a learned identifier sees: the past 5 s of indicators and of the risk matrix (decision C-15).

No route, weather, position, time or truth is among it, and the number of channels does not change
its length. NaN stands for what was not evaluated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel
from skidpad.evidence.channels.hazards import Signal, SignalReadings
from skidpad.evidence.channels.indicators.catalogue import (
    CHANNEL_INDICATORS,
    PAIR_INDICATORS,
    Indicator,
)
from skidpad.evidence.channels.indicators.layout import IndicatorReadings
from skidpad.evidence.channels.risk import RiskMatrix

WINDOW = 5.0  # s
SHORT = 1.0  # s
CAPACITY = 51  # cycles of 0.1 s in the window, both ends
SAME_TIME = 1e-6  # s
NO_CONFLICT = 10.0  # s, stands for no time to collision; beyond the horizon of the risk
GREATEST = frozenset(
    {
        Indicator.EGO_LOCATION_VARIANCE,
        Indicator.EGO_SHIFT_SHORT,
        Indicator.EGO_SHIFT_LONG,
        Indicator.CROSS_PATH_VARIANCE,
    }
)  # of these the greatest over pairs counts, of all others the least
RISKS = (
    "ahead_greatest", "ahead_least", "behind_greatest", "behind_least", "ttc", "pet",
    "ttc_ahead", "ttc_behind",
)  # fmt: skip
OVER_TIME = ("now", "mean_1s", "least_5s", "greatest_5s")
ROW_NAMES = (
    *(f"{i.value}_least" for i in CHANNEL_INDICATORS),
    *(f"{i.value}_greatest" for i in CHANNEL_INDICATORS),
    *(i.value for i in PAIR_INDICATORS),
    *(f"risk_{name}" for name in RISKS),
    "gap_signed",
)
FEATURE_NAMES = tuple(f"{row}_{over}" for over in OVER_TIME for row in ROW_NAMES)
# Hits and misses of plans and predictions, and what is made of them: world-model truth asks nearly the
# same question of the same footprints, so they would hand the label over (decision R-9). Nothing is
# trained on them; what was trained on them before can still be read.
_NEARLY_LABELS = (Indicator.SAFETY_SCORE.value, Indicator.RISK_BEHIND_SHARE.value, "risk_")
TRAINED_ON = tuple(name for name in FEATURE_NAMES if not name.startswith(_NEARLY_LABELS))
_UPPER = np.array([i in GREATEST for i in PAIR_INDICATORS])


def feature_row(readings: IndicatorReadings, risk: RiskMatrix, signals: SignalReadings) -> Floats:
    """Returns the features of one cycle in the order of ROW_NAMES; NO_CONFLICT for times of no conflict."""
    pairs = np.where(_UPPER, _greatest(readings.by_pair()), _least(readings.by_pair()))
    ahead, behind = risk.risk_ahead.reshape(1, -1), risk.risk_behind.reshape(1, -1)
    times = np.minimum(
        [
            _least(each.reshape(1, -1))[0]
            for each in (risk.ttc, risk.pet, risk.ttc_ahead, risk.ttc_behind)
        ],
        NO_CONFLICT,
    )
    return np.concatenate(
        [
            _least(readings.by_channel()),
            _greatest(readings.by_channel()),
            pairs,
            _greatest(ahead),
            _least(ahead),
            _greatest(behind),
            _least(behind),
            times,
            [signals.values[Signal.GAP_SIGNED]],
        ]
    )


def _least(values: Floats) -> Floats:
    """Returns the least value of each row, nan values left out; nan for a row of nan alone."""
    least: Floats = np.fmin.reduce(values, axis=1)
    return least


def _greatest(values: Floats) -> Floats:
    """Returns the greatest value of each row, nan values left out; nan for a row of nan alone."""
    greatest: Floats = np.fmax.reduce(values, axis=1)
    return greatest


@kernel
def window_features(t: Floats, rows: Floats, at: NDArray[np.int64], out: Floats) -> None:
    """Writes into out (m, 4 f) the features at the cycles with indices `at` (m,), in the order OVER_TIME.

    t: (k,) s; rows: (k, f) of the drive, of which the WINDOW s up to each cycle count; nan where
    none of them was evaluated.
    """
    f = rows.shape[1]
    for i in range(at.size):
        last = at[i]
        for j in range(f):
            total, n = 0.0, 0
            low, high = np.inf, -np.inf
            k = last
            while k >= 0 and t[k] >= t[last] - WINDOW - SAME_TIME:
                v = rows[k, j]
                if not np.isnan(v):
                    low, high = min(low, v), max(high, v)
                    if t[k] > t[last] - SHORT + SAME_TIME:
                        total, n = total + v, n + 1
                k -= 1
            out[i, j] = rows[last, j]
            out[i, f + j] = total / n if n > 0 else np.nan
            out[i, 2 * f + j] = low if low < np.inf else np.nan
            out[i, 3 * f + j] = high if high > -np.inf else np.nan


def features_at(t: Floats, rows: Floats, at: NDArray[np.int64]) -> Floats:
    """Returns the features (m, len(FEATURE_NAMES)) at the cycles with indices `at` (m,) of a drive.

    t: (k,) s of all cycles; rows: (k, len(ROW_NAMES)).
    """
    out = np.empty((at.size, len(OVER_TIME) * rows.shape[1]))
    window_features(t, rows, at, out)
    return out


class FeatureHistory:
    """The window of a running drive."""

    def __init__(self) -> None:
        self.t = np.full(CAPACITY, -np.inf)
        self.rows = np.full((CAPACITY, len(ROW_NAMES)), np.nan)
        self._at = np.array([CAPACITY - 1])
        self._out = np.empty((1, len(FEATURE_NAMES)))

    def update(self, t: float, row: Floats) -> Floats:
        """Adds the row of a cycle at `t` s and returns the features (len(FEATURE_NAMES),) at it.

        The result is valid until the next call.
        """
        self.t[:-1], self.rows[:-1] = self.t[1:], self.rows[1:]
        self.t[-1], self.rows[-1] = t, row
        window_features(self.t, self.rows, self._at, self._out)
        features: Floats = self._out[0]
        return features
