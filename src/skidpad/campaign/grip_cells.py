"""The cells of the friction campaign: scenario, weather, friction, seed. All of it is data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import Enum
from typing import Any

from skidpad.campaign.cells import FIRST_SEED, BackendChoice, BackendKind
from skidpad.core.vocabulary import GripModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.scenarios.scene import Mode
from skidpad.scenarios.variation import CUT_IN, CutIn
from skidpad.stack.settings import Settings

DEADLINE_S = 120.0  # wall time after which a run counts as hanging
DEADLINE_SLOW_S = 900.0  # with pixels, or over a network


class Friction(str, Enum):
    """The switch of B-004."""

    ORIGINAL = "original"  # weather is seen, tyres know nothing of it
    REDUCED = "reduced"


@dataclass(frozen=True, slots=True, kw_only=True)
class GripCell:
    """One run."""

    scenario: str
    weather: Weather
    friction: Friction
    seed: int
    cutin: CutIn = CutIn.FIXED
    model: GripModel = GripModel.STATISTICAL
    mu_ref: float = 0.9
    controller: str = "stack"
    config: int = 2
    profile: str = "recommended"
    settings: Settings = field(default_factory=Settings)
    level: SensorLevel = SensorLevel.OBJECTS
    actors: Mode = Mode.PHYSICAL
    overlay: bool = False
    backend: BackendChoice = field(default_factory=BackendChoice)

    @property
    def cell(self) -> str:
        """Name without the seed."""
        variant = "" if self.cutin is CutIn.FIXED else f"-{self.cutin.value}"
        drops = "-drops" if self.overlay else ""
        return f"{self.scenario}{variant}{drops}_{self.weather.name}_{self.friction.value}"

    @property
    def name(self) -> str:
        """Name of the run and of its folder."""
        return f"{self.cell}-{self.seed:06d}"

    @property
    def grip(self) -> GripModel:
        """What acts on the tyres."""
        return self.model if self.friction is Friction.REDUCED else GripModel.NONE

    @property
    def deadline_s(self) -> float:
        """Wall time after which the run counts as hanging."""
        quick = self.level is SensorLevel.OBJECTS and self.backend.kind is BackendKind.EMBEDDED
        return DEADLINE_S if quick else DEADLINE_SLOW_S

    def resolved(self) -> dict[str, Any]:
        """Everything that decides the run, as plain data."""
        plain = {
            name: value.value if isinstance(value := getattr(self, name), Enum) else value
            for name in self.__dataclass_fields__
        }
        return plain | {
            "weather": asdict(self.weather),
            "settings": self.settings.as_plain(),
            "backend": self.backend.resolved(),
        }


def cross(
    template: GripCell,
    scenarios: Sequence[str],
    weather: Sequence[Weather],
    frictions: Sequence[Friction],
    cutins: Sequence[CutIn],
    seeds: range,
    overlays: Sequence[bool] | None = None,
) -> list[GripCell]:
    """Every combination; the rest as in `template`. Seeds vary slowest: pairs come early.

    overlays: drops on the cameras or not; None: as in the template.
    """
    from dataclasses import replace

    return [
        replace(template, scenario=s, weather=w, friction=f, cutin=c, seed=seed, overlay=drops)
        for seed in seeds
        for s in scenarios
        for c in (cutins if s == CUT_IN else (CutIn.FIXED,))
        for w in weather
        for drops in ((template.overlay,) if overlays is None else overlays)
        for f in frictions
    ]


def seeds(first: int, n: int) -> range:
    """n reported seeds beginning with the first-th, from 0."""
    return range(FIRST_SEED + first, FIRST_SEED + first + n)
