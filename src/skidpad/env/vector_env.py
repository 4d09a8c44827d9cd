"""Several egos, each in a world of its own, as one vector environment of Gymnasium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.errors import ConfigError
from skidpad.env.ego import EgoEpisode
from skidpad.env.episodes import Course, Episodes
from skidpad.env.observation import HIGH, LOW, Observations
from skidpad.env.reward import TERMS, WEIGHTS, weigh

if TYPE_CHECKING:
    from typing_extensions import Unpack


class DriveVectorEnv(VectorEnv):  # type: ignore[misc]
    """Drives `num_envs` egos as `DriveEnv` drives one, in this process; `gymnasium.make_vec` makes it.

    An environment whose episode is over begins the next one at its next step, which gives the reward 0.
    Worlds of listed seeds are shared by all. The other arguments are those of `DriveEnv`.

    Example:
        >>> many = gymnasium.make_vec("skidpad/Follow-v0", num_envs=8, weather="icy_30", seeds=range(1, 9))
        >>> observations, infos = many.reset(seed=1)
        >>> observations, rewards, *_ = many.step(np.zeros((8, 1), dtype=np.float32))
    """

    metadata: ClassVar[dict[str, Any]] = {
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        steers: bool = False,
        rewards: Mapping[str, float] = WEIGHTS,
        render_mode: None = None,
        **course: Unpack[Course],
    ) -> None:
        if num_envs < 1:
            raise ConfigError(f"num_envs must be at least 1, got {num_envs}")
        self.num_envs, self.render_mode, self._rewards = num_envs, render_mode, weigh(rewards)
        self.single_observation_space = spaces.Box(LOW, HIGH, dtype=np.float32)
        self.single_action_space = spaces.Box(-1.0, 1.0, (2 if steers else 1,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.episodes = Episodes(EgoEpisode, **course)
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._present: list[EgoEpisode | None] = [None] * num_envs
        self._over = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins an episode in every environment.

        Args:
            seed: of the first one's run, the others count on from it; or one for each. None: drawn.
            options: `weather` and `grip` in place of the environments' own, for these episodes.
        """
        each = [None if seed is None else seed + i for i in range(self.num_envs)] if (
            seed is None or isinstance(seed, int)
        ) else list(seed)  # fmt: skip
        if len(each) != self.num_envs:
            raise ConfigError(f"seed: {self.num_envs} are needed, got {len(each)}")
        seeds = np.zeros(self.num_envs, dtype=np.int64)
        for i, given in enumerate(each):
            if given is not None:
                self._rngs[i], _ = seeding.np_random(given)
            seeds[i] = self._begin(i, given, options)
        self._over[:] = False
        return self._observe(), _note("seed", seeds, np.ones(self.num_envs, dtype=np.bool_))

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observations, Floats, Flags, Flags, dict[str, Any]]:
        """Drives one tick in every environment; one whose episode was over begins the next instead."""
        n = self.num_envs
        rewards, seeds = np.zeros(n), np.zeros(n, dtype=np.int64)
        terminated, truncated = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
        begun = self._over
        for i, action in enumerate(np.asarray(actions).tolist()):
            if begun[i]:
                seeds[i] = self._begin(i, None, None)
            else:
                rewards[i], terminated[i], truncated[i] = self.episode(i).step(
                    action, self._rewards
                )
        self._over = terminated | truncated
        infos = _note("seed", seeds, begun) | self._infos(~begun)
        return self._observe(), rewards, terminated, truncated, infos

    def close_extras(self, **kwargs: Any) -> None:
        """Releases all worlds that are kept."""
        del kwargs
        for i, last in enumerate(self._present):
            if last is not None:
                self.episodes.put_aside(last)
                self._present[i] = None
        self.episodes.close()

    def _begin(self, i: int, seed: int | None, options: dict[str, Any] | None) -> int:
        """Begins an episode in an environment and returns its seed; None: it is drawn."""
        seed = self.episodes.draw(self._rngs[i]) if seed is None else seed
        self._present[i] = self.episodes.begin(seed, options, self._present[i])
        return seed

    def episode(self, i: int) -> EgoEpisode:
        """Returns the present episode of an environment: its run, world and sums of terms.

        ConfigError before the first reset.
        """
        found = self._present[i]
        if found is None:
            raise ConfigError("there is no episode yet: call reset first")
        return found

    def _observe(self) -> Observations:
        """Returns what all egos observe."""
        found = [self.episode(i).observations for i in range(self.num_envs)]
        return np.concatenate(found)

    def _infos(self, driven: Flags) -> dict[str, Any]:
        """Returns the infos of a step, as `DriveEnv` has them, with masks of environments that have them."""
        episodes = [self.episode(i) for i in range(self.num_envs)]
        infos = _note("t", np.array([one.t for one in episodes]), driven)
        infos |= _note("terms", _by_name([one.terms for one in episodes]), driven)
        return infos | _note("metrics", _by_name([one.sums for one in episodes]), self._over)


def _by_name(rows: Sequence[Sequence[float]]) -> dict[str, Floats]:
    """Returns (n,) of each term."""
    return dict(zip(TERMS, np.array(rows).T, strict=True))


def _note(name: str, values: Any, has: Flags) -> dict[str, Any]:
    """Returns an info, and the mask of environments that have it; {} where none has."""
    return {name: values, f"_{name}": has.copy()} if has.any() else {}
