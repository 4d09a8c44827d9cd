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
    """Returns the column of a table's own id."""
    return Column("id", ID, primary_key=True)


def _time(name: str = "at") -> Column[float]:
    """Returns a column for a time in s that is always there."""
    return Column(name, Double, nullable=False)


def _to(name: str, target: str, *, null: bool = False) -> Column[str]:
    """Returns a column that refers to the id of the table `target`."""
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


def _owner_columns() -> list[Column[str]]:
    """Returns the columns of the operator, manufacturer and vehicle that own a row."""
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
# --- analyses, alerts and orders
series = Table(  # what was computed of a record; computing it again gives the same
    "series",
    metadata,
    Column("digest", DIGEST, primary_key=True),
    Column("version", Integer, primary_key=True),
    Column("content", Text, nullable=False),  # JSON
    _time(),
)
analyses = Table(
    "analyses",
    metadata,
    _id(),
    _to("tenant", "tenants"),
    Column("actor", NAME, nullable=False),
    Column("settings", Text, nullable=False),  # JSON
    Column("hazards", Integer, nullable=False),  # looked at
    _time(),
    Column("role", NAME, nullable=True),  # whose rights it used
)
clusters = Table(
    "clusters",
    metadata,
    _id(),
    _to("tenant", "tenants"),
    _to("analysis", "analyses"),
    _to("representative", "hazards"),
    Column("rank", Integer, nullable=False),
    Column("content", Text, nullable=False),  # JSON
    Index("clusters_by_analysis", "analysis", "rank"),
)
recurrences = (
    Table(  # which recurring hazard a hazard belongs to; the newest analysis that says so counts
        "recurrences",
        metadata,
        Column("analysis", ID, ForeignKey("analyses.id"), primary_key=True),
        Column("hazard", ID, ForeignKey("hazards.id"), primary_key=True),
        Column("subject", ID, nullable=False),
        _time(),
        Index("recurrences_by_hazard", "hazard", "at"),
    )
)
alerts = Table(
    "alerts",
    metadata,
    _id(),
    *_owner_columns(),
    Column("key", NAME, nullable=False),
    Column("digest", DIGEST, nullable=False),
    Column("kind", NAME, nullable=False),
    Column("text", Text, nullable=False),
    Column("scene", Text, nullable=False),  # JSON: what the vehicle shows
    Column("vehicle_time", Double, nullable=True),
    _time(),
    UniqueConstraint("vehicle", "key"),
    Index("alerts_by_operator", "operator", "at"),
)
orders = Table(
    "orders",
    metadata,
    _id(),
    *_owner_columns(),
    _to("alert", "alerts", null=True),
    Column("what", NAME, nullable=False),
    Column("actor", NAME, nullable=False),
    _time("expires"),
    _time(),
    Column("key", NAME, nullable=True),  # of the request
    Index("orders_by_vehicle", "vehicle", "at"),
    Index("orders_once", "alert", "actor", "key", unique=True),
)
deliveries = Table(  # an order is handed out once, whoever asks at the same time
    "deliveries",
    metadata,
    Column("order", ID, ForeignKey("orders.id"), primary_key=True),
    Column("challenge", NAME, nullable=False),
    _time(),
)
# --- the loop: changes, their releases, and what a change does to the scenes behind it
changes = Table(
    "changes",
    metadata,
    _id(),
    _to("tenant", "tenants"),
    _to("cluster", "clusters", null=True),
    Column("kind", NAME, nullable=False),
    Column("name", NAME, nullable=False),  # of the payload among updates
    Column("payload", DIGEST, nullable=False),  # blob
    Column("hazards", Text, nullable=False),  # JSON: ids of the scenes that led to it
    Column("reason", Text, nullable=False),
    Column("actor", NAME, nullable=False),
    _time(),
)
releases = Table(
    "releases",
    metadata,
    _id(),
    _to("tenant", "tenants"),
    _to("change", "changes"),
    Column("plan", Text, nullable=False),  # JSON, fixed here
    Column("before", NAME, nullable=False),  # name of the payload that it takes the place of, ""
    Column("actor", NAME, nullable=False),
    _time(),
    Index("releases_by_tenant", "tenant", "at"),
)
evaluations = Table(
    "evaluations",
    metadata,
    _id(),
    _to("change", "changes"),
    _to("hazard", "hazards"),
    Column("errors_before", Integer, nullable=False),
    Column("errors_after", Integer, nullable=False),
    Column("found_after", Integer, nullable=False),  # whether its kind is still found in the scene
    _time(),
    UniqueConstraint("change", "hazard"),
)
looks = Table(  # at a release: each number once, whoever looks at the same time
    "looks",
    metadata,
    Column("release", ID, ForeignKey("releases.id"), primary_key=True),
    Column("number", Integer, primary_key=True),
    _time(),
)
