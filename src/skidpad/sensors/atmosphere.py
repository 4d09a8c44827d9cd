"""What the air does to light and radar waves: the numbers that this house takes from physics."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log

from skidpad.core.vocabulary import RangeModel
from skidpad.core.weather import Weather

CONTRAST_THRESHOLD = (
    0.05  # contrast at which an object is just seen; WMO-No. 8, meteorological range
)


@dataclass(frozen=True, slots=True)
class Atmosphere:
    """Extinction of light and attenuation of 77 GHz waves along a path."""

    extinction: float  # 1/m
    radar_attenuation_db_per_m: float  # one way

    def visual_range(self) -> float:
        """Distance in m at which contrast has fallen to the threshold (Koschmieder 1924)."""
        return -log(CONTRAST_THRESHOLD) / self.extinction if self.extinction > 0.0 else inf


CLEAR_AIR = Atmosphere(0.0, 0.0)


def atmosphere(weather: Weather) -> Atmosphere:
    """The air of a weather."""
    fog = 3.0 / (50.0 + 40.0 * (100.0 - weather.fog_density)) if weather.fog_density > 0 else 0.0
    rain = 1.0e-3 * weather.precipitation / 100.0
    return Atmosphere(fog + rain + 1e-5, 1.8e-4 * weather.precipitation)


def sensing_range(weather: Weather, model: RangeModel) -> Atmosphere:
    """The air as depth, labels and radar feel it: none, as in CARLA, or the weather's own."""
    return atmosphere(weather) if model is RangeModel.PHYSICAL else CLEAR_AIR
