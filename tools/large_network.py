"""Writes a road network of 10 x 10 km, and says what it costs to import and to serve.

    PYTHONPATH=src python tools/large_network.py --every 250 --out out/large

A grid of two-lane streets with sidewalks, EVERY metres apart, with a junction at each crossing. The file
is imported by `skidpad map import-carla`, read by a fresh process, loaded twice by a client of a server,
and driven on by a car for a second. Printed: seconds, those of the processor and the peak of resident memory
of each process.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import carla

from carla_world import PATIENCE_S, loaded
from mapmaker import grid
from processes import memory_mb, processor_s
from skidpad.simulation.carla_server.process import ServerProcess

SIDE = 10_000.0  # m
NAME = "large"
READ = "import sys; from skidpad.roads.bundled import load_map; load_map(sys.argv[1])"


def run(what: str, *command: str) -> None:
    """Runs a program of Python in a process of its own, and says what it took."""
    began = time.monotonic()
    process = subprocess.Popen([sys.executable, *command])
    _, status, used = os.wait4(process.pid, 0)
    seconds, mb = time.monotonic() - began, used.ru_maxrss / 1024.0
    busy = used.ru_utime + used.ru_stime
    print(f"{what}, status {status}: {seconds:.1f} s ({busy:.1f} s), peak {mb:.0f} MB", flush=True)


def main() -> None:
    """Writes, imports, reads and serves the network."""
    parser = argparse.ArgumentParser(description="A network of 10 x 10 km.")
    parser.add_argument("--every", type=float, default=250.0, help="m between streets")
    parser.add_argument("--out", type=Path, default=Path("out/large"))
    args = parser.parse_args()
    source, maps, net = args.out / "source", args.out / "maps", grid.network(NAME, SIDE, args.every)
    source.mkdir(parents=True)
    (source / f"{NAME}.xodr").write_bytes(text := net.text())
    print(f"{len(net.roads)} roads, {len(net.junctions)} junctions, {len(text) / 2**20:.1f} MiB")
    run("import", "-m", "skidpad", "map", "import-carla", str(source), "--out", str(maps))
    run("read", "-c", READ, str(maps / f"{NAME}.xodr"))
    with ServerProcess(["--maps", str(maps), "--idle-exit", "900"]) as server:
        client = carla.Client("127.0.0.1", server.port)
        client.set_timeout(1200.0)
        for what in ("served", "served again"):
            began, before = time.monotonic(), processor_s(server.pid)
            world = loaded(client, NAME)
            seconds, busy = time.monotonic() - began, processor_s(server.pid) - before
            car = world.get_blueprint_library().find("vehicle.tesla.model3")
            world.spawn_actor(car, world.get_map().get_spawn_points()[0])
            for _ in range(20):
                world.tick(PATIENCE_S)
            peak = memory_mb(server.pid, "VmHWM")
            print(f"{what}: {seconds:.1f} s ({busy:.1f} s), peak {peak:.0f} MB", flush=True)
            loaded(client, "town")
    os._exit(0)  # the wheel may abort while it ends


if __name__ == "__main__":
    main()
