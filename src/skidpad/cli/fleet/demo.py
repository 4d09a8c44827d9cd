"""The demo of the fleet: simulated vehicles drive, report, and get a good and a bad update.

Everything goes through the service as it would from a road: enrolment, spool, upload, off-line keys,
signed updates, stages and looks. Nothing is scripted: what each rule set finds is computed from what
the channels reported on seeds that no earlier step has seen, and the looks decide.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from skidpad.core.errors import BackendError

if TYPE_CHECKING:
    from httpx import Client

OPERATORS = ("Red Cabs", "Blue Vans")
MAKER = "Axle"
ROUTES = ("route-1", "route-3", "route-5")
SEED = 7000  # of the first drive; every later drive has the next one
PLAN = {"stages": [0.34, 1.0], "least_drives": 6, "looks": 1, "margin": 0.25}
ROUNDS_MAX = 40
LOOSER = (
    ("front_deficit > 0", "front_deficit > -15"), ("rear_deficit > 0", "rear_deficit > -15"),
    ("offset_chi2 > 27.6", "offset_chi2 > 6"), ("safety_score < 0.8", "safety_score < 0.99"),
)  # fmt: skip


def rule_sets() -> dict[str, bytes]:
    """Returns the rules that vehicles come with (as printed), better ones (tracked), and worse ones."""
    import yaml

    source = resources.files("skidpad.evidence.channels").joinpath("hazard_rules.yaml")
    table = yaml.safe_load(source.read_text(encoding="utf-8"))
    tracked = json.dumps({"tracked": table["tracked"]})
    looser = tracked
    for old, new in LOOSER:
        looser = looser.replace(old, new)
    published = json.dumps({"as_printed": table["as_printed"]})
    return {
        "published": published.encode(),
        "tracked": tracked.encode(),
        "looser": looser.encode(),
    }


@dataclass(frozen=True, slots=True)
class Job:
    """One drive of one vehicle."""

    folder: Path
    route: str
    seed: int
    seconds: float
    active: bytes  # rules that it runs
    before: bytes  # rules that it would run otherwise


def drive(job: Job) -> tuple[int, int]:
    """Drives a job and monitors it under the active rules; returns errors under these and the others.

    The recording is deleted, what the monitor wrote stays.
    """
    from skidpad.campaign.channels.drive import drive_segment
    from skidpad.campaign.channels.routes import driven_routes
    from skidpad.fleet.loop.judging import errors_of
    from skidpad.fleet.updates.payloads import PayloadKind, read_payload_content
    from skidpad.live.watch import watch
    from skidpad.recording.channels.cycles import cycles
    from skidpad.recording.sources import open_channels

    job.folder.mkdir(parents=True)
    recording = job.folder / "drive.mcap"
    spec = structs.replace(driven_routes()[job.route], duration=job.seconds, seed=job.seed)
    drive_segment(spec, recording)
    active = read_payload_content(PayloadKind.RULES, job.active)
    before = read_payload_content(PayloadKind.RULES, job.before)
    watch(open_channels(recording, None, truth=False), job.folder, active)
    source = open_channels(recording, None, truth=False)
    new, old = errors_of(list(cycles(source)), source.channels, [active, before])
    recording.unlink()
    return new.total, old.total


@dataclass(slots=True)
class Car:
    """A vehicle with its credential, spool and installed updates."""

    name: str
    token: str
    folder: Path
    drives: int = 0


@dataclass(slots=True)
class Demo:
    """Holds the demo's fleet: its address, credentials, vehicles and payloads."""

    out: Path
    address: str
    maker: str  # the manufacturer's credential
    cars: list[Car]
    seconds: float
    drives: Callable[[list[Job]], list[tuple[int, int]]]  # drives jobs, in workers or here
    say: Callable[[str], None]
    next_seed: int = SEED
    payloads: dict[str, bytes] = field(default_factory=dict)  # by name, "": what cars come with

    def client(self, token: str, timeout: float = 600.0) -> Client:
        """Returns a connection to the service with a credential; timeout: of each request, s."""
        import httpx

        headers = {"Authorization": f"Bearer {token}"}
        return httpx.Client(
            base_url=self.address, headers=headers, timeout=timeout, trust_env=False
        )

    def call(self, token: str, method: str, path: str, body: Any = None) -> Any:
        """Sends one request with a credential and returns the answer; BackendError unless it is 200."""
        content = None if body is None else json.dumps(body)
        with self.client(token) as client:
            answer = client.request(method, path, content=content)
        if answer.status_code != 200:
            raise BackendError(f"{method} {path}: {answer.status_code} {answer.text}")
        return answer

    def round(self, release: str = "") -> list[tuple[int, int]]:
        """Lets vehicles install, drive once and report; returns (errors, errors before) by drive.

        release: only vehicles that run it; "": all.
        """
        jobs: list[tuple[Car, str, Job]] = []
        for k, car in enumerate(self.cars):
            told = self.call(car.token, "GET", "/api/v1/updates/assignment").json()
            if release and told["release"] != release:
                continue
            if told["payload"]:
                self.install(car, told["payload"])
            job = Job(
                car.folder / f"drive-{car.drives}", ROUTES[k % len(ROUTES)], self.next_seed,
                self.seconds, self.payloads[told["payload"]], self.payloads[told["before"]],
            )  # fmt: skip
            jobs.append((car, told["release"], job))
            car.drives, self.next_seed = car.drives + 1, self.next_seed + 1
        errors = self.drives([job for _, _, job in jobs])
        for (car, under, job), found in zip(jobs, errors, strict=True):
            self.report(car, job.folder, under, found if under else None)
        return errors

    def install(self, car: Car, name: str) -> None:
        """Fetches an update as a vehicle does, checked by the pinned root; BackendError for another one."""
        from skidpad.fleet.updates.client import UpdateClient

        root = (self.out / "offline" / "root.json").read_bytes()
        with self.client(car.token) as client:
            updates = UpdateClient(car.folder / "updates", root, partial(client.stream, "GET"))
            path = updates.fetch(name)
        if path.read_bytes() != self.payloads[name]:
            raise BackendError(f"{car.name} fetched another update than was signed")

    def report(self, car: Car, folder: Path, release: str, judged: tuple[int, int] | None) -> None:
        """Spools and sends what the monitor wrote; BackendError when a batch waits or is refused."""
        from skidpad.fleet.monitored import spool_folder
        from skidpad.fleet.spool import Spool
        from skidpad.fleet.uploader import TIMEOUT_S, poster, send

        spool = Spool(car.folder / "spool")
        spool_folder(spool, folder, release, judged)
        with self.client(car.token, TIMEOUT_S) as client:
            sent = send(spool, poster(client))
        if sent.waiting or sent.refused:
            raise BackendError(f"{car.name}: {sent.waiting} batches wait, {sent.refused} refused")

    def roll_out(self, title: str, content: bytes, hazards: Sequence[str]) -> dict[str, Any]:
        """Proposes, signs and releases a change, and drives on unseen seeds until the looks have decided.

        content: rules; hazards: ids that led to it. Returns the release as it stands, after ROUNDS_MAX
        rounds also undecided.
        """
        import base64

        from skidpad.fleet.updates.payloads import PayloadKind, payload_name

        text = {
            "kind": "rules", "payload": base64.b64encode(content).decode(), "reason": title,
            "hazards": list(hazards),
        }  # fmt: skip
        change = self.call(self.maker, "POST", "/api/v1/changes", text).json()["change"]
        targets = base64.b64encode(self.sign_list(content)).decode()
        order = {"change": change, "targets": targets, "plan": PLAN}
        release = self.call(self.maker, "POST", "/api/v1/releases", order).json()["release"]
        self.payloads[payload_name(PayloadKind.RULES, content)] = content
        before = self.payloads[self.releases()[-1]["before"]]
        said, state = 0, dict[str, Any]()
        for _ in range(ROUNDS_MAX):
            self.round(release)
            state = self.look_at_release(release)
            looks = [e["detail"] for e in state["events"] if e["what"] == "looked"]
            for finding in looks[said:]:
                self.say(f"  {title}: {_finding(finding)}")
            said = len(looks)
            if state["ended"]:
                break
        old = {"kind": "rules", "payload": base64.b64encode(before).decode()}
        scenes = self.call(self.maker, "POST", f"/api/v1/changes/{change}/evaluate", old).json()
        then, now = (sum(s[k] for s in scenes) for k in ("errors_before", "errors_after"))
        self.say(
            f"  {title}: on the {len(scenes)} scenes behind it {then} errors before, {now} after"
        )
        return state

    def look_at_release(self, release: str) -> dict[str, Any]:
        """Looks at a release and returns it; the service looks by itself too, so it may have ended."""
        with suppress(BackendError):
            self.call(self.maker, "POST", f"/api/v1/releases/{release}/look")
        return next(r for r in self.releases() if r["release"] == release)

    def sign_list(self, content: bytes) -> bytes:
        """Returns the list with the new update, signed by two of the three keys, as off line."""
        import time

        from skidpad.fleet.updates import signing
        from skidpad.fleet.updates.payloads import PayloadKind, payload_name

        current = self.call(self.maker, "GET", "/api/v1/update-list").content
        keys = [signing.load_key(self.out / "offline" / f"targets-{k}.key") for k in (1, 3)]
        name = payload_name(PayloadKind.RULES, content)
        return signing.add_target(current, (name, content), {}, keys, time.time())

    def releases(self) -> list[dict[str, Any]]:
        """Returns all releases so far."""
        found: list[dict[str, Any]] = self.call(self.maker, "GET", "/api/v1/releases").json()
        return found


@contextmanager
def pool(workers: int) -> Iterator[Callable[[list[Job]], list[tuple[int, int]]]]:
    """Yields a function that drives jobs in processes of their own and returns errors by job."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as running:
        yield lambda jobs: list(running.map(drive, jobs))


def _finding(f: dict[str, Any]) -> str:
    """Returns a finding on a roll-out as one line of text."""
    return (
        f"{f['decision']} after {f['drives']} drives, {f['mean']:+.2f} errors per drive, "
        f"p worse {f['p_worse']:.2g}, p no worse {f['p_no_worse']:.2g} ({f['reason']})"
    )


def enrol_fleet(out: Path, n: int) -> tuple[str, str, list[Car]]:
    """Makes the store, the off-line keys and n vehicles; returns credentials of maker, operator, cars."""
    import time

    from skidpad.fleet.service import Places, open_fleet
    from skidpad.fleet.store.accounts import add_person, add_vehicle
    from skidpad.fleet.words import Role

    fleet = open_fleet(Places(data=out / "data"))
    now = time.time()
    try:
        with fleet.engine.begin() as connection:
            maker = add_person(connection, MAKER, Role.MANUFACTURER, "Mia", now)
            operator = add_person(connection, OPERATORS[0], Role.OPERATOR, "Ann", now)
            cars = [
                add_vehicle(connection, OPERATORS[k % 2], MAKER, f"V{k + 1}", now) for k in range(n)
            ]
        fleet.begin_updates(maker.principal.tenant, out / "offline")
    finally:
        fleet.close()
    made = [Car(c.principal.name, c.token, out / "vehicles" / c.principal.name) for c in cars]
    return maker.token, operator.token, made


@contextmanager
def serving(data: Path, port: int) -> Iterator[str]:
    """Runs `skidpad fleet serve` as a process of its own, which ends at exit; yields its address."""
    words = ["fleet", "serve", "--data", str(data), "--port", str(port)]
    with subprocess.Popen(
        [sys.executable, "-m", "skidpad", *words], stdout=subprocess.PIPE, text=True
    ) as child:
        try:
            line = child.stdout.readline() if child.stdout else ""
            found = re.search(r"https?://\S+", line)
            if found is None:
                raise BackendError("the fleet's server did not start")
            yield found.group(0)
        finally:
            os.kill(child.pid, signal.SIGTERM)


@contextmanager
def open_recorded(out: Path, port: int, say: Callable[[str], None]) -> Iterator[str]:
    """Serves the recorded fleet from a copy in `out`; says what it is and where; yields its address."""
    import time

    from skidpad.fleet.recorded import unpack_recorded
    from skidpad.fleet.store.accounts import add_person
    from skidpad.fleet.store.engine import open_engine, sqlite_url
    from skidpad.fleet.words import Role

    about = unpack_recorded(out / "data")
    people = ((MAKER, Role.MANUFACTURER), (OPERATORS[0], Role.OPERATOR))
    say(about.describe())
    with serving(out / "data", port) as address:  # which brings the store to this version
        engine = open_engine(sqlite_url(out / "data"))
        try:
            with engine.begin() as connection:
                accounts = [add_person(connection, t, r, "visitor", time.time()) for t, r in people]
        finally:
            engine.dispose()
        visitor = Demo(out, address, "", [], 0.0, lambda _: [], say)
        for account in accounts:
            path = visitor.call(account.token, "POST", "/api/v1/session").json()["path"]
            say(f"dashboard of the {account.principal.role.value}: {address}{path}")
        yield address


def play(demo: Demo) -> list[dict[str, Any]]:
    """Plays the whole story of the demo; returns the releases as they ended."""
    rules = rule_sets()
    demo.payloads[""] = rules["published"]
    demo.say(f"{len(demo.cars)} vehicles drive {demo.seconds:g} s each under the published rules")
    demo.round()
    told = demo.call(demo.maker, "POST", "/api/v1/analyses").json()
    demo.say(f"  {told['hazards']} hazards came in, clusters that recur: {told['clusters']}")
    rows = demo.call(demo.maker, "GET", "/api/v1/hazards").json()
    behind = [row["id"] for row in rows[:20]]
    demo.say("a change: safe distances of tracked objects")
    demo.roll_out("tracked", rules["tracked"], behind)
    demo.say("another change: looser limits, so that nothing is missed")
    demo.roll_out("looser", rules["looser"], behind)
    return demo.releases()
