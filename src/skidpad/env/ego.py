"""One ego in traffic: its actions in, what it observes and is rewarded for out, tick by tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.run import OpenRun
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import Supervision
from skidpad.env.observation import OBSERVED, Observations, observe
from skidpad.env.reward import TERMS, terms_of
from skidpad.env.wheel import ActionStack
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.recovery import Supervisor
from skidpad.simulation.world.world import World


class EgoEpisode:
    """The run of an episode, and the way back to its first tick.

    Attributes:
        observations: (1, 12) of the present tick; another array may be put in its place.
        terms: what the last tick added to each of TERMS.
        sums: of these since the begin.
    """

    def __init__(self, spec: RunSpec) -> None:
        stage = stage_of(spec)
        assert isinstance(stage.supervisor, Supervisor)
        self.supervisor = stage.supervisor
        # without sensors, as no observation reads them
        stage = replace(stage, setup=replace(stage.setup, specs=()))
        self.run = OpenRun(spec, ActionStack, stage=stage)
        self.run.sense()
        self.wheel, self.begin = wheel_of(self.run), self.run.save()
        self.observations: Observations = np.zeros((1, len(OBSERVED)), dtype=np.float32)
        self._begin()

    @property
    def world(self) -> World:
        """Returns the moving world of the run."""
        return world_of(self.run)

    @property
    def t(self) -> float:
        """Returns the time of the present tick, s."""
        return self.world.tick * self.run.stage.setup.dt

    def restart(self) -> None:
        """Goes back to the first tick."""
        self.begin.restore(self.run)
        self._begin()

    def _begin(self) -> None:
        """Observes the first tick, in which nothing was driven yet."""
        self.terms, self.sums = [0.0] * len(TERMS), [0.0] * len(TERMS)
        observe(self.world.arena, self.observations)

    def step(
        self, action: Sequence[float], rewards: Mapping[int, float]
    ) -> tuple[float, bool, bool]:
        """Drives one tick and returns reward, and whether the episode is terminated or truncated.

        action: pedal, and steer if asked, each from -1 to 1. rewards: weights by the index of a term.
        """
        self.wheel.action = [min(max(float(value), -1.0), 1.0) for value in action]
        run = self.run
        run.answer()
        if not run.sense():  # it has answered the last tick, and nothing moves any more
            self.terms = [0.0] * len(TERMS)
            return 0.0, False, True
        observe(self.world.arena, self.observations)
        assert run.stepper is not None
        terminated = run.stepper.frame.supervision is not Supervision.NONE
        reason = self.supervisor.reason if terminated else None
        self.terms = terms_of(run.stepper.truth, self.observations[0], reason, run.stage.setup.dt)
        self.sums = [a + b for a, b in zip(self.sums, self.terms, strict=True)]
        reward = sum([weight * self.terms[k] for k, weight in rewards.items()])
        return reward, terminated, False

    def close(self) -> None:
        """Releases the world of the run."""
        self.run.close()


def world_of(run: OpenRun) -> World:
    """Returns the moving world of a run."""
    assert isinstance(run.backend, EmbeddedBackend)
    return run.backend.world


def wheel_of(run: OpenRun) -> ActionStack:
    """Returns the driver of a run."""
    assert run.driver is not None
    stack = run.driver.stack.stack
    assert isinstance(stack, ActionStack)
    return stack
