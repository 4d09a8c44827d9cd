"""The fleet service as a process of its own, a store for it, and clients of its pages."""

from __future__ import annotations

import gzip
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from support.fleet_world import indicator_row, make_world, packed, record

WAIT_MS = 120_000


def start_fleet(data: Path, *words: str) -> tuple[subprocess.Popen, str]:
    """`skidpad fleet serve` as a process, and its address once it says it."""
    child = subprocess.Popen(
        [sys.executable, "-m", "skidpad", "fleet", "serve", "--data", str(data), "--port", "0", *words],
        stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )  # fmt: skip
    line = child.stdout.readline()
    return child, re.search(r"https?://\S+", line).group(0)


def call(method: str, url: str, **rest) -> httpx.Response:
    """One request with patience: a busy machine is no fault."""
    with httpx.Client(timeout=WAIT_MS / 1000, trust_env=False) as client:
        return client.request(method, url, **rest)


def filled(data: Path) -> dict[str, str]:
    """A store with hazards, indicators and people; their credentials by name."""
    world = make_world(data, None)
    world.clock.now = time.time()
    for k in range(3):
        name = ("red-1", "red-2", "blue-1")[k]
        hazards = [record(10 * k + i, (120.0 + i, 30.0)) for i in range(3)]
        assert world.send(name, packed(*hazards), f"batch-key-{k}").status_code == 200
        rows = gzip.compress(json.dumps(indicator_row(0, 200 + 20 * k)).encode())
        assert world.send(name, rows, f"rows-key-{k}", "indicators").status_code == 200
    world.post("red operator", "/api/v1/analyses")
    tokens = {name: account.token for name, account in world.accounts.items()}
    world.close()
    return tokens


def opened(address: str, token: str) -> str:
    answer = call("POST", f"{address}/api/v1/session", headers={"Authorization": f"Bearer {token}"})
    assert answer.status_code == 200, answer.text
    return address + answer.json()["path"]


def loaded(client: httpx.Client, path: str) -> str:
    """A page as it is sent; a busy machine may need more than NiceGUI's 3 s to fill it."""
    for _ in range(20):
        answer = client.get(path)
        assert answer.status_code == 200, (path, answer.status_code)
        if '"nav"' in answer.text:  # the head that every filled page has
            return answer.text
    raise AssertionError(f"{path} was never filled")


@contextmanager
def someone(address: str, token: str) -> Iterator[httpx.Client]:
    """A browser with a session of whose token it is."""
    with httpx.Client(
        base_url=address, timeout=WAIT_MS / 1000, trust_env=False, follow_redirects=True
    ) as client:
        client.get(opened(address, token)).raise_for_status()
        yield client
