"""How often a batch is answered that destroys stopped sensors and ticks: the clean-up of training programs.

    PYTHONPATH=src python tools/carla_batches.py --trials 200

60 cars with a listened collision sensor each are stopped and destroyed by one batch that ticks. A trial
fails when its answer has not come within 10 s.
"""

from __future__ import annotations

import argparse
import os
import time
from typing import Any

import carla

from carla_world import PATIENCE_S, hear_collisions, loaded, spread
from skidpad.simulation.carla_server.process import ServerProcess

CARS = 60
ANSWER_S = 10.0


def destroy(client: Any, trials: int) -> None:
    """Prints how many ticking batches were answered, and the longest time of one."""
    world = loaded(client, "town")
    client.set_timeout(ANSWER_S)
    answered, longest = 0, 0.0
    for k in range(1, trials + 1):
        cars = spread(client, world, "vehicle.tesla.model3", 0, CARS)
        sensors = hear_collisions(world, cars, [].append)
        world.tick()
        for sensor in sensors:
            sensor.stop()
        began = time.monotonic()
        try:
            client.apply_batch_sync([carla.command.DestroyActor(a) for a in sensors + cars], True)
            answered += 1
        except RuntimeError as error:
            print(f"trial {k}: {error}", flush=True)
        longest = max(longest, time.monotonic() - began)
        world.tick(PATIENCE_S)
        if k % 20 == 0 or k == trials:
            print(
                f"{answered} of {k} answered, {len(cars)} cars, longest {longest:.2f} s", flush=True
            )


def main() -> None:
    """Runs the trials on a server of its own."""
    parser = argparse.ArgumentParser(description="Batches that destroy stopped sensors and tick.")
    parser.add_argument("--trials", type=int, default=200)
    with ServerProcess(["--idle-exit", "600"]) as server:
        client = carla.Client("127.0.0.1", server.port)
        client.set_timeout(PATIENCE_S)
        destroy(client, parser.parse_args().trials)
    os._exit(0)  # the wheel may abort while it ends


if __name__ == "__main__":
    main()
