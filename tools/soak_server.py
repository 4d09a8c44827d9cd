"""The CARLA server under the Traffic Manager of real clients, for hours.

    python tools/soak_server.py --drives 10 --ticks 100000 --cars 50

Every drive has a seed of its own and is cut into legs: before each leg a map is loaded and its cars are
spawned anew, and one server lives through all of it. A leg counts when its line is in OUT/server.jsonl;
started again, what is there is not driven again (the server is then another, as the line says). A client
that makes no tick for a minute hangs: its leg has failed.

    python tools/soak_server.py --drives 1 --ticks 72000 --leg 72000 --map Town04 --maps FOLDER

drives an hour on a map of one's own. `--only car` leaves lorries and buses out, which the Traffic Manager
takes through narrow crossings only by chance (carla-simulator/carla#4606).
"""

from __future__ import annotations

import argparse
import queue
import re
import socket
import subprocess
import sys
import threading
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import dated_lines
from processes import memory_mb

MAPS = ("town", "figure8", "motorway")
READY = re.compile(r"ready: CARLA \S+ on \S+:(\d+)")
WOKEN = "has missed its wake-up"
START_S = 900.0  # the first start compiles kernels
SILENCE_S = 60.0  # without a sign of life
STEP = 0.05  # s of game time
GROWTH_MB = 100.0  # that a server may gain after its first quarter


@dataclass(frozen=True)
class Leg:
    """What is driven between two map loads."""

    seed: int
    leg: int
    ticks: int
    cars: int
    map: str
    only: str  # base_type of the vehicles, "" for all with four wheels


@dataclass
class Told:
    """What its client said."""

    done: int = 0  # ticks
    spawned: int = 0
    slowest_s: float = 0.0  # of its ticks
    left: int = 0  # cars at the end
    moving: int = 0  # of these
    hung: bool = False
    said: str = ""  # last words that are none of the above

    def hear(self, line: str) -> bool:
        """Take note of a line; whether it was a sign of life."""
        words = line.split()
        if words and words[0] == "TICKS":
            self.done, self.spawned, self.slowest_s = int(words[1]), int(words[2]), float(words[3])
            return True
        if words and words[0] == "LEFT":
            self.left, self.moving = int(words[1]), int(words[2])
        elif words:
            self.said = line.strip()[-300:]
        return False


class Spoken:
    """The lines of a process, with a limit to waiting; None at its end."""

    def __init__(self, command: list[str]) -> None:
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.woken = 0  # times that a server says it woke a Traffic Manager
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.woken += WOKEN in line
            self._lines.put(line)
        self._lines.put(None)

    def line(self, patience: float) -> str | None:
        """The next line; queue.Empty when none comes in time."""
        return self._lines.get(timeout=patience)

    def end(self) -> None:
        """It is over, one way or the other."""
        self.process.kill()
        self.process.wait(30.0)
        self._reader.join(30.0)


class Server(Spoken):
    """The server that lives through all legs."""

    def __init__(self, maps: Path | None) -> None:
        options = ["-m", "skidpad", "carla-server", "--port", "0", "--strict"]
        more = [] if maps is None else ["--maps", str(maps)]
        super().__init__([sys.executable, *options, *more])
        self.began = round(time.time())
        found = None
        while found is None:
            line = self.line(START_S)
            if line is None:
                raise SystemExit("the server did not start")
            found = READY.search(line)
        self.port = int(found[1])

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self.process.poll() is None


def drive(server: Server, leg: Leg) -> dict[str, Any]:
    """Drive one leg; its line."""
    numbers = (server.port, free_port(), 100 * leg.seed + leg.leg, leg.ticks, leg.cars)
    program = Path(__file__).with_name("soak_leg.py")
    began, woken = time.monotonic(), server.woken
    client = Spoken([sys.executable, str(program), *map(str, numbers), leg.map, leg.only])
    told, patience = Told(), START_S
    try:
        while (line := client.line(patience)) is not None:
            if told.hear(line):
                patience = SILENCE_S
    except queue.Empty:
        told.hung = True
    client.end()
    return {
        **asdict(leg),
        **asdict(told),
        "ok": told.done == leg.ticks and server.alive,
        "wall_s": round(time.monotonic() - began, 1),
        "woken": server.woken - woken,
        "server": server.began,
        "memory_mb": memory_mb(server.process.pid),
    }


def free_port() -> int:
    """A port that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def soak(legs: list[Leg], file: Path, maps: Path | None) -> None:
    """Drive the legs that have no line yet."""
    done = {(d["seed"], d["leg"]) for d in dated_lines.read(file) if d["ok"]}
    server = None
    for leg in legs:
        if (leg.seed, leg.leg) in done:
            continue
        if server is None or not server.alive:
            server = Server(maps)
        dated_lines.add(file, drive(server, leg))
    if server is not None:
        server.end()


def verdict(legs: list[Leg], lines: list[dict[str, Any]]) -> tuple[bool, str]:
    """Whether every leg came to its end, nothing hung and memory stayed; and the sums in words."""
    ended = {(d["seed"], d["leg"]) for d in lines if d["ok"]}
    grown = max((growth(lines, began) for began in {d["server"] for d in lines}), default=0.0)
    ticks, hung = sum(d["done"] for d in lines), sum(d["hung"] for d in lines)
    good = not hung and grown <= GROWTH_MB and all((x.seed, x.leg) in ended for x in legs)
    return good, (
        f"{ticks} ticks, {ticks * STEP / 3600.0:.2f} h of game time, {len(lines)} map loads, "
        f"{hung} hung, {sum(d['woken'] for d in lines)} times woken, "
        f"{sum(not d['ok'] for d in lines)} of {len(lines)} legs ended early, slowest tick "
        f"{max((d['slowest_s'] for d in lines), default=0.0):g} s, "
        f"memory grew by {grown:.0f} MB after the first quarter"
    )


def growth(lines: list[dict[str, Any]], began: int) -> float:
    """MB that a server gained after the first quarter of its legs; 0 for few legs."""
    memory = [d["memory_mb"] for d in lines if d["server"] == began and d["memory_mb"]]
    quarter = len(memory) // 4
    return max(memory) - max(memory[:quarter]) if quarter else 0.0


def main() -> int:
    """1 when anything went wrong."""
    parser = argparse.ArgumentParser(description="The CARLA server for hours.")
    parser.add_argument("--out", type=Path, default=Path("out/soak"))
    parser.add_argument("--drives", type=int, default=10)
    parser.add_argument("--ticks", type=int, default=100_000, help="of a drive")
    parser.add_argument("--leg", type=int, default=10_000, help="ticks between map loads")
    parser.add_argument("--cars", type=int, default=50)
    parser.add_argument("--map", nargs="+", default=MAPS, help="maps that take turns")
    parser.add_argument("--maps", type=Path, help="a folder with .xodr files of them")
    parser.add_argument("--only", default="", help="base_type of the vehicles, such as car")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    legs = [
        Leg(
            seed,
            leg,
            min(asked.leg, asked.ticks - leg * asked.leg),
            asked.cars,
            asked.map[(seed + leg) % len(asked.map)],
            asked.only,
        )
        for seed in range(1, asked.drives + 1)
        for leg in range(-(-asked.ticks // asked.leg))
    ]
    file = asked.out / "server.jsonl"
    soak(legs, file, asked.maps)
    good, said = verdict(legs, dated_lines.read(file))
    print(said)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
