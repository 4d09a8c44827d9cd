"""What the sources of the indicators leave open."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.errors import ConfigError
from skidpad.evidence.channels.choices import Form
from skidpad.evidence.channels.indicators import comfort, prediction, similarity


@dataclass(frozen=True, slots=True, kw_only=True)
class IndicatorSettings:
    """The open parameters, with the values of the requirements (C-103, DC-18)."""

    form: Form = Form.CORRECTED
    steepness: float = comfort.STEEPNESS
    history_points: int = 10  # positions before the first score; forms printed and completed
    pairing_distance: float = similarity.PAIRING_DISTANCE
    decay: float = prediction.WAYPOINT_DECAY
    plan_history: int = 10  # earlier plans (C-078)
    history_decay: float = prediction.HISTORY_DECAY
    match_tolerance: float = prediction.MATCH_TOLERANCE

    def __post_init__(self) -> None:
        if self.pairing_distance <= 1.0:
            raise ConfigError(
                "pairing_distance must exceed 1 m, or the bound of object location could never "
                f"be reached (C-054), got {self.pairing_distance}"
            )
        if not (0.0 < self.decay <= 1.0 and 0.0 < self.history_decay <= 1.0):
            raise ConfigError("decay and history_decay must be in (0, 1]")
        if self.history_points < comfort.MIN_POINTS or self.plan_history < 1:
            raise ConfigError(
                f"history_points must be at least {comfort.MIN_POINTS} and plan_history at least 1"
            )

    @property
    def validation_delay(self) -> float:
        """Returns the age in s of the prediction that motion is held against; 0: the previous cycle's."""
        return 1.0 if self.form is Form.CORRECTED else 0.0
