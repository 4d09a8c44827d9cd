"""Load for the fleet's service: records of about 20 kB from many vehicles, with kills at random moments.

    python tools/fleet_load.py --records 20000            # records per second, acknowledged
    python tools/fleet_load.py --records 20000 --kills 20 # and nothing acknowledged is lost

The server is a process of its own on the same machine; a record counts when it was acknowledged, which
is after its durable commit. With kills the server is ended by SIGKILL and started again on its store;
at the end the ids that were acknowledged must be exactly those of the store.
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
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import select

from skidpad.core.randomness import stream
from skidpad.fleet.service import Places, open_store
from skidpad.fleet.store.accounts import add_vehicle
from skidpad.fleet.store.tables import hazards
from skidpad.recording.hazard_text import HEADER

HEAD = {
    "type": "ego_tailgating", "profile": "practical", "forms": "corrected", "t_start": 1.0,
    "t_end": 2.0, "t_worst": 1.5, "count": 5, "extremes": {"ttc_ahead": 1.5},
    "channels": ["a", "b"], "driving": "a", "involved": ["a", "b"], "objects": [], "flags": [],
    "context": {"map": "town"}, "cycles": 0,
}  # fmt: skip
BYTES = 20_000  # of a record
SENDERS = 4


@dataclass
class Load:
    """What is sent, and what came of it."""

    tokens: list[str]
    port: int = 0
    todo: queue.Queue[tuple[int, bytes]] = field(default_factory=queue.Queue)
    ids: list[str] = field(default_factory=list)
    times_ms: list[float] = field(default_factory=list)
    up: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)


def record(number: int) -> bytes:
    """A record whose worlds are noise of digits, so that it packs as real ones do (about 1:3)."""
    rng = stream(number, "load")
    digits = " ".join(map(str, rng.integers(-9, 10, BYTES // 3).tolist()))
    lines = "\n".join("O 0 " + digits[k : k + 90] for k in range(0, len(digits), 90))
    head = json.dumps(HEAD | {"id": f"h{number}"})
    return f"H {head}\nF 0 0 {number} 0 0 0 0\n{lines}\nZ\n".encode()


def send(load: Load) -> None:
    """In a thread: send what is to be sent until it is acknowledged."""
    connection: http.client.HTTPConnection | None = None
    while not load.ended.is_set():
        try:
            number, body = load.todo.get(timeout=0.1)
        except queue.Empty:
            continue
        headers = {
            "Authorization": f"Bearer {load.tokens[number % len(load.tokens)]}",
            "Idempotency-Key": f"load-{number:012d}",
        }
        begin = time.perf_counter()
        try:
            if connection is None:
                load.up.wait(60.0)
                connection = http.client.HTTPConnection("127.0.0.1", load.port, timeout=60.0)
            connection.request("POST", "/api/v1/batches/hazards", body, headers)
            answer = connection.getresponse()
            content = answer.read()
        except (OSError, http.client.HTTPException):
            connection = None
            load.todo.put((number, body))  # the answer was lost: the same key again
            continue
        if answer.status == 200:
            load.times_ms.append(1000.0 * (time.perf_counter() - begin))
            load.ids.extend(json.loads(content)["ids"])
        elif answer.status in (429, 503):
            load.todo.put((number, body))
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


def drive(load: Load, data: Path, records: int, kills: int) -> float:
    """Serve, send and kill until every record was acknowledged; the seconds that it took."""
    child, load.port = start(data)
    load.up.set()
    threads = [threading.Thread(target=send, args=(load,)) for _ in range(SENDERS)]
    rng, begin = random.Random(1), time.perf_counter()
    for thread in threads:
        thread.start()
    left = kills
    while len(load.ids) < records and all(thread.is_alive() for thread in threads):
        time.sleep(0.02)
        if left and rng.random() < 0.02:
            left -= 1
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


def run(data: Path, records: int, per_batch: int, kills: int) -> dict[str, float]:
    """Send, kill, and compare; the numbers."""
    engine = open_store(Places(data=data))
    with engine.begin() as connection:
        accounts = [
            add_vehicle(connection, "red", "axle", f"V{k}", time.time()) for k in range(200)
        ]
    load = Load([account.token for account in accounts])
    for first in range(0, records, per_batch):
        text = b"".join(record(first + k) for k in range(per_batch))
        load.todo.put((first, gzip.compress(HEADER.encode() + b"\n" + text, 6)))
    seconds = drive(load, data, records, kills)
    with engine.connect() as connection:
        stored = set(connection.execute(select(hazards.c.id)).scalars())
    engine.dispose()
    times = sorted(load.times_ms)
    return {
        "records": len(load.ids),
        "records_per_s": len(load.ids) / seconds,
        "median_ms": times[len(times) // 2],
        "p95_ms": times[int(0.95 * len(times))],
        "kills": kills,
        "acknowledged_not_stored": len(set(load.ids) - stored),
        "stored_not_acknowledged": len(stored - set(load.ids)),
    }


def main() -> None:
    """Read the options, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--records", type=int, default=10_000)
    parser.add_argument("--per-batch", type=int, default=100)
    parser.add_argument("--kills", type=int, default=0)
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        found = run(Path(folder), options.records, options.per_batch, options.kills)
    for name, value in found.items():
        print(f"{name:<26}{value:.1f}")
    if found["acknowledged_not_stored"] or found["stored_not_acknowledged"]:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
