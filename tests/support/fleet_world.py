"""A small fleet for tests: two operators, two makers, a settable clock, records made by hand."""

from __future__ import annotations

import gzip
import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from skidpad.core.channels import Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.recording.hazards.records import HazardRecord, InvolvedObject, encode_record
from skidpad.recording.hazards.text import HEADER
from support.channel_worlds import frame
from support.programs import require_program

NOW = 1_790_000_000.0


class Clock:
    """Stands still until it is told."""

    def __init__(self, now: float = NOW) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


def record(
    number: int = 1,
    place: tuple[float, float] = (120.0, 30.0),
    hazard: HazardType = HazardType.EGO_TAILGATING,
    **words: str,
) -> HazardRecord:
    """A car ahead that the ego closes in on, as two channels saw it for two seconds."""
    x, y = place
    closing = 6.0 + 0.01 * number
    worlds = []
    for k in range(20):
        t = k * 0.1
        ego = (x - 30.0 + 12.0 * t, y, 0.0, 12.0, 0.0)
        ahead = [(x - 10.0 + (12.0 - closing) * t, y, 0.0, 12.0 - closing, 0.0)]
        worlds.append(Cycle(k, t, tuple(frame(t, ego, ahead, ids=[7]) for _ in range(2)), 0))
    context = {"map": "town", "route": "route-1", "sun_altitude_deg": "45", "precipitation": "0"}
    return HazardRecord(
        id=f"h{number:04d}", type=hazard, profile="practical", forms="corrected",
        t_start=1.0, t_end=1.5, t_worst=1.2, count=5, extremes={"ttc_ahead": 1.5},
        channels=("a", "b"), driving="a", involved=("a", "b"),
        objects=(InvolvedObject("a", 7, x, y),), context=context | words, worlds=tuple(worlds),
    )  # fmt: skip


def text_of(*records: HazardRecord) -> bytes:
    return (HEADER + "\n" + "".join(map(encode_record, records))).encode("ascii")


def packed(*records: HazardRecord) -> bytes:
    return gzip.compress(text_of(*records), mtime=0)


@dataclass
class World:
    """A fleet, a client of its interface, and a credential for everyone by name."""

    fleet: object
    client: object
    clock: Clock
    accounts: dict[str, object] = field(default_factory=dict)

    def close(self) -> None:
        self.client.close()
        self.fleet.close()

    def headers(self, name: str | None) -> dict[str, str]:
        return {} if name is None else {"Authorization": f"Bearer {self.accounts[name].token}"}

    def get(self, name, path, **params):
        return self.client.get(path, headers=self.headers(name), params=params)

    def post(self, name, path, **rest):
        headers = self.headers(name) | rest.pop("headers", {})
        return self.client.post(path, headers=headers, **rest)

    def send(self, name, body: bytes, key: str = "key-0000-1", kind: str = "hazards", **headers):
        more = {"Idempotency-Key": key} | headers
        return self.post(name, f"/api/v1/batches/{kind}", content=body, headers=more)


def make_world(data: Path, database: str | None) -> World:
    from starlette.testclient import TestClient

    from skidpad.fleet.api.app import make_app
    from skidpad.fleet.service import Places, open_fleet
    from skidpad.fleet.store.accounts import add_person, add_vehicle
    from skidpad.fleet.words import Role
    from skidpad.scenarios.export.hazard_export import export_hazard

    clock = Clock()
    fleet = open_fleet(Places(data=data, database=database), clock, exporter=export_hazard)
    accounts = {}
    with fleet.engine.begin() as connection:
        for operator, maker in (("red", "axle"), ("blue", "bolt")):
            for k in (1, 2):
                name = f"{operator}-{k}"
                accounts[name] = add_vehicle(connection, operator, maker, name, NOW)
            for role in (Role.OPERATOR, Role.TELEOPERATOR):
                name = f"{operator} {role.value}"
                accounts[name] = add_person(connection, operator, role, name, NOW)
            accounts[maker] = add_person(connection, maker, Role.MANUFACTURER, maker, NOW)
        for role in (Role.AUTHORITY, Role.RESEARCHER):
            accounts[role.value] = add_person(connection, "state", role, role.value, NOW)
    client = TestClient(make_app(fleet), raise_server_exceptions=False)
    return World(fleet, client, clock, accounts)


@dataclass
class PostgresqlServer:
    """A running server; `fresh` gives an empty database each time."""

    folder: Path
    binaries: Path
    user: str
    made: int = 0

    def fresh(self) -> str:
        self.made += 1
        name = f"fleet{self.made}"
        self.run("createdb", "-h", str(self.folder), "-U", "skidpad", name)
        return f"postgresql://skidpad@/{name}?host={self.folder}"

    def run(self, program: str, *words: str) -> None:
        as_user = {"user": self.user} if os.getuid() == 0 else {}
        done = subprocess.run(  # noqa: PLW1510  # its output is the error's text
            [self.binaries / program, *words], capture_output=True, text=True, cwd="/",
            env={"LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"}, timeout=300, **as_user,
        )  # fmt: skip
        if done.returncode:
            raise RuntimeError(f"{program}: {done.stdout}{done.stderr}")


def postgresql_server() -> Iterator[PostgresqlServer]:
    binaries = Path(require_program("initdb", "postgresql")).resolve().parent
    pytest.importorskip("psycopg", reason="psycopg, for postgresql, is not installed")
    folder = Path(tempfile.mkdtemp(prefix="skidpad-pg-", dir="/tmp"))  # a socket's path is short
    server = PostgresqlServer(folder, binaries, "nobody")
    if os.getuid() == 0:
        os.chown(folder, pwd.getpwnam("nobody").pw_uid, -1)
    store = str(folder / "store")
    server.run("initdb", "-D", store, "-U", "skidpad", "-A", "trust", "-N")
    options = f"-c listen_addresses='' -c unix_socket_directories={folder} -c shared_buffers=32MB"
    server.run(
        "pg_ctl", "-D", store, "-w", "-t", "120", "-l", str(folder / "log"), "-o", options, "start"
    )
    try:
        yield server
    finally:
        server.run("pg_ctl", "-D", store, "-w", "-m", "immediate", "stop")
        shutil.rmtree(folder, ignore_errors=True)


__all__ = [
    "NOW",
    "Clock",
    "World",
    "make_world",
    "packed",
    "postgresql_server",
    "record",
]


@contextmanager
def mosquitto(folder, more="allow_anonymous true\n"):
    """A real broker; the port may be taken between finding and using it, so it is tried again."""
    program = require_program("mosquitto", "mosquitto")
    for _ in range(5):
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
        config = folder / "mosquitto.conf"
        config.write_text(f"listener {port} 127.0.0.1\npersistence false\n{more}")
        with subprocess.Popen(
            [program, "-c", str(config), "-v"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as child:
            for line in child.stdout:
                if "running" in line:
                    break
            else:
                continue  # it ended: the port was taken
            drain = threading.Thread(target=child.stdout.read)
            drain.start()
            try:
                yield port
            finally:
                child.terminate()
                drain.join()
            return
    raise AssertionError("mosquitto did not start")


def indicator_row(
    minute=0, violated=0, n=600, indicator="ego_location_similarity", mean=0.9
) -> dict:
    return {"minute": minute, "subject": "a+b", "indicator": indicator, "n": n,
            "violated": violated, "mean": mean, "least": 0.1, "greatest": 1.0}  # fmt: skip
