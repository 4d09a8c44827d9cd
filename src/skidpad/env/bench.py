"""Steps per second of processor time, resets included: `python -m skidpad.env.bench`."""

from __future__ import annotations

import time
from statistics import median

import gymnasium
import numpy as np

import skidpad.env  # noqa: F401  # registers the environments
from skidpad.env.observation import OBSERVED

REPEATS, STEPS = 7, 4000
GAP = [q.name for q in OBSERVED].index("gap")


def drive_steps(env: gymnasium.Env, steps: int) -> tuple[float, float]:
    """Returns steps per second of processor time, and the mean time of a reset in ms."""
    resets, in_resets = 0, 0.0
    begin, over = time.process_time(), True
    for _ in range(steps):
        if over:
            before = time.process_time()
            observation, _ = env.reset()
            in_resets += time.process_time() - before
            resets += 1
        pedal = min(max((observation[GAP] - 25.0) / 50.0, -1.0), 0.6)
        observation, _, terminated, truncated, _ = env.step(np.array([pedal], np.float32))
        over = terminated or truncated
    return steps / (time.process_time() - begin), 1000.0 * in_resets / resets


def main() -> None:
    """Prints medians with their range, for worlds that are built and worlds that are kept."""
    for name, seeds in (("every world new", None), ("eight worlds kept", tuple(range(1, 9)))):
        env = gymnasium.make("skidpad/Follow-v0", weather="icy_30", duration=20.0, seeds=seeds)
        drive_steps(env, 8 * 400 if seeds else 400)  # kernels are loaded, worlds are built
        found = [drive_steps(env, STEPS) for _ in range(REPEATS)]
        rates, resets = zip(*found, strict=True)
        print(
            f"{name}: {median(rates):.0f} steps/s ({min(rates):.0f} to {max(rates):.0f}), "
            f"a reset takes {median(resets):.2f} ms"
        )


if __name__ == "__main__":
    main()
