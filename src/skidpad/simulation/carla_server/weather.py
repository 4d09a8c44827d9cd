"""CARLA's weather parameters and ours; ice comes from the blueprint `skidpad.weather.grip` (R-15)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import RANGES, Weather
from skidpad.physics.grip import Road
from skidpad.simulation.carla_server.protocol import wire

PACKED = (  # order of the wire
    "cloudiness",
    "precipitation",
    "precipitation_deposits",
    "wind_intensity",
    "sun_azimuth_deg",
    "sun_altitude_deg",
    "fog_density",
    "fog_distance",
    "fog_falloff",
    "wetness",
    "scattering_intensity",
    "mie_scattering_scale",
    "rayleigh_scattering_scale",
)
COLD_C = -5.0  # air and road when there is ice (decision M-10)


class Sky:
    """The weather as it acts, and as the client wrote it (which is what it reads back)."""

    def __init__(self, ice_thickness: float, grip: GripModel, mu_ref: float) -> None:
        """ice_thickness: percent of 20 mm, unless a client sets it. mu_ref: on a dry road."""
        self.server_ice = ice_thickness
        self._model, self._mu_ref = grip, mu_ref
        self.client_ice: float | None = None
        self.values = dict.fromkeys(PACKED, 0.0) | {"sun_altitude_deg": 75.0}
        self.values["rayleigh_scattering_scale"] = 0.0331
        self.dust_storm = 0.0  # accepted without effect
        self._derive()

    def pack(self) -> list[float]:
        """Returns `WeatherParameters` as the client last set them."""
        return [*(self.values[name] for name in PACKED), self.dust_storm]

    def apply(self, value: Any) -> None:
        """Sets the weather from a call; values beyond their range act as the nearest one inside.

        WireError for another shape.
        """
        numbers = wire.numbers(value, "weather", len(PACKED) + 1)
        self.values = dict(zip(PACKED, numbers[:-1], strict=True))
        self.dust_storm = numbers[-1]
        self._derive()

    def set_ice(self, thickness: float | None) -> None:
        """Sets ice in percent of 20 mm; None: as the server was started."""
        self.client_ice = thickness
        self._derive()

    def _derive(self) -> None:
        """Derives the weather, clamped to its ranges, and its grip from the values and the ice in force."""
        clamped = {
            name: min(max(value, RANGES[name][0]), RANGES[name][1])
            for name, value in self.values.items()
            if name != "sun_azimuth_deg"
        }
        ice = self.server_ice if self.client_ice is None else self.client_ice
        low, high = RANGES["ice_thickness"]
        weather = replace(
            Weather(),
            **clamped,  # type: ignore[arg-type]
            sun_azimuth_deg=self.values["sun_azimuth_deg"] % 360.0,
            ice_thickness=min(max(ice, low), high),
        )
        if weather.ice_thickness > 0.0:
            weather = replace(weather, air_temperature_c=COLD_C, road_temperature_c=COLD_C)
        self.weather = weather
        self.road = Road(weather, self._model, self._mu_ref)
        self.grip = self.road.params()
