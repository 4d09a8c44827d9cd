"""The shipped channels' senses, fixed before any evaluation (decision C-2).

Where a number has no public source it says "assumed". The published traits (C-024): `lav_like`
sees all round and reads lights; `tfuse_like` is blind behind, and localises worse in the dark.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians

from skidpad.core.errors import require_choice
from skidpad.sensors.channels.ghosts import GhostSettings
from skidpad.sensors.channels.localisation import LocalisationError
from skidpad.sensors.channels.suite import ChannelSensing

# Position: lidar detectors reach a mean translation error of about 0.2 m for cars (nuScenes
# detection benchmark; CenterPoint, Yin et al. 2021), which is 0.15 m per axis; we give a third of
# the variance to white noise and the rest to a bias of each object (split and times assumed).
# Heading: 0.1 rad and sizes: 0.15 of intersection error in the same benchmark, halved for cars.
# Misses and ghosts: recall of about 0.95 near and 0.7 far at 90 % precision (same; assumed shape).
# Localisation: 0.1 m per axis after filtering, drift 0.2 m over minutes (assumed, of the order of
# GNSS/INS with map matching). Jumps: the source counts 12 in 6.4 h by day and 9 in 1.5 h by night
# (C-210, CF-08): about 1 per hour and channel, and three times that for `tfuse_like` in the dark.
# So CF-08 is by construction here.
_LOCALISATION = LocalisationError(
    sigma=0.08,
    time=2.0,
    drift_sigma=0.2,
    drift_time=120.0,
    jump_rate=1.0,
    jump_low=0.8,
    jump_high=3.0,
    jump_time=5.0,
    heading_sigma=0.008,
)

LAV_LIKE = ChannelSensing(
    half_angle=pi,
    range_vehicle=70.0,
    range_person=45.0,
    position_sigma=0.09,
    bias_sigma=0.12,
    bias_time=1.5,
    range_growth=1.0,
    heading_sigma=0.05,
    size_ratio=0.05,
    miss=0.03,
    miss_far=0.30,
    miss_time=0.4,
    share_seen=0.25,
    confusion=0.02,
    ghosts=GhostSettings(rate=20.0, life=0.5),
    latency_cycles=1,
    lights=True,
    light_range=90.0,
    localisation=_LOCALISATION,
)

TFUSE_LIKE = ChannelSensing(
    half_angle=radians(90.0),
    range_vehicle=60.0,
    range_person=40.0,
    position_sigma=0.11,
    bias_sigma=0.15,
    bias_time=1.5,
    range_growth=1.0,
    heading_sigma=0.06,
    size_ratio=0.06,
    miss=0.05,
    miss_far=0.40,
    miss_time=0.4,
    share_seen=0.30,
    confusion=0.03,
    ghosts=GhostSettings(rate=30.0, life=0.5),
    latency_cycles=1,
    lights=False,
    light_range=0.0,
    localisation=LocalisationError(
        sigma=0.10,
        time=2.0,
        drift_sigma=0.25,
        drift_time=120.0,
        jump_rate=1.0,
        jump_low=0.8,
        jump_high=3.0,
        jump_time=5.0,
        heading_sigma=0.010,
        dark=3.0,
    ),
)

REFERENCE_LIKE = ChannelSensing(
    half_angle=pi,
    range_vehicle=90.0,
    range_person=60.0,
    position_sigma=0.05,
    bias_sigma=0.07,
    bias_time=1.5,
    range_growth=1.0,
    heading_sigma=0.03,
    size_ratio=0.03,
    miss=0.01,
    miss_far=0.15,
    miss_time=0.4,
    share_seen=0.20,
    confusion=0.01,
    ghosts=GhostSettings(rate=6.0, life=0.5),
    latency_cycles=1,
    lights=True,
    light_range=110.0,
    localisation=LocalisationError(
        sigma=0.05,
        time=2.0,
        drift_sigma=0.1,
        drift_time=120.0,
        jump_rate=0.2,
        jump_low=0.8,
        jump_high=3.0,
        jump_time=5.0,
        heading_sigma=0.005,
    ),
)

SENSES = {
    "lav_like": LAV_LIKE,
    "tfuse_like": TFUSE_LIKE,
    "reference_like": REFERENCE_LIKE,
}


def senses_of(channel: str, jumps: float = 1.0) -> ChannelSensing:
    """Returns the senses of a shipped channel, with so many times its jumps of position.

    ConfigError for another channel.
    """
    require_choice("channel", channel, tuple(SENSES))
    senses = SENSES[channel]
    error = replace(senses.localisation, jump_rate=jumps * senses.localisation.jump_rate)
    return replace(senses, localisation=error)
