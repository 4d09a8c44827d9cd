"""Taking batches in: many at once in one durable commit, and no answer before it (C-172).

Bodies of a commit are one pack, a content-addressed blob; rows say where each lies in it.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import msgspec
from sqlalchemy import Connection, Engine, bindparam, select
from sqlalchemy.exc import DataError, IntegrityError

from skidpad.fleet.batch import BatchDrive, Found, weather_class
from skidpad.fleet.blobs import Blobs
from skidpad.fleet.identity import digest, new_id
from skidpad.fleet.store.rights import in_chunks
from skidpad.fleet.store.tables import batches, drives, hazards
from skidpad.fleet.words import MEANWHILE, UNKEPT, Kind, Refused

Clock = Callable[[], float]  # s since 1970
GROUP = 128  # batches of one commit at most
# Made once: making them anew for every batch cost as much as asking.
BY_KEY = select(batches.c.id, batches.c.digest).where(
    batches.c.vehicle == bindparam("vehicle"), batches.c.key == bindparam("key")
)
BY_DIGEST = select(hazards.c.digest, hazards.c.id).where(
    hazards.c.vehicle == bindparam("vehicle"),
    hazards.c.digest.in_(bindparam("digests", expanding=True)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """A batch that was checked, with everything that is kept of it."""

    vehicle: str
    operator: str
    manufacturer: str
    kind: Kind
    key: str
    body: bytes  # as sent
    drive: str = ""
    vehicle_time: float | None = None
    found: Sequence[Found] = ()
    summary: BatchDrive | None = None


@dataclass(frozen=True, slots=True)
class Receipt:
    """What a vehicle is told once its batch is durable."""

    batch: str
    ids: tuple[str, ...]  # of its records, in their order; known ones keep theirs
    known: bool  # nothing new was kept


class Intake:
    """Commits batches in one thread, in each commit those that came during the one before."""

    def __init__(
        self, engine: Engine, blobs: Blobs, clock: Clock, came: Callable[[Batch], None]
    ) -> None:
        """came: is told of every batch that was kept."""
        self.engine, self.blobs, self.clock, self.came = engine, blobs, clock, came
        self._queue: queue.SimpleQueue[tuple[Batch, Future[Receipt]] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="fleet-intake")
        self._closed = False
        self._thread.start()

    def submit(self, batch: Batch) -> Future[Receipt]:
        """Queues a batch; the future gives its receipt once it is durable, or raises Refused.

        Refused (503) at once when the fleet is closing.
        """
        if self._closed:
            raise Refused(503, "the fleet is closing")
        future: Future[Receipt] = Future()
        self._queue.put((batch, future))
        return future

    def close(self) -> None:
        """Commits what was submitted and ends the thread; safe to call twice."""
        if not self._closed:
            self._closed = True
            self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        """Commits queued batches in groups until None comes; runs in a thread."""
        while True:
            first = self._queue.get()
            if first is None:
                return
            group, last = [first], False
            while len(group) < GROUP and not last:
                try:
                    more = self._queue.get_nowait()
                except queue.Empty:
                    break
                last = more is None
                if more is not None:
                    group.append(more)
            self._commit(group)
            if last:
                return

    def _commit(self, group: list[tuple[Batch, Future[Receipt]]]) -> None:
        """Writes a group and answers each batch; a group that fails is written one by one."""
        try:
            receipts = self._write([batch for batch, _ in group])
        except Exception as error:  # becomes the answer of the request that it came of
            if len(group) == 1:
                group[0][1].set_exception(_answer_to(error))
                return
            for one in group:  # what cannot be kept must not take others' batches with it
                self._commit([one])
            return
        for (batch, future), receipt in zip(group, receipts, strict=True):
            if isinstance(receipt, Refused):
                future.set_exception(receipt)
            else:
                self.came(batch)
                future.set_result(receipt)

    def _write(self, group: list[Batch]) -> list[Receipt | Refused]:
        """Stores the group as one pack and its facts in one transaction; returns an answer per batch."""
        pack = self.blobs.store(b"".join(batch.body for batch in group))
        starts = [0]
        for batch in group:
            starts.append(starts[-1] + len(batch.body))
        with self.engine.begin() as connection:
            return [
                self._write_one(connection, batch, pack, start)
                for batch, start in zip(group, starts, strict=False)
            ]

    def _write_one(
        self, connection: Connection, batch: Batch, pack: str, start: int
    ) -> Receipt | Refused:
        """Writes a batch at `start` of a pack unless known; returns its receipt, or a refusal (409)."""
        body = digest(batch.body)
        about = {"vehicle": batch.vehicle, "key": batch.key}
        known = connection.execute(BY_KEY, about).first()
        if known is not None:
            if known.digest != body:
                return Refused(409, "this idempotency key was used for another body")
            return Receipt(known.id, _ids(connection, batch), known=True)
        row: dict[str, Any] = {
            "id": new_id(), "vehicle": batch.vehicle, "kind": batch.kind.value, "key": batch.key,
            "digest": body, "pack": pack, "start": start, "size": len(batch.body),
            "vehicle_time": batch.vehicle_time, "at": self.clock(),
        }  # fmt: skip
        connection.execute(batches.insert(), row)
        new, ids = self._facts(connection, batch, row)
        return Receipt(row["id"], ids, known=not new)

    def _facts(
        self, connection: Connection, batch: Batch, row: dict[str, Any]
    ) -> tuple[bool, tuple[str, ...]]:
        """Inserts what the batch says; returns False when all of it was known, and ids of its hazards."""
        owned = {
            "operator": batch.operator, "manufacturer": batch.manufacturer,
            "vehicle": batch.vehicle, "batch": row["id"], "drive": batch.drive,
            "vehicle_time": batch.vehicle_time, "at": row["at"],
        }  # fmt: skip
        if batch.summary is not None:
            words = batch.summary.context
            there = (drives.c.vehicle == batch.vehicle) & (drives.c.drive == batch.drive)
            if connection.execute(select(drives.c.id).where(there)).first() is not None:
                return False, ()
            drive = owned | {
                "id": new_id(), "seconds": batch.summary.seconds, "map": words.get("map", ""),
                "weather": weather_class(words), "release": batch.summary.release,
                "summary": msgspec.json.encode(batch.summary).decode(),
            }  # fmt: skip
            connection.execute(drives.insert(), drive)
            return True, ()
        known = _known_records(connection, batch)
        fresh = {f.digest: f for f in batch.found if f.digest not in known}
        if fresh:
            rows = [owned | _hazard_row(found) for found in fresh.values()]
            connection.execute(hazards.insert(), rows)
            known |= {row["digest"]: row["id"] for row in rows}
        return bool(fresh) or not batch.found, tuple(known[f.digest] for f in batch.found)


def _answer_to(error: Exception) -> Exception:
    """Returns the refusal that a database error stands for; any other error as it is."""
    if isinstance(error, IntegrityError):
        return Refused(409, MEANWHILE)
    if isinstance(error, DataError):
        return Refused(422, UNKEPT)
    return error


def _hazard_row(found: Found) -> dict[str, Any]:
    """Returns the columns of a record for the table of hazards."""
    head = found.head
    return {
        "id": new_id(), "start": found.start, "size": found.size, "digest": found.digest,
        "type": head.type.value, "map": head.context.get("map", ""),
        "weather": weather_class(head.context), "x": found.x, "y": found.y,
        "t_start": head.t_start, "t_end": head.t_end, "head": found.text,
    }  # fmt: skip


def _known_records(connection: Connection, batch: Batch) -> dict[str, str]:
    """Returns the id by digest of those records of the batch that are kept already."""
    known: dict[str, str] = {}
    for some in in_chunks([found.digest for found in batch.found]):
        about = {"vehicle": batch.vehicle, "digests": some}
        known.update((kept, id) for kept, id in connection.execute(BY_DIGEST, about))
    return known


def _ids(connection: Connection, batch: Batch) -> tuple[str, ...]:
    """Returns the stored ids of a batch's records, in their order."""
    known = _known_records(connection, batch)
    return tuple(known[found.digest] for found in batch.found)


def plain(receipt: Receipt) -> dict[str, Any]:
    """Returns the receipt as plain values, as it is sent."""
    return {"batch": receipt.batch, "ids": list(receipt.ids), "known": receipt.known}
