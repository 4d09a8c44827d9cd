"""What `skidpad bench traffic` is asked; apart, so that the command line starts without the world."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from skidpad.core.run import PARTED
from skidpad.core.vocabulary import Headways


class TrafficBench(Struct, frozen=True, kw_only=True):
    """What `skidpad bench traffic` drives."""

    map: Annotated[str, Meta(description="traffic: a bundled map, or an OpenDRIVE file.")] = (
        "figure8"
    )
    weather: Annotated[
        tuple[str, ...], Meta(description="traffic: weathers, parted by commas.", extra=PARTED)
    ] = ("clear-noon", "rain-noon", "snow", "icy_30")
    km: Annotated[
        float, Meta(ge=1.0, le=1.0e6, description="traffic: km of all vehicles per weather.")
    ] = 100.0
    vehicles: Annotated[int, Meta(ge=2, le=80, description="traffic: vehicles, 2 to 80.")] = 60
    headways: Annotated[
        Headways, Meta(description="traffic: how closely drivers follow: comfort or field.")
    ] = Headways.COMFORT
    careless: Annotated[
        bool, Meta(description="traffic: drivers mind no weather, as CARLA's (drivers=off).")
    ] = False
