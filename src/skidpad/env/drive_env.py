"""One ego in traffic as a Gymnasium environment: each `step` is a tick of the one loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from skidpad.campaign.runs.run import Run
from skidpad.core.errors import ConfigError
from skidpad.env.ego import EgoEpisode
from skidpad.env.episodes import Course, Episodes
from skidpad.env.observation import HIGH, LOW
from skidpad.env.reward import TERMS, WEIGHTS, weigh
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.world import World

if TYPE_CHECKING:
    from typing_extensions import Unpack


class DriveEnv(gymnasium.Env):  # type: ignore[misc]
    """Drives one ego on a map with traffic, weather and tyres, as `skidpad.drive` does.

    An episode ends (`terminated`) when the supervisor would step in: after a contact, off the road,
    on the wrong way, rolled over or stuck. It is cut (`truncated`) after `duration`.

    Args:
        map: a bundled map's name, or an OpenDRIVE file; default "figure8".
        weather: a preset's name, a file, or a weather; default "clear-noon".
        grip: what weather does to tyres: "physical" (default), "statistical" or "none".
        vehicles: background vehicles, 0 to 80, default 20; fewer where the map has no place for them.
        traffic: "fixed" (default), "random" or "pack".
        duration: of an episode, s; default 60.
        steers: the action has a steer, too; else lane centring steers.
        rewards: weight of each term, by the name of a metric; terms that are left out weigh 0.
        seeds: run seeds that `reset()` draws from; None (default): any. Worlds of listed seeds are kept, and
            resets go back to their begin by a checkpoint, which is cheaper than to build them.
        profile: as `--profile`; default "recommended".

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
        steers: bool = False,
        rewards: Mapping[str, float] = WEIGHTS,
        render_mode: None = None,
        **course: Unpack[Course],
    ) -> None:
        self.render_mode, self._rewards = render_mode, weigh(rewards)
        self.observation_space = spaces.Box(LOW, HIGH, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (2 if steers else 1,), np.float32)
        self.episodes = Episodes(EgoEpisode, **course)
        self._episode: EgoEpisode | None = None

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
            seed = self.episodes.draw(self.np_random)
        self._episode = self.episodes.begin(seed, options, self._episode)
        self._over = False
        return self._episode.observations[0].copy(), {"seed": seed}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drives one tick with pedal (1 full throttle, -1 full brake), and steer (1 left) if asked."""
        episode = self._present
        if self._over:
            raise ConfigError("the episode is over: call reset first")
        reward, terminated, truncated = episode.step(action.tolist(), self._rewards)
        self._over = terminated or truncated
        info: dict[str, Any] = {
            "t": episode.t,
            "terms": dict(zip(TERMS, episode.terms, strict=True)),
        }
        if self._over:
            info["metrics"] = dict(zip(TERMS, episode.sums, strict=True))
        return episode.observations[0].copy(), reward, terminated, truncated, info

    def finish(self) -> Run:
        """Returns log and outcome of the present episode, as `skidpad.drive` does."""
        return self._present.run.finish()

    @property
    def _present(self) -> EgoEpisode:
        """Returns the present episode; ConfigError before the first reset."""
        if self._episode is None:
            raise ConfigError("there is no episode yet: call reset first")
        return self._episode

    @property
    def world(self) -> World:
        """Returns the moving world of the present episode, to look at."""
        return self._present.world

    @property
    def map(self) -> RoadMap:
        """Returns the map of the present episode."""
        return self._present.run.stage.map

    def close(self) -> None:
        """Releases all worlds that are kept."""
        if self._episode is not None:
            self.episodes.put_aside(self._episode)
            self._episode = None
        self.episodes.close()
