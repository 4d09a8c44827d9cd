"""The fleet as one object: its store, its blobs, its intake, and the clock that it goes by."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from threading import Lock

from sqlalchemy import Engine

from skidpad.core.environment.localities import Locate
from skidpad.core.errors import OutputError
from skidpad.fleet.alerting.dispatcher import Dispatcher
from skidpad.fleet.alerting.hub import Hub
from skidpad.fleet.alerting.orders import Signer
from skidpad.fleet.alerting.relays import Relay
from skidpad.fleet.blobs import Blobs
from skidpad.fleet.store.engine import migrate, open_engine, sqlite_url
from skidpad.fleet.store.intake import Batch, Intake
from skidpad.fleet.updates import signing
from skidpad.fleet.updates.repository import Repository
from skidpad.fleet.warehouse import Warehouse
from skidpad.fleet.words import Limits
from skidpad.recording.files import write_bytes
from skidpad.recording.hazards.records import HazardRecord


@dataclass(slots=True)
class _Bucket:
    left: float
    at: float


class Rate:
    """Grants requests by a bucket per credential: `burst` at once, refilled at `per_s`."""

    def __init__(self, per_s: float, burst: int) -> None:
        self.per_s, self.burst = per_s, float(burst)
        self._buckets: dict[str, _Bucket] = {}
        self._lock = Lock()

    def take(self, who: str, now: float) -> float:
        """Takes one request at `now` s; returns 0 when it is granted, else the s until one will be."""
        with self._lock:
            bucket = self._buckets.setdefault(who, _Bucket(self.burst, now))
            gained = max(0.0, now - bucket.at) * self.per_s
            bucket.left, bucket.at = min(self.burst, bucket.left + gained), now
            if bucket.left >= 1.0:
                bucket.left -= 1.0
                return 0.0
            return (1.0 - bucket.left) / self.per_s


CAME = "came"  # topic, with a tenant: something new of its vehicles
Clock = Callable[[], float]  # s since 1970
Exporter = Callable[[HazardRecord, Path], tuple[Path, Path]]  # writes scenario and road


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Where things are kept; None: in the data folder."""

    data: Path
    database: str | None = None
    blobs: str | None = None


@dataclass(slots=True)
class Fleet:
    """Everything that requests are answered from."""

    data: Path
    engine: Engine
    blobs: Blobs
    intake: Intake
    clock: Clock
    hub: Hub
    dispatcher: Dispatcher
    signer: Signer
    warehouse: Warehouse
    limits: Limits
    rate: Rate  # of all links together
    exporter: Exporter | None = None  # handed in: this package knows no scenarios
    locate: Locate | None = None  # handed in likewise: which road a point is on
    owners: dict[str, tuple[str, str]] = field(default_factory=dict)  # tenants of a vehicle: facts

    def repository(self, tenant: str) -> Repository:
        """Returns the repository of updates of a manufacturer."""
        return Repository(self.data / "updates" / tenant, self.online_key(tenant), self.clock)

    def online_key(self, tenant: str) -> Path:
        """Returns the path of the key that signs when a manufacturer's updates were current."""
        return self.data / "keys" / f"updates-{tenant}.key"

    def begin_updates(self, tenant: str, out: Path) -> None:
        """Begins a manufacturer's updates; `out` gets the keys of their maker, and root.json to pin.

        Raises ConfigError for a folder about the data, OutputError where they were begun before.
        """
        now, offline = self.clock(), signing.make_offline_keys(out, self.data)
        root = signing.make_root(offline, signing.new_key(self.online_key(tenant)), now)
        first = signing.empty_targets(offline["targets"][: signing.THRESHOLD], now)
        self.repository(tenant).begin(root, first)
        write_bytes(out / "root.json", root)

    def close(self) -> None:
        """Commits what was submitted and closes all threads and stores."""
        self.dispatcher.close()
        self.intake.close()
        self.warehouse.close()
        self.engine.dispose()


def open_fleet(
    places: Places,
    clock: Clock = time.time,
    limits: Limits | None = None,
    exporter: Exporter | None = None,
    relays: Sequence[Relay] = (),
    locate: Locate | None = None,
) -> Fleet:
    """Opens the store at `places`, made or brought to this version where needed; nothing is served yet."""
    engine, limits = open_store(places), limits or Limits()
    blobs = Blobs(places.blobs or str(places.data.absolute() / "blobs"))
    hub = Hub()
    return Fleet(
        data=places.data,
        engine=engine,
        blobs=blobs,
        intake=Intake(engine, blobs, clock, partial(_tell, hub)),
        clock=clock,
        hub=hub,
        dispatcher=Dispatcher(engine, hub, clock, relays),
        signer=Signer(places.data / "keys"),
        warehouse=Warehouse(places.data / "trends.duckdb"),
        limits=limits,
        rate=Rate(limits.requests_per_s, limits.burst),
        exporter=exporter,
        locate=locate,
    )


def _tell(hub: Hub, batch: Batch) -> None:
    """Counts a batch for the topics of operator and manufacturer, whose pages may want to look."""
    for tenant in {batch.operator, batch.manufacturer}:
        hub.tell(f"{CAME} {tenant}")


def open_store(places: Places) -> Engine:
    """Opens the database alone, made or migrated where needed; OutputError for an unusable folder."""
    if places.data.exists() and not places.data.is_dir():
        raise OutputError(f"--data {places.data} is a file; the fleet's store is a folder")
    try:
        places.data.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{places.data}: cannot be written ({error.strerror})") from error
    engine = open_engine(places.database or sqlite_url(places.data))
    migrate(engine)
    return engine
