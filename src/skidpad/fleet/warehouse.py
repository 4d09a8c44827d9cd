"""Sums of indicators by day, vehicle and indicator in a DuckDB file, so that a page asks a small table.

All of it follows from the batches in the store: without the file it is made again.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import duckdb
import polars as pl

from skidpad.core.errors import FileError

DAY = 86400.0  # s, in UTC
LATE_S = 3600.0  # a batch may come to light that long after its time of receipt
TABLES = """
    CREATE TABLE IF NOT EXISTS taken (id VARCHAR PRIMARY KEY, received DOUBLE);
    CREATE TABLE IF NOT EXISTS sums (
        manufacturer VARCHAR, operator VARCHAR, vehicle VARCHAR, indicator VARCHAR, day BIGINT,
        n BIGINT, violated BIGINT, total DOUBLE
    );
"""
TAKE = """
    INSERT INTO sums SELECT manufacturer, operator, vehicle, indicator,
        CAST(floor(received / 86400) AS BIGINT), sum(n), sum(violated), sum(mean * n)
    FROM read_parquet($file) GROUP BY ALL ORDER BY ALL
"""
MANY_VEHICLES = 30  # from here on sums over them suffice for limits
MOMENTS = """
    WITH each AS MATERIALIZED (
        SELECT indicator, day // $days AS slot, vehicle, sum(n)::DOUBLE AS n,
               sum(violated)::DOUBLE AS violated, sum(total) AS total
        FROM sums WHERE {right} GROUP BY indicator, slot, vehicle HAVING sum(n) > 0
    ), moments AS (
        SELECT indicator, slot, count(*) AS vehicles, sum(n) AS n, sum(violated) AS violated,
               sum(total) AS total, sum(violated * violated) AS vv, sum(violated * n) AS vn,
               sum(n * n) AS nn, sum(violated ** 3) AS vvv, sum(violated ** 2 * n) AS vvn,
               sum(violated * n ** 2) AS vnn, sum(n ** 3) AS nnn
        FROM each GROUP BY indicator, slot
    ), few AS (
        SELECT indicator, slot, list(violated ORDER BY vehicle) AS each_violated,
               list(n ORDER BY vehicle) AS each_n
        FROM each SEMI JOIN (SELECT * FROM moments WHERE vehicles < {few}) USING (indicator, slot)
        GROUP BY indicator, slot
    )
    SELECT moments.*, coalesce(each_violated, []), coalesce(each_n, [])
    FROM moments LEFT JOIN few USING (indicator, slot) ORDER BY indicator, slot
"""


class Moments(NamedTuple):
    """An indicator in a stretch of days: sums over vehicles of counts and of their products."""

    indicator: str
    slot: int  # stretches of days since 1970
    vehicles: int
    n: float  # cycles
    violated: float
    total: float  # of the indicator's value over cycles
    vv: float
    vn: float
    nn: float
    vvv: float
    vvn: float
    vnn: float
    nnn: float
    each_violated: list[float]  # of every vehicle, where these are few
    each_n: list[float]


class Warehouse:
    """Holds sums of indicators in the file of one service; one thread at a time."""

    def __init__(self, path: Path) -> None:
        """The file is opened when first asked: only who serves asks, and only one process can."""
        self.path, self.lock = path, threading.Lock()
        self._opened: duckdb.DuckDBPyConnection | None = None
        self._whole = True  # the first look is at every batch: a clock may have gone back before

    @property
    def _database(self) -> duckdb.DuckDBPyConnection:
        """Returns the connection to the warehouse's file, opened on first use; FileError where it cannot."""
        if self._opened is None:
            try:
                opened = duckdb.connect(str(self.path))
                opened.execute(TABLES)
            except duckdb.Error as error:
                why = "another process serves this folder"
                if "lock" not in str(error):
                    why = "no table of trends can be read in it; delete it, and it is made again"
                raise FileError(f"{self.path}: {why}") from error
            self._opened = opened
        return self._opened

    def close(self) -> None:
        """Closes the file if it was opened."""
        with self.lock:
            if self._opened is not None:
                self._opened.close()

    def since(self) -> float:
        """Returns the time of receipt in s from which on batches may be unknown here; call under the lock.

        Before `complete` that is 0.
        """
        newest = self._database.execute("SELECT max(received) FROM taken").fetchone()
        if self._whole or newest is None or newest[0] is None:
            return 0.0
        return float(newest[0]) - LATE_S

    def unknown(self, ids: Sequence[str]) -> set[str]:
        """Returns the ids that were not taken yet; call under the lock."""
        rows = self._database.execute(
            "SELECT id FROM taken WHERE id IN (SELECT unnest($ids))", {"ids": list(ids)}
        )
        return set(ids) - {str(row[0]) for row in rows.fetchall()}

    def take(self, batches: Sequence[tuple[str, float]], rows: pl.DataFrame) -> None:
        """Adds the rows of these batches (id, time in s), all or none; call under the lock."""
        with TemporaryDirectory() as folder:
            file = Path(folder) / "rows.parquet"
            rows.write_parquet(file)
            self._database.execute("BEGIN")
            try:
                self._database.execute(TAKE, {"file": str(file)})
                self._database.execute(
                    "INSERT INTO taken SELECT unnest($ids), unnest($received)",
                    {"ids": [id for id, _ in batches], "received": [at for _, at in batches]},
                )
                self._database.execute("COMMIT")
            except BaseException:
                self._database.execute("ROLLBACK")
                raise

    def complete(self) -> None:
        """Notes that every batch has been taken, so that `since` skips old ones; call under the lock."""
        self._whole = False

    def moments(self, column: str | None, tenant: str, days: int) -> list[Moments]:
        """Returns sums over vehicles per indicator and stretch of `days` days.

        column: of the owner ("operator" or "manufacturer") that must be `tenant`; None: all vehicles.
        """
        told: dict[str, object] = {"days": days}
        right = "true"
        if column is not None:
            right, told["tenant"] = f"{column} = $tenant", tenant
        with self.lock:
            rows = self._database.execute(
                MOMENTS.format(right=right, few=MANY_VEHICLES), told
            ).fetchall()
        return [Moments(*row) for row in rows]
