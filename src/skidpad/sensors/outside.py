"""What a car senses of the air: drops on the windscreen in four stages, and its temperature.

Neither knows the road: no water film, no road temperature, no friction.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor

from skidpad.core.maths.randomness import stream
from skidpad.core.specs import PointSensorSpec
from skidpad.physics.grip import rain_rate
from skidpad.sensors.requested import SensorHost

# mm/h above which rain counts as light, moderate, heavy: the glossary of the American Meteorological
# Society, "rain" (a trace to 2.5, to 7.6, over 7.6)
STAGES = (0.0, 2.5, 7.6)
ERROR_C = 2.0  # K, largest error of the thermometer, the same for a whole run
STEP_C = 0.5  # K, of its display; our assumption


def wiper_stage(rate_mm_h: float) -> int:
    """Returns 0 without rain, 1, 2, 3 in light, moderate, heavy rain."""
    return sum(rate_mm_h > least for least in STAGES)


def make_rain_sensor(spec: PointSensorSpec, host: SensorHost) -> Callable[[], int]:
    """Returns a function that gives the stage of the wiper, 0 to 3, in the run's weather."""
    del spec
    return lambda: wiper_stage(rain_rate(host.setup.weather))


def make_thermometer(spec: PointSensorSpec, host: SensorHost) -> Callable[[], float]:
    """Returns a function that gives the temperature of the air in deg C, in steps of STEP_C.

    The error, up to ERROR_C to either side, is drawn once per run.
    """
    error = thermometer_error(host.seed, spec.id)
    return lambda: read_thermometer(host.setup.weather.air_temperature_c, error)


def thermometer_error(seed: int, id: str) -> float:
    """Returns the error in K that a thermometer of this id has in a whole run."""
    return stream(seed, f"{id}/error").uniform(-ERROR_C, ERROR_C)


def read_thermometer(air_c: float, error: float) -> float:
    """Returns what a thermometer with an error in K shows of the air, in steps of STEP_C; both in deg C."""
    return STEP_C * floor((air_c + error) / STEP_C + 0.5)
