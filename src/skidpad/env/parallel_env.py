"""Every vehicle is an agent: a parallel environment of PettingZoo (extra `rl`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from skidpad.campaign.runs.run import Run
from skidpad.core.errors import ConfigError, MissingExtra, require_choice
from skidpad.env.all_agents import AllAgentsEpisode
from skidpad.env.episodes import OPTIONS, Course, Episodes
from skidpad.env.observation import HIGH, LOW
from skidpad.env.reward import STUCK, TERMS, WEIGHTS, weigh

if TYPE_CHECKING:
    from typing_extensions import Unpack

try:
    from pettingzoo import ParallelEnv
except ImportError as error:
    raise MissingExtra("skidpad.env.parallel_env", "rl") from error

DRIVEN = tuple(name for name in TERMS if name != TERMS[STUCK])  # what is noticed of every agent
Values = dict[str, Any]


class TrafficEnv(ParallelEnv):  # type: ignore[misc]
    """Lets agents drive all vehicles of a map, with weather, tyres and contacts as in every other drive.

    An agent's drive ends (`terminations`) at its first contact, off the road, on the wrong way or on its
    side; its vehicle is then taken off the road. All are cut (`truncations`) after `duration`.

    Args:
        map: a bundled map's name, or an OpenDRIVE file; default "figure8".
        weather: a preset's name, a file, or a weather; default "clear-noon".
        grip: what weather does to tyres: "physical" (default), "statistical" or "none".
        vehicles: beside the ego, 0 to 80, default 20; fewer where the map has no place for them.
        traffic: "fixed" (default) or "pack": where they begin, at rest.
        duration: of an episode, s; default 60.
        rewards: weight of each term, by the name of a metric; terms that are left out weigh 0.
        seeds: seeds that `reset()` draws from; None (default): any. Worlds of listed seeds are kept, and
            resets go back to their begin by a checkpoint.
        profile: as `--profile`; default "recommended".

    Raises:
        ConfigError: a value is out of its range, or is no name that exists.

    Example:
        >>> env = TrafficEnv(weather="icy_30", vehicles=9)
        >>> observations, infos = env.reset(seed=1)
        >>> env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "skidpad_traffic_v0", "render_modes": []}

    def __init__(
        self,
        *,
        rewards: Mapping[str, float] | None = None,
        render_mode: None = None,
        **course: Unpack[Course],
    ) -> None:
        self.render_mode = render_mode
        if "traffic" in course:
            require_choice("traffic", course["traffic"], ("fixed", "pack"))
        asked = {name: WEIGHTS[name] for name in DRIVEN} if rewards is None else rewards
        for name in asked:
            require_choice("reward term of all agents", name, DRIVEN)
        self._rewards = np.zeros(len(TERMS))
        for k, weight in weigh(asked).items():
            self._rewards[k] = weight
        self.episodes = Episodes(AllAgentsEpisode, **course)
        self._draws = np.random.default_rng()
        self._observed = spaces.Box(LOW, HIGH, dtype=np.float32)
        self._acts = spaces.Box(-1.0, 1.0, (2,), np.float32)
        first = 1 if self.episodes.seeds is None else self.episodes.seeds[0]
        self._episode = self.episodes.begin(first, None, None)
        self.possible_agents = list(self._episode.names)
        self.agents: list[str] = []

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's observations, the same for all."""
        del agent
        return self._observed

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's actions: pedal (1 full throttle, -1 full brake), steer (1 left)."""
        del agent
        return self._acts

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Values, Values]:
        """Begins an episode with all vehicles at rest.

        Args:
            seed: of the run; without one it is drawn, from `seeds` where they are listed.
            options: `weather` and `grip` in place of the environment's own, for this episode; others
                are passed over, as PettingZoo's own tests demand.
        """
        if seed is None:
            seed = self.episodes.draw(self._draws)
        else:
            self._draws = np.random.default_rng(seed)
        chosen = {name: value for name, value in (options or {}).items() if name in OPTIONS}
        crowd = self._episode = self.episodes.begin(seed, chosen, self._episode)
        self.agents = list(crowd.names)
        self._rows = {name: i for i, name in enumerate(crowd.names)}
        observations = dict(zip(self.agents, crowd.observations.copy(), strict=True))
        return observations, {agent: {"seed": seed} for agent in self.agents}

    def step(self, actions: Mapping[str, NDArray[np.float32]]) -> tuple[Values, ...]:
        """Drives one tick; an agent without an action lets its vehicle roll.

        Returns observations, rewards, terminations, truncations and infos by agent. The info of an agent's
        last step has the sums of its terms.
        """
        if not self.agents:
            raise ConfigError("the episode is over: call reset first")
        crowd, agents = self._episode, self.agents
        rows = [self._rows[agent] for agent in agents]
        asked = np.zeros((len(crowd.names), 2))
        for agent, action in actions.items():
            asked[self._rows[agent]] = action
            if not np.isfinite(action).all():
                raise ConfigError(
                    f"action of {agent} must be two numbers from -1 to 1, got {action}"
                )
        crowd.step(asked)
        seen, ended = crowd.observations[rows], crowd.ended[rows].tolist()
        rewards = (crowd.terms @ self._rewards)[rows].tolist()
        infos: Values = {agent: {} for agent in agents}
        for agent, row, gone in zip(agents, rows, ended, strict=True):
            if gone or crowd.over:
                infos[agent]["metrics"] = dict(zip(TERMS, crowd.sums[row].tolist(), strict=True))
        found = (
            dict(zip(agents, seen, strict=True)),
            dict(zip(agents, rewards, strict=True)),
            dict(zip(agents, ended, strict=True)),
            dict.fromkeys(agents, crowd.over),
            infos,
        )
        if crowd.over:
            self.agents = []
        elif any(ended):
            self.agents = [agent for agent, gone in zip(agents, ended, strict=True) if not gone]
        return found

    def finish(self) -> Run:
        """Returns log and outcome of the present episode, as `skidpad.drive` does."""
        return self._episode.run.finish()

    def close(self) -> None:
        """Releases the worlds that were put aside."""
        self.episodes.close()
