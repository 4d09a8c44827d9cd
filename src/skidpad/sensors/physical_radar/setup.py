"""A radar with an equation, noise and clutter: what stands out of its resolution cells in one tick.

Radar equation (ITU-R and textbooks alike): the echo's power over the noise is
    SNR = SNR_0 (sigma / 10 m^2) (R_0 / R)^4 G(az, el)^2 exp(-loss)
with SNR_0 such that a Swerling 1 target of 10 m^2 is found in 9 of 10 ticks at the radar's `range` R_0.
Range, 10 m^2 and the sizes of cells are those of a public 77 GHz design (TI TIDUEN5A, March 2020, key
system specifications, MIMO): 150 m, 0.6 m, 0.53 km/h, 1.4 deg, elevation 18 deg. The antenna is a
Gaussian lobe with the fields of view as its widths at half power. Each echo has a phase of its own.
"""

from __future__ import annotations

from math import ceil, inf, log, pi, radians, sqrt, tan
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.specs import RadarSpec
from skidpad.core.weather import Weather
from skidpad.physics.grip import rain_rate
from skidpad.physics.interference import AFFECTED, interference_over_noise
from skidpad.physics.mirrors import LIGHT, concrete_permittivity
from skidpad.physics.optics import RADAR_GHZ, rain_attenuation_db_km
from skidpad.physics.radio import rain_scatter, wet_radome_db
from skidpad.sensors.object_level.boxes import Mount, mount_of
from skidpad.sensors.physical_radar.cells import (
    RAIN_SPREAD,
    RANGES,
    Grid,
    cfar_threshold,
    snr_for,
)

RANGE_STEP, SPEED_STEP, BEAM_STEP = 0.6, 0.53 / 3.6, radians(1.4)  # TIDUEN5A
MAX_SPEED = 133.0 / 3.6  # m/s, TIDUEN5A; faster targets keep their Doppler here
RISE_WIDTH, SLOPE = radians(18.0), 1.6  # TIDUEN5A; an assumption: of the angle's error
REFERENCE, DETECTED, FALSE_ALARMS = 10.0, 0.9, 1e-8  # m^2 (TIDUEN5A); the others are assumptions
GAMMA = 10.0**-2.5  # of the road, sigma_0 = gamma sin(grazing angle): an assumption
DB = log(10.0) / 10.0  # nepers of power in a decibel
WAVE_NUMBER = 2.0 * pi * RADAR_GHZ * 1e9 / LIGHT  # 1/m
FASTEST = 71  # entries of the table of radome losses by speed in m/s


class RadarAir(NamedTuple):
    """What weather puts in a radar's way, in the units of its cells."""

    loss: float  # nepers of power per m, both ways
    radome: Floats  # (FASTEST,) nepers by speed in m/s, both ways
    ground: Floats  # (ranges,) clutter over noise in the Doppler cell of what stands
    rain: Floats  # (ranges,) in each Doppler cell of the drops


class RadarSetup(NamedTuple):
    """One radar in a run."""

    mount: Mount
    key: np.uint64
    grid: Grid
    reach: float  # m
    factor: float  # SNR of 1 m^2 at 1 m on the axis
    wide: float  # rad, widths of the antenna's lobe at half power
    high: float
    edge: float  # more than the tangent of the azimuth up to which an echo is met
    false: float  # mean number of false alarms per tick
    air: RadarAir
    multipath: bool  # mirrors in walls, rails and the road
    concrete: np.complex128  # permittivity of walls
    rivals: float  # share of vehicles whose radar disturbs this one
    rival: float  # m^2, what one leaves over the noise from 1 m, both on the axis


def setup_of(
    spec: RadarSpec,
    key: np.uint64,
    weather: Weather | None,
    multipath: bool = False,
    rivals: float = 0.0,
) -> RadarSetup:
    """Returns the constants of a radar in a weather. rivals: share of vehicles whose radar disturbs it."""
    wide, high = radians(spec.horizontal_fov_deg), radians(spec.vertical_fov_deg)
    beams = max(1, ceil(wide / BEAM_STEP))
    ranges = min(ceil(spec.range / RANGE_STEP), RANGES - 1)
    grid = Grid(RANGE_STEP, SPEED_STEP, BEAM_STEP, ranges, beams, cfar_threshold(FALSE_ALARMS))
    factor = snr_for(DETECTED, FALSE_ALARMS) * spec.range**4 / REFERENCE
    cells = ranges * beams * 2.0 * MAX_SPEED / SPEED_STEP
    air = _air(spec, factor, ranges, high, 0.0 if weather is None else rain_rate(weather))
    last = 0.5 * wide + BEAM_STEP
    edge = (1.0 + 1e-9) * tan(last) if last < 0.5 * pi else inf
    return RadarSetup(
        mount_of(spec.mount), key, grid, spec.range, factor, wide, high, edge,
        cells * FALSE_ALARMS, air, multipath, np.complex128(concrete_permittivity(RADAR_GHZ)), rivals,
        interference_over_noise(1.0, AFFECTED, RADAR_GHZ),
    )  # fmt: skip


def _air(spec: RadarSpec, factor: float, ranges: int, high: float, rain: float) -> RadarAir:
    """Returns losses and clutter by range; rain is in mm/h."""
    distance = np.maximum(np.arange(ranges) * RANGE_STEP, RANGE_STEP)
    loss = 2.0 * DB * rain_attenuation_db_km(rain) / 1000.0
    radome = np.array([DB * wet_radome_db(rain, float(v), RADAR_GHZ) for v in range(FASTEST)])
    snr = factor / distance**4 * np.exp(-loss * distance)  # of 1 m^2
    grazing = np.minimum(spec.mount.z / distance, 1.0)
    lobe = np.exp(-8.0 * log(2.0) * (grazing / high) ** 2)  # the road lies below the axis
    ground = snr * lobe * GAMMA * grazing * RANGE_STEP * distance * BEAM_STEP
    # of the lobe, both ways, the half above the road: sqrt(pi / (32 ln 2)) of its width
    rise = high * sqrt(pi / (32.0 * log(2.0)))
    volume = RANGE_STEP * distance**2 * BEAM_STEP * rise
    eta = rain_scatter(rain, RADAR_GHZ)[1] if rain > 0.0 else 0.0
    return RadarAir(loss, radome, ground, snr * eta * volume * SPEED_STEP / (2.0 * RAIN_SPREAD))
