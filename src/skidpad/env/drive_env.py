"""One ego in traffic as a Gymnasium environment: each `step` is a tick of the one loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from msgspec import structs
from numpy.typing import NDArray

from skidpad.campaign.cells.matrix import describe_run
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.checkpoints import RunCheckpoint
from skidpad.campaign.runs.run import OpenRun, Run
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.run import Roads, RunSpec, StackDriver
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import (
    GripModel,
    RelocationReason,
    SensorLevel,
    Supervision,
    TrafficStart,
)
from skidpad.core.weather import Weather
from skidpad.env.observation import HIGH, LOW, Lead, Observer
from skidpad.env.reward import WEIGHTS, check_weights, terms_of
from skidpad.env.wheel import WHERE, ActionStack
from skidpad.physics.presets import find_weather
from skidpad.roads.queries import RoadMap
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.recovery import Supervisor
from skidpad.simulation.world.world import World

OPTIONS = ("weather", "grip")  # of `reset`
LONGEST = 2**31 - 1  # of a seed


@dataclass(frozen=True)
class _World:
    """A run that stands at its first tick, and the way back to it."""

    run: OpenRun
    begin: RunCheckpoint
    supervisor: Supervisor
    observer: Observer


class DriveEnv(gymnasium.Env):  # type: ignore[misc]
    """Drives one ego on a map with traffic, weather and tyres, as `skidpad.drive` does.

    An episode ends (`terminated`) when the supervisor would step in: after a contact, off the road,
    on the wrong way, rolled over or stuck. It is cut (`truncated`) after `duration`.

    Args:
        map: a bundled map's name, or an OpenDRIVE file.
        weather: a preset's name, a file, or a weather.
        grip: what weather does to tyres: "physical", "statistical" or "none".
        vehicles: background vehicles, 0 to 80; fewer where the map has no place for them.
        traffic: "fixed", "random" or "pack".
        duration: of an episode, s.
        steers: the action has a steer, too; else lane centring steers.
        rewards: weight of each term, by the name of a metric; terms that are left out weigh 0.
        seeds: run seeds that `reset()` draws from; None: any. Worlds of listed seeds are kept, and
            resets go back to their begin by a checkpoint, which is cheaper than to build them.
        profile: as `--profile`.

    Raises:
        ConfigError: a value is out of its range, or is no name that exists.

    Example:
        >>> env = gymnasium.make("skidpad/Follow-v0", weather="icy_30", duration=20.0)
        >>> observation, info = env.reset(seed=1)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(
        self,
        *,
        map: str | Path = "figure8",
        weather: str | Weather = "clear-noon",
        grip: str = "physical",
        vehicles: int = 20,
        traffic: str = "fixed",
        duration: float = 60.0,
        steers: bool = False,
        rewards: Mapping[str, float] = WEIGHTS,
        seeds: Sequence[int] | None = None,
        profile: str = "recommended",
        render_mode: None = None,
    ) -> None:
        self.render_mode = render_mode
        if seeds is not None and not len(seeds):
            raise ConfigError("seeds: at least one is needed, or None for any")
        self.rewards, self.seeds = check_weights(rewards), None if seeds is None else tuple(seeds)
        self.observation_space = spaces.Box(LOW, HIGH, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (2 if steers else 1,), np.float32)
        starts = [start.value for start in TrafficStart]
        course = Roads(
            map=str(map),
            traffic=TrafficStart(require_choice("traffic", traffic, starts)),
            vehicles=vehicles,
            allow_fewer=True,
        )
        self._template = RunSpec(
            course=course,
            duration=duration,
            sensors=SensorLevel.OBJECTS,
            settings=load_profile(profile, {}),
        )
        self._outside: dict[str, Any] = {"weather": weather, "grip": grip}
        self._worlds: dict[object, _World] = {}
        self._world: _World | None = None
        self._spec_of(weather, grip, 1)  # says now what is wrong with them

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode in a world of its own seed.

        Args:
            seed: of the run; without one it is drawn, from `seeds` where they are listed.
            options: `weather` and `grip` in place of the environment's own, for this episode.
        """
        super().reset(seed=seed)
        if seed is None:
            drawn = self.seeds
            seed = int(self.np_random.integers(LONGEST) if drawn is None else
                       drawn[self.np_random.integers(len(drawn))])  # fmt: skip
        for name in options or {}:
            require_choice("reset option", name, OPTIONS)
        outside = self._outside | (options or {})
        self._world = self._begin(outside["weather"], outside["grip"], seed)
        self._sums = dict.fromkeys(WEIGHTS, 0.0)
        self._over = False
        observation, _ = self._look()
        return observation, {"seed": seed}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drives one tick with pedal (1 full throttle, -1 full brake), and steer (1 left) if asked."""
        world = self._present
        if self._over:
            raise ConfigError("the episode is over: call reset first")
        limited = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0).tolist()
        _wheel(world.run).action = limited
        world.run.answer()
        truncated = not world.run.sense()
        observation, lead = self._look()
        stepper = world.run.stepper
        assert stepper is not None
        terminated = not truncated and stepper.frame.supervision is not Supervision.NONE
        reason: RelocationReason | None = world.supervisor.reason if terminated else None
        dt = world.run.stage.setup.dt
        terms = terms_of(stepper.truth, lead, reason, dt)
        for name, value in terms.items():
            self._sums[name] += value
        reward = sum(weight * terms[name] for name, weight in self.rewards.items())
        self._over = terminated or truncated
        info: dict[str, Any] = {"t": stepper.truth.tick * dt, "terms": terms}
        if self._over:
            info["metrics"] = dict(self._sums)
        return observation, reward, terminated, truncated, info

    def finish(self) -> Run:
        """Returns log and outcome of the present episode, as `skidpad.drive` does."""
        return self._present.run.finish()

    @property
    def _present(self) -> _World:
        """Returns the world of the present episode; ConfigError before the first reset."""
        if self._world is None:
            raise ConfigError("there is no episode yet: call reset first")
        return self._world

    @property
    def world(self) -> World:
        """Returns the moving world of the present episode, to look at."""
        return _world_of(self._present.run)

    @property
    def map(self) -> RoadMap:
        """Returns the map of the present episode."""
        return self._present.run.stage.map

    def close(self) -> None:
        """Releases the worlds that were kept."""
        for world in self._worlds.values():
            world.run.close()
        self._worlds.clear()
        self._world = None

    def _look(self) -> tuple[NDArray[np.float32], Lead | None]:
        """Returns the observation of this tick and the vehicle ahead."""
        present, world = self._present, self.world
        assert present.run.stepper is not None
        lead = present.observer.find_lead(world)
        return present.observer.observe(world, present.run.stepper.frame.ego, lead), lead

    def _begin(self, weather: str | Weather, grip: str, seed: int) -> _World:
        """Returns a world at its first tick: a new one, or a kept one that goes back to it."""
        key = weather, grip, seed
        world = self._worlds.get(key)
        if world is not None:
            world.begin.restore(world.run)
            return world
        world = _build(self._spec_of(weather, grip, seed))
        if self.seeds is not None and seed in self.seeds:
            self._worlds[key] = world
        return world

    def _spec_of(self, weather: str | Weather, grip: str, seed: int) -> RunSpec:
        """Returns the description of an episode's run."""
        models = [model.value for model in GripModel]
        model = GripModel(require_choice("grip", grip, models))
        outside = find_weather(weather) if isinstance(weather, str) else weather
        settings = self._template.settings
        settings = load_profile(settings.profile, {**settings.to_plain(), "grip": model})
        template = structs.replace(self._template, settings=settings)
        return describe_run(StackDriver(WHERE, {}), outside, seed, template)


def _build(spec: RunSpec) -> _World:
    """Builds the world of an episode, without sensors, as no observation reads them."""
    stage = stage_of(spec)
    stage = replace(stage, setup=replace(stage.setup, specs=()))
    run = OpenRun(spec, ActionStack, stage=stage)
    run.sense()
    traffic, supervisor = _world_of(run).traffic, stage.supervisor
    assert isinstance(supervisor, Supervisor)
    assert traffic is not None
    return _World(run, run.save(), supervisor, Observer(traffic.net))


def _world_of(run: OpenRun) -> World:
    """Returns the moving world of a run."""
    assert isinstance(run.backend, EmbeddedBackend)
    return run.backend.world


def _wheel(run: OpenRun) -> ActionStack:
    """Returns the driver of a run."""
    assert run.driver is not None
    stack = run.driver.stack.stack
    assert isinstance(stack, ActionStack)
    return stack
