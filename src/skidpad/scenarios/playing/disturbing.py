"""Disturbances at work: random accelerations of other vehicles, drawn as the drive goes on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from skidpad.core.errors import ConfigError
from skidpad.core.maths.randomness import stream, stream_key
from skidpad.core.traffic.disturbance import KNOT_S, SHARE, Disturbance, parse_disturbance
from skidpad.scenarios.movement.motion import Guide
from skidpad.scenarios.scenario import Scenario
from skidpad.scenarios.scene import Actor


@dataclass
class Drift:
    """The disturbance of one vehicle as far as it has come.

    given: draws that come first. z: all draws so far. x: the process. dv: m/s on top of the speed that
    the scenario asks for.
    """

    law: Disturbance
    given: tuple[float, ...]
    rng: np.random.Generator
    z: list[float] = field(default_factory=list)
    x: float = 0.0
    dv: float = 0.0
    ticks: int = 0

    def step(self, guide: Guide, dt: float) -> None:
        """Goes on for dt s and sets what the guide adds to its speed and acceleration."""
        if self.ticks % round(KNOT_S / dt) == 0:
            k = len(self.z)
            self.z.append(self.given[k] if k < len(self.given) else self.rng.standard_normal())
            self.x = self.law.follow(self.x, self.z[k], first=k == 0)
        self.ticks += 1
        before, most = self.dv, SHARE * abs(guide.v)
        self.dv = min(max(before + self.law.acceleration(self.x) * dt, -most), most)
        guide.dv, guide.da = self.dv, (self.dv - before) / dt


class Disturbances:
    """All disturbances of a run; each draws from a stream of the run's seed and its actor's name."""

    def __init__(
        self, laws: Sequence[Disturbance], draws: Mapping[str, Sequence[float]], seed: int
    ) -> None:
        """draws: by actor that come before those of the seed."""
        self.seed = seed
        self.drifts = [
            Drift(law, tuple(draws.get(law.actor, ())), stream(seed, "disturbance", law.actor))
            for law in laws
        ]

    def step(self, actors: Mapping[str, Actor], dt: float) -> None:
        """Disturbs the coming step of dt s."""
        for drift in self.drifts:
            drift.step(actors[drift.law.actor].guide, dt)

    def branch(self, name: str) -> None:
        """Draws from streams of this name from the next draw on."""
        self.seed = stream_key(self.seed, "branch", name)
        for drift in self.drifts:
            drift.given = ()
            drift.rng = stream(self.seed, "disturbance", drift.law.actor)

    @property
    def draws(self) -> dict[str, tuple[float, ...]]:
        """Returns all draws so far by actor; a run that is given them drives the same."""
        return {drift.law.actor: tuple(drift.z) for drift in self.drifts}


def read_disturbances(texts: Sequence[str], scenario: Scenario) -> tuple[Disturbance, ...]:
    """Returns the disturbances that texts ask for in a scenario.

    Raises:
        ConfigError: a text has another form, names no other vehicle of the file, or one twice.
    """
    found = tuple(parse_disturbance(text) for text in texts)
    others = [e.name for e in scenario.entities.values() if e.wheels and e.name != scenario.ego]
    for k, one in enumerate(found):
        if one.actor not in others:
            raise ConfigError(
                f"--disturb: {one.actor!r} is no other vehicle of the file; there are: "
                f"{', '.join(others) or 'none'}"
            )
        if one.actor in [earlier.actor for earlier in found[:k]]:
            raise ConfigError(f"--disturb names {one.actor!r} twice")
    return found
