"""The tables. Facts are only ever added; a change of state is an event (decision R-11).

Times are seconds since 1970 of the server's clock; `vehicle_time` is what the vehicle believed.
"""

from __future__ import annotations

from sqlalchemy import (
    BigInteger,
    Column,
    Double,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

metadata = MetaData()
ID, NAME, DIGEST = String(32), String(200), String(64)
SEQUENCE = BigInteger().with_variant(Integer, "sqlite")  # SQLite counts up only such a column


def _id() -> Column[str]:
    return Column("id", ID, primary_key=True)


def _time(name: str = "at") -> Column[float]:
    return Column(name, Double, nullable=False)


def _to(name: str, target: str, *, null: bool = False) -> Column[str]:
    return Column(name, ID, ForeignKey(f"{target}.id"), nullable=null)


tenants = Table(
    "tenants", metadata, _id(), Column("name", NAME, nullable=False, unique=True), _time()
)
vehicles = Table(
    "vehicles",
    metadata,
    _id(),
    _to("operator", "tenants"),
    _to("manufacturer", "tenants"),
    Column("name", NAME, nullable=False),
    _time(),
    UniqueConstraint("operator", "name"),
)
principals = Table(
    "principals",
    metadata,
    _id(),
    _to("tenant", "tenants"),
    Column("role", NAME, nullable=False),
    Column("name", NAME, nullable=False),
    _to("vehicle", "vehicles", null=True),
    _time(),
)
credentials = Table(
    "credentials",
    metadata,
    _id(),
    _to("principal", "principals"),
    Column("token_hash", DIGEST, nullable=False, unique=True),
    _time("expires"),
    _time(),
)
batches = Table(
    "batches",
    metadata,
    _id(),
    _to("vehicle", "vehicles"),
    Column("kind", NAME, nullable=False),
    Column("key", NAME, nullable=False),  # idempotency key of the vehicle
    Column("digest", DIGEST, nullable=False),  # of the body as sent
    Column("pack", DIGEST, nullable=False),  # blob that holds the body
    Column("start", Integer, nullable=False),  # where in it
    Column("size", Integer, nullable=False),
    Column("vehicle_time", Double, nullable=True),
    _time(),
    UniqueConstraint("vehicle", "key"),
    Index("batches_by_kind", "kind", "at"),
)
OWNERS = ("operator", "manufacturer")
OWNED = (*OWNERS, "vehicle")  # columns that row rights are told by


def _owner_columns() -> list[Column[str]]:
    return [_to("operator", "tenants"), _to("manufacturer", "tenants"), _to("vehicle", "vehicles")]


hazards = Table(
    "hazards",
    metadata,
    _id(),
    *_owner_columns(),
    _to("batch", "batches"),
    Column("start", Integer, nullable=False),  # of the record in the unpacked batch
    Column("size", Integer, nullable=False),
    Column("digest", DIGEST, nullable=False),
    Column("drive", DIGEST, nullable=False),  # which drive of the vehicle, "" when not told
    Column("type", NAME, nullable=False),
    Column("map", NAME, nullable=False),
    Column("weather", NAME, nullable=False),  # class of weather, from the record's words
    Column("x", Double, nullable=False),  # m, world of the map
    Column("y", Double, nullable=False),
    Column("t_start", Double, nullable=False),  # s, of the drive
    Column("t_end", Double, nullable=False),
    Column("head", Text, nullable=False),  # the record's index row, JSON
    Column("vehicle_time", Double, nullable=True),
    _time(),
    UniqueConstraint("vehicle", "digest"),
    Index("hazards_by_operator", "operator", "at"),
    Index("hazards_by_manufacturer", "manufacturer", "at"),
    *(Index(f"hazards_counted_by_{owner}", owner, "type", "vehicle") for owner in OWNERS),
)
drives = Table(
    "drives",
    metadata,
    _id(),
    *_owner_columns(),
    _to("batch", "batches"),
    Column("drive", DIGEST, nullable=False),
    Column("seconds", Double, nullable=False),
    Column("map", NAME, nullable=False),
    Column("weather", NAME, nullable=False),
    Column("release", NAME, nullable=False),  # what the vehicle ran, "" for what it came with
    Column("summary", Text, nullable=False),
    Column("vehicle_time", Double, nullable=True),
    _time(),
    UniqueConstraint("vehicle", "drive"),
    *(Index(f"drives_counted_by_{owner}", owner, "vehicle", "seconds") for owner in OWNERS),
)
events = Table(
    "events",
    metadata,
    Column("number", SEQUENCE, primary_key=True, autoincrement=True),
    Column("subject", NAME, nullable=False),  # id of what it happened to
    Column("kind", NAME, nullable=False),  # what kind of thing that is
    Column("what", NAME, nullable=False),
    Column("actor", NAME, nullable=False),  # id of the principal, or the name of a service
    Column("detail", Text, nullable=False),  # JSON
    _time(),
    Index("events_by_subject", "subject", "number"),
)
FACTS = (tenants, vehicles, principals, credentials, batches, hazards, drives, events)
