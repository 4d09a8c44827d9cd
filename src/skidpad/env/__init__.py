"""Gymnasium environments over the one loop, for learning to drive (extra `rl`).

`skidpad.env.parallel_env` lets agents drive all vehicles, as a parallel environment of PettingZoo.
Importing it registers `skidpad/Follow-v0` (pedals, lane centring steers) and `skidpad/Drive-v0`
(pedals and steer).
"""

from __future__ import annotations

from skidpad.core.errors import MissingExtra

try:
    import gymnasium
except ImportError as error:
    raise MissingExtra("skidpad.env", "rl") from error

from skidpad.env.drive_env import DriveEnv
from skidpad.env.observation import OBSERVED
from skidpad.env.reward import WEIGHTS

__all__ = ["OBSERVED", "WEIGHTS", "DriveEnv"]

for _id, _steers in (("skidpad/Follow-v0", False), ("skidpad/Drive-v0", True)):
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id,
            entry_point="skidpad.env.drive_env:DriveEnv",
            vector_entry_point="skidpad.env.vector_env:DriveVectorEnv",
            kwargs={"steers": _steers},
        )
