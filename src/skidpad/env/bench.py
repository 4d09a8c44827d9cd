"""Steps per second of processor time, resets included: `python -m skidpad.env.bench`.

Two kinds: one ego among 20 vehicles (steps of `skidpad/Follow-v0`), and all 21 vehicles as agents (steps
of agents, by PettingZoo's interface and by arrays). Where the time of a step goes is printed, too.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

import gymnasium
import numpy as np

import skidpad.env  # noqa: F401  # registers the environments
from skidpad.core.arrays import Floats
from skidpad.core.run import RunSpec
from skidpad.env.all_agents import AllAgentsEpisode, look
from skidpad.env.ego import EgoEpisode
from skidpad.env.episodes import E, Episodes
from skidpad.env.observation import OBSERVED, Observations, observe
from skidpad.env.parallel_env import TrafficEnv

REPEATS, STEPS, CROWD_STEPS, CALLS = 7, 4000, 1000, 400
AT = {quantity.name: i for i, quantity in enumerate(OBSERVED)}
KEPT = tuple(range(1, 9))
OPTIONS: dict[str, Any] = {"weather": "icy_30", "duration": 20.0}


def follow(seen: Observations) -> Floats:
    """Returns pedals and steers (n, 2) that keep lanes and distances, of observations (n, 12)."""
    curved = seen[:, AT["curvature"]] * (2.0 + 0.004 * seen[:, AT["speed"]] ** 2)
    steer = curved - 0.05 * seen[:, AT["lane_offset"]] - 0.6 * seen[:, AT["heading_error"]]
    pedal = np.clip((seen[:, AT["gap"]] - 15.0) / 30.0, -1.0, 0.5)
    return np.column_stack([pedal, np.clip(steer, -1.0, 1.0)])


def drive_ego(env: gymnasium.Env, steps: int) -> tuple[int, float, list[float]]:
    """Drives so many steps; returns their number, the s of processor time, and those of each reset."""
    spent, resets, over = 0.0, list[float](), True
    observation = np.zeros(len(OBSERVED), dtype=np.float32)
    for _ in range(steps):
        begin = time.process_time()
        if over:
            observation, _ = env.reset()
            resets.append(time.process_time() - begin)
        pedal = min(max((observation[AT["gap"]] - 25.0) / 50.0, -1.0), 0.6)
        observation, _, terminated, truncated, _ = env.step(np.array([pedal], np.float32))
        over = terminated or truncated
        spent += time.process_time() - begin
    return steps, spent, resets


def drive_agents(env: TrafficEnv, ticks: int) -> tuple[int, float, list[float]]:
    """Drives so many ticks by PettingZoo; returns steps of agents, s, and s of each reset.

    What the policy takes does not count.
    """
    count, spent, resets = 0, 0.0, list[float]()
    env.agents = []
    for _ in range(ticks):
        begin = time.process_time()
        if not env.agents:
            seen, _ = env.reset()
            resets.append(time.process_time() - begin)
        middle = time.process_time()
        agents = env.agents
        chosen = follow(np.array([seen[agent] for agent in agents]))
        actions = dict(zip(agents, chosen, strict=True))
        after = time.process_time()
        seen, *_ = env.step(actions)
        spent += time.process_time() - after + middle - begin
        count += len(agents)
    return count, spent, resets


def drive_arrays(env: TrafficEnv, ticks: int) -> tuple[int, float, list[float]]:
    """Drives so many ticks by arrays, as `drive_agents` does by PettingZoo."""
    count, spent, resets, crowd = 0, 0.0, list[float](), None
    rng = np.random.default_rng(1)
    for _ in range(ticks):
        begin = time.process_time()
        if crowd is None or crowd.over or crowd.ended.all():
            crowd = env.episodes.begin(env.episodes.draw(rng), None, crowd)
            resets.append(time.process_time() - begin)
        middle = time.process_time()
        actions = follow(crowd.observations)
        after = time.process_time()
        count += int((~crowd.ended).sum())
        crowd.step(actions)
        spent += time.process_time() - after + middle - begin
    if crowd is not None:
        env.episodes.put_aside(crowd)
    return count, spent, resets


def measure(drive: Callable[[int], tuple[int, float, list[float]]], steps: int) -> str:
    """Returns the median of steps per second with its range, and of a reset, as cells of a table."""
    found = [drive(steps) for _ in range(REPEATS)]
    rates = [count / spent for count, spent, _ in found]
    resets = [1e3 * one for *_, each in found for one in each]
    return (
        f"{median(rates):,.0f} ({min(rates):,.0f} to {max(rates):,.0f}) | {median(resets):.2f} ms"
    )


def parts_of(
    episode: EgoEpisode | AllAgentsEpisode, step: Callable[[], object]
) -> dict[str, float]:
    """Returns where the time of a tick goes, us of processor time: medians over calls of each part."""
    whole = _us(step)
    arena, seen = episode.world.arena, episode.observations.copy()
    parts = {"a tick": whole, "the world": _us(episode.world.step)}
    parts["observations"] = _us(lambda: observe(arena, seen))
    n = len(seen)
    room = np.zeros((n, 2)), np.zeros(n, dtype=np.int64), np.zeros((n, 6))
    parts["terms"] = _us(lambda: look(arena, seen, episode.world.dt, *room))
    return parts


def main() -> None:
    """Prints a table of both kinds, and where their time goes."""
    print("| what | steps per second of processor time | a reset |\n|---|---|---|")
    for name, seeds in (("one ego, every world new", None), ("one ego, eight worlds kept", KEPT)):
        env = gymnasium.make("skidpad/Follow-v0", seeds=seeds, **OPTIONS)
        drive_ego(env, 8 * 400 if seeds else 400)  # kernels are loaded, worlds are built
        print(f"| {name} | {measure(partial(drive_ego, env), STEPS)} |", flush=True)
    agents = TrafficEnv(seeds=KEPT, **OPTIONS)
    drive_agents(agents, 8 * 400)
    for name, drive in (("by PettingZoo", drive_agents), ("by arrays", drive_arrays)):
        print(f"| 21 agents, {name} | {measure(partial(drive, agents), CROWD_STEPS)} |", flush=True)
    ego, crowd = _episode(EgoEpisode), _episode(AllAgentsEpisode)
    for _ in range(100):
        ego.step((0.3,), {})
        crowd.step(follow(crowd.observations))
    actions = follow(crowd.observations)
    for title, parts in (
        ("one ego", parts_of(ego, lambda: ego.step((0.3,), {}))),
        ("21 agents", parts_of(crowd, lambda: crowd.step(actions))),
    ):
        print(f"{title}: " + ", ".join(f"{name} {us:.0f} us" for name, us in parts.items()))


def _episode(make: Callable[[RunSpec], E]) -> E:
    """Returns a long episode of seed 1 at its first tick."""
    return Episodes(make, weather="icy_30", duration=1000.0).begin(1, None, None)


def _us(call: Callable[[], object]) -> float:
    """Returns the median processor time of a call, us."""
    found = []
    for _ in range(CALLS):
        begin = time.process_time_ns()
        call()
        found.append((time.process_time_ns() - begin) / 1e3)
    return median(found)


if __name__ == "__main__":
    main()
