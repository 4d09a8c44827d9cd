"""Weather: one record with CARLA's fields plus ice, snow and temperatures (decision M-10)."""

from __future__ import annotations

from dataclasses import dataclass, fields

from skidpad.core.errors import require_range

PERCENT = (0.0, 100.0)
RANGES: dict[str, tuple[float, float]] = {
    "cloudiness": PERCENT,
    "precipitation": PERCENT,
    "precipitation_deposits": PERCENT,
    "wind_intensity": PERCENT,
    "sun_azimuth_deg": (0.0, 360.0),
    "sun_altitude_deg": (-90.0, 90.0),
    "fog_density": PERCENT,
    "fog_distance": (0.0, 1.0e6),
    "wetness": PERCENT,
    "fog_falloff": (0.0, 1.0e3),
    "scattering_intensity": (0.0, 1.0e3),
    "mie_scattering_scale": (0.0, 1.0e3),
    "rayleigh_scattering_scale": (0.0, 1.0e3),
    "ice_thickness": PERCENT,
    "snow_depth_mm": (0.0, 2000.0),
    "air_temperature_c": (-60.0, 60.0),
    "road_temperature_c": (-60.0, 80.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """The state of sky, air and road. Percentages are CARLA's; `ice_thickness` 100 is 2 cm (B-017).

    Attributes:
        name: Slug.
        title: As published.
        cloudiness: percent.
        precipitation: percent.
        precipitation_deposits: percent of the road under water.
        wind_intensity: percent.
        sun_azimuth_deg: deg.
        sun_altitude_deg: deg above the horizon.
        fog_density: percent.
        fog_distance: m, where fog begins.
        wetness: percent.
        fog_falloff: How fast fog thins with height, as in CARLA: it is halved every 10 m / fog_falloff.
        scattering_intensity: Of the sky, as in CARLA.
        mie_scattering_scale: Of the sky, as in CARLA.
        rayleigh_scattering_scale: Of the sky, as in CARLA.
        ice_thickness: percent of 20 mm.
        snow_depth_mm: mm of snow on the road.
        air_temperature_c: deg C.
        road_temperature_c: deg C.

    Example:
        >>> Weather(name="drizzle", precipitation=15.0, wetness=40.0)
    """

    name: str = ""
    title: str = ""
    cloudiness: float = 0.0
    precipitation: float = 0.0
    precipitation_deposits: float = 0.0
    wind_intensity: float = 0.0
    sun_azimuth_deg: float = 0.0
    sun_altitude_deg: float = 75.0
    fog_density: float = 0.0
    fog_distance: float = 0.0
    wetness: float = 0.0
    fog_falloff: float = 0.0
    scattering_intensity: float = 0.0
    mie_scattering_scale: float = 0.0
    rayleigh_scattering_scale: float = 0.0331
    ice_thickness: float = 0.0
    snow_depth_mm: float = 0.0
    air_temperature_c: float = 15.0
    road_temperature_c: float = 15.0

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            require_range(f"weather.{name}", getattr(self, name), low, high)

    @property
    def is_night(self) -> bool:
        """Returns whether the sun is below the horizon: headlights on (A-218)."""
        return self.sun_altitude_deg < 0.0

    @property
    def precipitation_kind(self) -> str:
        """Returns `rain` or `clear`, the column of M-8."""
        return "rain" if self.precipitation > 0.0 else "clear"

    @property
    def rain_with_ice(self) -> bool:
        """Returns whether there is ice together with falling or standing water (B-002).

        It is refused where the models cannot say.
        """
        return self.ice_thickness > 0.0 and (
            self.precipitation > 0.0 or self.precipitation_deposits > 0.0
        )

    def values(self) -> dict[str, float]:
        """Returns the numeric fields by name, in declaration order."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name in RANGES}
