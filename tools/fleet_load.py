"""Load for the fleet's service: records from many vehicles, with kills at random moments.

    python tools/fleet_load.py --records 20000            # records per second, acknowledged
    python tools/fleet_load.py --records 20000 --kills 20 # and nothing acknowledged is lost
    python tools/fleet_load.py --vehicles 1000 --hz 1 --minutes 10 --bytes 1000 --kills 20

Without --hz batches of records are sent as fast as they are taken. With it each vehicle makes a record
at that rate, whatever becomes of those before, and sends it by itself; times are then from the moment
that a record was due until it was acknowledged, outages included. The server is a process of its own
on the same machine; a record counts when it was acknowledged, which is after its durable commit. With
kills the server is ended by SIGKILL and started again on its store; at the end the ids that were
acknowledged must be exactly those of the store, and every body must be there as it was sent. A kill
falls at a random moment: within LAG_S after a random record was acknowledged, wherever the service is
then. It ends with 1 when a record was lost or not acknowledged, or when a pace was not kept.
"""

from __future__ import annotations

import argparse
import gzip
import http.client
import json
import os
import queue
import random
import re
import secrets
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import select

from skidpad.core.maths.randomness import stream
from skidpad.fleet.identity import digest
from skidpad.fleet.service import Places, open_fleet, open_store
from skidpad.fleet.store.accounts import add_vehicle
from skidpad.fleet.store.tables import batches, hazards
from skidpad.recording.hazards.text import HEADER

HEAD = {
    "type": "ego_tailgating", "profile": "practical", "forms": "corrected", "t_start": 1.0,
    "t_end": 2.0, "t_worst": 1.5, "count": 5, "extremes": {"ttc_ahead": 1.5},
    "channels": ["a", "b"], "driving": "a", "involved": ["a", "b"], "objects": [], "flags": [],
    "context": {"map": "town"}, "cycles": 0,
}  # fmt: skip
LAG_S = 0.2  # s after a record in which a kill falls: several times what a batch takes
PACE_SLACK = 1.1  # of the planned time: until then everything that was due is acknowledged
NOISES = 64  # different worlds: more than a batch holds within reach of its compression


@dataclass(frozen=True)
class Asked:
    """What is sent. hz: records per second of each vehicle, 0: as fast as they are taken."""

    records: int
    per_batch: int
    vehicles: int
    size: int  # bytes of a record
    senders: int
    kills: int
    hz: float
    seed: int  # of the kills

    @property
    def planned_s(self) -> float:
        """Seconds in which the records become due; 0: no pace."""
        return self.records / (self.vehicles * self.hz) if self.hz else 0.0


@dataclass(frozen=True)
class Job:
    """A batch that is sent until it is acknowledged."""

    number: int  # of its first record
    due: float | None  # s, of time.perf_counter; None: when it is its turn
    body: bytes


@dataclass
class Load:
    """What is to be sent, and what came of it."""

    tokens: list[str]
    per_batch: int
    port: int = 0
    todo: queue.Queue[Job] = field(default_factory=queue.Queue)
    ids: list[str] = field(default_factory=list)
    times_ms: list[float] = field(default_factory=list)
    up: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)


@cache
def noise(number: int, size: int) -> str:
    """At least `size` characters, lines of digits that pack as real worlds do (about 1:3)."""
    rng = stream(number, "load")
    digits = " ".join(map(str, rng.integers(-9, 10, size // 2).tolist()))
    return "\n".join("O 0 " + digits[k : k + 90] for k in range(0, len(digits), 90))


def record(number: int, size: int) -> bytes:
    """A record of `size` bytes that no other number gives."""
    head = json.dumps(HEAD | {"id": f"h{number}"})
    begin, end = f"H {head}\nF 0 0 {number} 0 0 0 0\n", "\nZ\n"
    return (begin + noise(number % NOISES, size)[: size - len(begin + end)] + end).encode()


def feed(load: Load, asked: Asked) -> None:
    """In a thread: make batches, each when it is due."""
    begin = time.perf_counter()
    for first in range(0, asked.records, asked.per_batch):
        text = b"".join(record(first + k, asked.size) for k in range(asked.per_batch))
        body = gzip.compress(HEADER.encode() + b"\n" + text, 6)
        due = None
        if asked.hz:
            due = begin + first / (asked.vehicles * asked.hz)
            load.ended.wait(max(0.0, due - time.perf_counter()))
        load.todo.put(Job(first, due, body))


def send(load: Load) -> None:
    """In a thread: send what is to be sent until it is acknowledged."""
    connection: http.client.HTTPConnection | None = None
    while not load.ended.is_set():
        try:
            job = load.todo.get(timeout=0.1)
        except queue.Empty:
            continue
        batch = job.number // load.per_batch
        headers = {
            "Authorization": f"Bearer {load.tokens[batch % len(load.tokens)]}",
            "Idempotency-Key": f"load-{job.number:012d}",
        }
        begin = time.perf_counter() if job.due is None else job.due
        try:
            if connection is None:
                load.up.wait(60.0)
                connection = http.client.HTTPConnection("127.0.0.1", load.port, timeout=60.0)
            connection.request("POST", "/api/v1/batches/hazards", job.body, headers)
            answer = connection.getresponse()
            content = answer.read()
        except (OSError, http.client.HTTPException):
            connection = None
            load.todo.put(job)  # the answer was lost: the same key again
            continue
        if answer.status == 200:
            load.times_ms.append(1000.0 * (time.perf_counter() - begin))
            load.ids.extend(json.loads(content)["ids"])
        elif answer.status in (429, 503):
            load.todo.put(job)
        else:
            raise RuntimeError(f"{answer.status} {content!r}")


def start(data: Path) -> tuple[subprocess.Popen[str], int]:
    """The server as a process, and its port."""
    words = ["fleet", "serve", "--data", str(data), "--port", "0"]
    child = subprocess.Popen(
        [sys.executable, "-m", "skidpad", *words], stdout=subprocess.PIPE, text=True
    )
    line = child.stdout.readline() if child.stdout else ""
    found = re.search(r":(\d+)", line.partition("//")[2])
    if found is None:
        raise RuntimeError("the server did not start")
    return child, int(found.group(1))


def drive(load: Load, data: Path, asked: Asked) -> float:
    """Serve, send and kill until every record was acknowledged; the seconds that it took."""
    child, load.port = start(data)
    load.up.set()
    threads = [threading.Thread(target=send, args=(load,)) for _ in range(asked.senders)]
    if asked.hz:
        threads.append(threading.Thread(target=feed, args=(load, asked)))
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    rng = random.Random(asked.seed)
    moments = sorted(rng.sample(range(asked.records), asked.kills))
    while len(load.ids) < asked.records and all(t.is_alive() for t in threads[: asked.senders]):
        time.sleep(0.02)
        if moments and len(load.ids) >= moments[0]:
            moments.pop(0)
            time.sleep(rng.uniform(0.0, LAG_S))
            load.up.clear()
            os.kill(child.pid, signal.SIGKILL)
            child.wait()
            child, load.port = start(data)
            load.up.set()
    seconds = time.perf_counter() - begin
    load.ended.set()
    for thread in threads:
        thread.join()
    os.kill(child.pid, signal.SIGTERM)
    child.wait()
    return seconds


def run(data: Path, asked: Asked) -> dict[str, float]:
    """Send, kill, and compare; the numbers."""
    engine, now = open_store(Places(data=data)), time.time()
    with engine.begin() as connection:
        cars = [add_vehicle(connection, "red", "axle", f"V{k}", now) for k in range(asked.vehicles)]
    load = Load([car.token for car in cars], asked.per_batch)
    if not asked.hz:
        feed(load, asked)
    seconds = drive(load, data, asked)
    with engine.connect() as connection:
        stored = set(connection.execute(select(hazards.c.id)).scalars())
    engine.dispose()
    damaged = bodies_damaged(data)
    times = sorted(load.times_ms)
    return {
        "records": len(load.ids),
        "seconds": seconds,
        "records_per_s": len(load.ids) / seconds,
        "median_ms": times[len(times) // 2],
        "p95_ms": times[int(0.95 * len(times))],
        "p999_ms": times[int(0.999 * len(times))],
        "kills": asked.kills,
        "seed": asked.seed,
        "planned_s": asked.planned_s,
        "not_acknowledged": asked.records - len(load.ids),
        "bodies_damaged": damaged,
        "acknowledged_not_stored": len(set(load.ids) - stored),
        "stored_not_acknowledged": len(stored - set(load.ids)),
    }


def bodies_damaged(data: Path) -> int:
    """How many bodies of the store are not what their row says: it is read as a server would."""
    fleet = open_fleet(Places(data=data))
    try:
        with fleet.engine.connect() as connection:
            rows = connection.execute(select(batches)).all()
        return sum(
            digest(fleet.blobs.part(row.pack, row.start, row.size)) != row.digest for row in rows
        )
    finally:
        fleet.close()


def failed(found: dict[str, float]) -> bool:
    """Whether something was lost, or the pace was not kept."""
    lost = ("acknowledged_not_stored", "stored_not_acknowledged", "not_acknowledged")
    late = 0.0 < PACE_SLACK * found["planned_s"] < found["seconds"]
    return late or any(found[name] for name in (*lost, "bodies_damaged"))


def main() -> None:
    """Read the options, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--records", type=int, default=10_000)
    parser.add_argument("--per-batch", type=int)
    parser.add_argument("--vehicles", type=int, default=200)
    parser.add_argument("--bytes", type=int, default=20_000, help="of a record")
    parser.add_argument("--hz", type=float, default=0.0, help="records of each vehicle; 0: no pace")
    parser.add_argument("--minutes", type=float, default=10.0, help="with --hz")
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--seed", type=int, help="of the kills; without it another one each time")
    told = parser.parse_args()
    paced = told.hz > 0.0
    asked = Asked(
        records=round(told.vehicles * told.hz * 60.0 * told.minutes) if paced else told.records,
        per_batch=told.per_batch or (1 if paced else 100),
        vehicles=told.vehicles,
        size=told.bytes,
        senders=64 if paced else 4,
        kills=told.kills,
        hz=told.hz,
        seed=secrets.randbelow(2**31) if told.seed is None else told.seed,
    )
    with TemporaryDirectory() as folder:
        found = run(Path(folder), asked)
    print("; ".join(f"{name} {value:.1f}".removesuffix(".0") for name, value in found.items()))
    if failed(found):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
