"""What distinguishes the planning side of channels; values with their sources."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.errors import require_choice, require_range


@dataclass(frozen=True, slots=True, kw_only=True)
class CarModel:
    """What a channel knows about its own car."""

    length: float  # m
    width: float
    wheelbase: float
    steer_max: float  # rad at the front wheels for steer 1
    a_drive: float  # m/s^2 at full throttle
    a_brake: float  # m/s^2 at full brake


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSettings:
    """How one channel tracks, predicts and plans."""

    plan_horizon: float  # s
    plan_step: float  # s between two points of the plan
    prediction_horizon: float  # s
    prediction_step: float = 0.5  # s
    reads_lights: bool  # stops for red and yellow lights in its view
    reads_stop_lines: bool  # stops at stop lines, slows at yield lines (C-024)
    lane_prediction: bool  # predicts vehicles along their lanes, else straight on
    gives_ids: bool = True
    confirm: int = 3  # detections that make an object
    coast: float = 0.5  # s for which an undetected object is kept

    def __post_init__(self) -> None:
        require_range("channel.plan_step", self.plan_step, 0.05, 2.0)
        require_range("channel.plan_horizon", self.plan_horizon, self.plan_step, 20.0)
        require_range("channel.prediction_horizon", self.prediction_horizon, 0.5, 20.0)


# TransFuser plans four waypoints 0.5 s apart (Chitta et al. 2022). LAV's plan is longer (C-024);
# 4 s is assumed. LAV predicts others along learned futures, TransFuser does not predict (both
# assumed as lane following and straight on).
_LAV = ChannelSettings(
    plan_horizon=4.0,
    plan_step=0.25,
    prediction_horizon=4.0,
    reads_lights=True,
    reads_stop_lines=True,
    lane_prediction=True,
    confirm=2,
)
SETTINGS = {
    "lav_like": _LAV,
    "tfuse_like": ChannelSettings(
        plan_horizon=2.0,
        plan_step=0.5,
        prediction_horizon=2.0,
        reads_lights=False,
        reads_stop_lines=False,
        lane_prediction=False,
    ),
    "reference_like": _LAV,
}


def load_channel_settings(channel: str) -> ChannelSettings:
    """Returns the planning settings of a shipped channel; ConfigError lists the known ones."""
    require_choice("channel", channel, tuple(SETTINGS))
    return SETTINGS[channel]
