"""Tables of the loop: changes, releases of them, and what a change does to the scenes behind it."""

from __future__ import annotations

from sqlalchemy import Column, ForeignKey, Index, Integer, Table, Text, UniqueConstraint

from skidpad.fleet.store.tables import DIGEST, ID, NAME, _id, _time, _to, metadata

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
LOOP = (changes, releases, evaluations)
