"""Tables that came after the first: analyses, alerts, orders, changes, releases, exposures."""

from __future__ import annotations

from sqlalchemy import Column, Double, ForeignKey, Index, Integer, Table, Text, UniqueConstraint

from skidpad.fleet.store.tables import DIGEST, ID, NAME, _id, _owner_columns, _time, _to, metadata

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
    Column("role", NAME, nullable=True),  # whose rights it used; NULL: of a version before 0005
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
    Column("key", NAME, nullable=True),  # of the request; NULL: of a version before 0005
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
REACTIONS = (series, analyses, clusters, alerts, orders, deliveries)
