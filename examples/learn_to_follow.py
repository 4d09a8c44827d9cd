"""Trains ten numbers to follow on ice and compares them with a constant headway on seeds that were not trained on.

python examples/learn_to_follow.py --close-cost 0.2
"""

import argparse
import time
from statistics import mean, median

import gymnasium
import numpy as np
from cmaes import CMA

from skidpad.env import OBSERVED
from skidpad.evidence.statistics import compare_pairs, share_bound
from skidpad.evidence.statistics_text import interval_text

AT = {quantity.name: i for i, quantity in enumerate(OBSERVED)}
TRAINING, UNSEEN = range(1, 7), 1001
CLOSE = 1.5  # s of headway
# pedal per: 1, m/s below the limit, m/s^2 in the bend, m/s of slip, 10 m/s; then the same behind a vehicle,
# with m beyond 5 m and 1.5 s, and m/s that the gap opens with. As it stands it keeps this headway.
HEADWAY = np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.05, 0.2, 0.0, 0.0])
SPREAD = np.array([0.2, 0.1, 0.05, 0.1, 0.1, 0.2, 0.02, 0.1, 0.1, 0.1])


def choose_pedal(weights, seen):
    """Returns the pedal, -1 to 1: the smaller of what the limit and what the vehicle ahead ask for."""
    v, slip = seen[AT["speed"]], seen[AT["wheel_slip"]]
    bend = abs(seen[AT["curvature"]]) * v * v
    pedal = weights[:5] @ (1.0, seen[AT["limit"]] - v, bend, slip, v / 10.0)
    if seen[AT["has_lead"]]:
        beyond = seen[AT["gap"]] - 5.0 - 1.5 * v
        behind = weights[5:] @ (1.0, beyond, -seen[AT["closing_speed"]], slip, v / 10.0)
        pedal = min(pedal, behind)
    return np.clip([pedal], -1.0, 1.0).astype(np.float32)


def drive(env, weights, seed):
    """Drives an episode; returns its metrics, whether it ended early, median headway in s, share of time too close."""
    seen, _ = env.reset(seed=seed)
    over, headways = False, []
    while not over:
        seen, _, terminated, truncated, info = env.step(choose_pedal(weights, seen))
        over = terminated or truncated
        if seen[AT["has_lead"]] and seen[AT["speed"]] > 3.0:
            headways.append(seen[AT["gap"]] / seen[AT["speed"]])
    close = sum(h < CLOSE for h in headways) / max(len(headways), 1)
    return {
        **info["metrics"],
        "ended": terminated,
        "headway": median(headways or [np.nan]),
        "close": close,
    }


def score(env, weights, close_cost):
    """Returns the mean over the seeds of training of the distance in km less what it cost.

    close_cost: km for all the time closer than CLOSE. An episode that ended early costs 1 km.
    """
    episodes = [drive(env, weights, seed) for seed in TRAINING]
    return mean(e["distance_km"] - close_cost * e["close"] - float(e["ended"]) for e in episodes)


def train(env, generations, close_cost):
    """Returns the mean of the last generation of a covariance matrix adaptation (CMA-ES)."""
    search = CMA(mean=np.zeros(10), sigma=1.0, seed=1, population_size=20)
    for generation in range(generations):
        tried = [search.ask() for _ in range(search.population_size)]
        scores = [score(env, HEADWAY + SPREAD * one, close_cost) for one in tried]
        search.tell([(one, -s) for one, s in zip(tried, scores, strict=True)])
        print(f"generation {generation + 1}: best {max(scores):.3f} km", flush=True)
    return HEADWAY + SPREAD * search.mean


def tell(name, episodes):
    """Prints what a driver did on the unseen seeds."""
    hit, n = sum(e["contacts"] > 0 for e in episodes), len(episodes)
    print(
        f"{name}: contact in {hit} of {n} drives (at most {100 * share_bound(hit, n):.0f} %), "
        f"{mean(e['distance_km'] for e in episodes):.3f} km, {median(e['headway'] for e in episodes):.1f} s headway, "
        f"{100 * mean(e['close'] for e in episodes):.0f} % of the time below {CLOSE} s"
    )


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--generations", type=int, default=15)
    options.add_argument("--close-cost", type=float, default=0.0, help="km for driving too close")
    options.add_argument("--weather", default="icy_70")
    options.add_argument("--duration", type=float, default=60.0, help="s of a drive")
    options.add_argument("--drives", type=int, default=40, help="unseen seeds")
    chosen = options.parse_args()
    world = {"weather": chosen.weather, "traffic": "pack", "duration": chosen.duration}
    known = gymnasium.make("skidpad/Follow-v0", **world, seeds=TRAINING)
    learned = train(known, chosen.generations, chosen.close_cost)
    print("weights", learned.round(3).tolist())
    print(f"{time.process_time():.0f} s of processor time")
    env = gymnasium.make("skidpad/Follow-v0", **world)
    unseen = range(UNSEEN, UNSEEN + chosen.drives)
    old, new = ([drive(env, w, seed) for seed in unseen] for w in (HEADWAY, learned))
    tell("constant headway", old)
    tell("learned", new)
    gain = compare_pairs(
        [b["distance_km"] - a["distance_km"] for a, b in zip(old, new, strict=True)]
    )
    print(
        f"learned minus constant headway: {1000.0 * gain.mean:+.1f} m, in km {interval_text(gain.interval, gain.n)}"
    )
