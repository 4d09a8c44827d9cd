"""Facts stay, batches are durable before they are acknowledged, both stores answer alike."""

from __future__ import annotations

import gzip
import json
import threading
from concurrent.futures import Future
from dataclasses import replace

import pytest
from sqlalchemy import func, inspect, select, text
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from skidpad.core.errors import ConfigError, FileError
from skidpad.fleet.batch import hazards_of
from skidpad.fleet.blobs import Blobs
from skidpad.fleet.store.accounts import end_credentials, principal_of
from skidpad.fleet.store.engine import migrate, open_engine
from skidpad.fleet.store.events import events_of
from skidpad.fleet.store.intake import Batch
from skidpad.fleet.store.tables import batches, hazards, metadata
from skidpad.fleet.words import Kind, Limits, Refused
from support.fleet_world import NOW, packed, record, text_of


def count(world, table):
    with world.fleet.engine.connect() as connection:
        return connection.execute(select(func.count()).select_from(table)).scalar_one()


@pytest.mark.req("C-172", "C-193", "C-194")
def test_what_a_vehicle_sent_comes_back_as_it_was(world):
    sent = [record(1), record(2, place=(300.0, -40.0), precipitation="80")]
    answer = world.send("red-1", packed(*sent), **{"X-Skidpad-Time": "12.5"})
    assert answer.status_code == 200, answer.text
    ids = answer.json()["ids"]
    rows = {row["id"]: row for row in world.get("red operator", "/api/v1/hazards").json()}
    assert set(ids) == set(rows)
    second = rows[ids[1]]
    assert (second["x"], second["y"], second["weather"]) == (300.0, -40.0, "day, heavy rain")
    assert second["map"] == "town", "the context that its record carries"
    assert (second["vehicle_time"], second["at"]) == (12.5, NOW)  # both clocks, side by side
    for one, id in zip(sent, ids, strict=True):
        kept = world.get("axle", f"/api/v1/hazards/{id}/record").text
        assert kept.encode() == text_of(one).partition(b"\n")[2]


def test_the_same_batch_again_changes_nothing(world):
    body = packed(record(1), record(2))
    first = world.send("red-1", body).json()
    assert world.send("red-1", body).json() == first | {"known": True}
    other_key = world.send("red-1", body, key="key-0000-2").json()
    assert (other_key["ids"], other_key["known"]) == (first["ids"], True)
    assert world.send("red-1", packed(record(3))).status_code == 409  # the key is another body's
    assert count(world, hazards) == 2
    other_vehicle = world.send("red-2", body).json()
    assert set(other_vehicle["ids"]).isdisjoint(first["ids"])


def test_nobody_else_on_the_machine_reads_the_store(lite):
    assert oct(lite.fleet.data.stat().st_mode)[-3:] == "700"
    assert oct((lite.fleet.data / "keys" / "orders.key").stat().st_mode)[-3:] == "600"


def test_facts_can_be_neither_changed_nor_removed(world):
    world.send("red-1", packed(record(1)))
    for statement in ("UPDATE hazards SET type = 'x'", "DELETE FROM hazards", "DELETE FROM events"):
        if statement.endswith("events"):
            with world.fleet.engine.begin() as connection:
                end_credentials(connection, world.accounts["red-2"].principal.id, "me", NOW)
        with (
            pytest.raises(DBAPIError, match="only ever added"),
            world.fleet.engine.begin() as connection,
        ):
            connection.execute(text(statement))
    assert count(world, hazards) == 1


def test_migration_makes_the_tables_that_the_code_knows(world):
    migrate(world.fleet.engine)  # again: nothing to do
    there = inspect(world.fleet.engine)
    assert set(metadata.tables) <= set(there.get_table_names())
    for table in metadata.tables.values():
        columns = {c["name"]: c["nullable"] for c in there.get_columns(table.name)}
        assert columns == {c.name: c.nullable for c in table.columns}


def test_a_credential_ends_once_and_is_counted_once(world):
    principal = world.accounts["red operator"].principal.id
    with world.fleet.engine.begin() as connection:
        assert end_credentials(connection, principal, "the board", NOW + 5.0) == 1
        assert end_credentials(connection, principal, "the board", NOW + 6.0) == 0
        ids = connection.execute(
            text("SELECT c.id FROM credentials c WHERE c.principal = :p"), {"p": principal}
        ).scalars()
        assert len(events_of(connection, list(ids))) == 1


def test_an_ended_credential_opens_nothing(world):
    account = world.accounts["red operator"]
    with world.fleet.engine.begin() as connection:
        assert principal_of(connection, account.token, NOW) == account.principal
        assert principal_of(connection, account.token, NOW + 400 * 86400) is None  # expired
        end_credentials(connection, account.principal.id, "the board", NOW + 5.0)
        assert principal_of(connection, account.token, NOW + 6.0) is None
        credential = connection.execute(
            text("SELECT c.id FROM credentials c WHERE c.principal = :p"),
            {"p": account.principal.id},
        ).scalar_one()
        (event,) = events_of(connection, [credential])
    assert (event.actor, event.at, event.what) == ("the board", NOW + 5.0, "credential ended")


def batch(world, key: str, *records) -> Batch:
    return Batch(
        vehicle=world.accounts["red-1"].principal.vehicle,
        operator=world.accounts["red-1"].principal.tenant,
        manufacturer=world.accounts["axle"].principal.tenant,
        kind=Kind.HAZARDS, key=key, body=packed(*records),
        found=hazards_of(text_of(*records), Limits()),
    )  # fmt: skip


def test_batches_that_wait_are_committed_together_and_answered_after_it(world):
    """The first batch's pack is held back; what comes meanwhile shares the second commit."""
    intake, blobs = world.fleet.intake, world.fleet.blobs
    held, release, packs = threading.Event(), threading.Event(), []
    put = blobs.store

    def slow(content: bytes) -> str:
        packs.append(len(content))
        held.set()
        assert release.wait(120)
        return put(content)

    blobs.store = slow
    futures: list[Future] = [intake.submit(batch(world, "first-key", record(1)))]
    assert held.wait(120)
    futures += [intake.submit(batch(world, f"later-{k}", record(k))) for k in range(2, 8)]
    assert not any(f.done() for f in futures)
    assert count(world, batches) == 0
    release.set()
    ids = [id for f in futures for id in f.result(120).ids]
    assert len(packs) == 2
    assert len(set(ids)) == 7
    assert count(world, batches) == count(world, hazards) == 7


def test_a_store_that_fails_acknowledges_nothing(lite):
    def broken(content: bytes) -> str:
        raise OSError("no space left")

    lite.fleet.blobs.store = broken
    assert lite.send("red-1", packed(record(1))).status_code == 500
    assert count(lite, batches) == 0


def test_a_damaged_body_is_told_not_served(lite):
    (id,) = lite.send("red-1", packed(record(1))).json()["ids"]
    with lite.fleet.engine.connect() as connection:
        pack = connection.execute(select(batches.c.pack)).scalar_one()
    path = (
        next((lite.fleet.blobs._root / p for p in []), None)
        or f"{lite.fleet.blobs._root}/{pack[:2]}/{pack}"
    )
    with open(path, "r+b") as file:
        file.seek(40)
        file.write(b"\xff\xff\xff")
    answer = lite.get("axle", f"/api/v1/hazards/{id}/record")
    assert answer.status_code == 422
    assert "damaged" in answer.json()["detail"]


@pytest.mark.parametrize("url", ["folder", "memory://blobs-of-a-test"])
def test_blobs_are_named_by_what_they_are(url, tmp_path):
    blobs = Blobs(str(tmp_path / "b") if url == "folder" else url)
    name = blobs.store(b"weather")
    assert blobs.store(b"weather") == name
    assert (blobs.get(name), blobs.part(name, 1, 3)) == (b"weather", b"eat")
    for wrong in ("../../etc/passwd", "a" * 63, "A" * 64, "0" * 64):
        with pytest.raises(FileError):
            blobs.get(wrong)


def test_other_databases_are_refused_in_one_sentence():
    for url in ("mysql://x", "no address"):
        with pytest.raises(ConfigError, match="--database must be"):
            open_engine(url)


def test_a_bad_record_refuses_its_whole_batch(lite):
    good = text_of(record(1)).decode()
    head = json.loads(good.splitlines()[1][2:])
    cases = {
        "no head": good.replace("\nH ", "\nX ", 1),
        "no end": good[:-2],
        "no header": good.partition("\n")[2],
        "no hazard": good.replace(head["type"], "ufo"),
        "too far": good.replace('"x": 120.0', '"x": 1e300'),
        "long word": good.replace('"route-1"', '"' + "r" * 300 + '"'),
        "deep": good.replace('"context": {', '"context": ' + "[" * 100_000),
    }
    for name, text_ in cases.items():
        assert text_ != good, name
        with pytest.raises(Refused):
            hazards_of(text_.encode(), Limits())
    with pytest.raises(Refused, match="may hold 1 records"):
        hazards_of(text_of(record(1), record(2)), Limits(records=1))


@pytest.mark.parametrize("extra", ["9" * 5000, "[" * 900 + "]" * 900, "1e999"])
def test_what_a_head_says_besides_hides_no_other_record(lite, extra):
    """JSON that our readers of a page cannot take, in a field that nobody asked for."""
    text_ = text_of(record(1)).decode()
    line = text_.splitlines()[1]
    poisoned = text_.replace(line, line[:-1] + f', "besides": {extra}' + "}")
    lite.send("red-2", packed(record(2)), "good-key-1")
    assert lite.send("red-1", gzip.compress(poisoned.encode()), "poison-key").status_code == 200
    answer = lite.get("red operator", "/api/v1/hazards")
    assert (answer.status_code, len(answer.json())) == (200, 2)
    drive = f'{{"seconds": 1.0, "cycles": 1, "context": {{}}, "besides": {extra}}}'
    sent = lite.send("red-1", gzip.compress(drive.encode()), "drive-key-1", "drive")
    assert sent.status_code in (200, 422), sent.text


def test_words_that_a_store_cannot_keep_are_refused_alike(world):
    nul = packed(record(1, map="a\0b"))
    assert world.send("red-1", nul, "nul-key-1").status_code == 422
    drive = json.dumps({"seconds": 1.0, "cycles": 1, "context": {"map": "a\0b"}}).encode()
    assert world.send("red-1", gzip.compress(drive), "nul-key-2", "drive").status_code == 422
    assert world.get("red operator", "/api/v1/hazards", type="\0").status_code in (200, 422)
    assert world.get("red operator", "/api/v1/hazards/%00").status_code in (404, 422)


def test_a_batch_that_cannot_be_kept_takes_no_other_with_it(world):
    """Both are of one commit: the one that the store refuses fails alone."""
    intake, blobs = world.fleet.intake, world.fleet.blobs
    held, release, put = threading.Event(), threading.Event(), blobs.store

    def slow(content: bytes) -> str:
        held.set()
        assert release.wait(120)
        return put(content)

    blobs.store = slow
    first = intake.submit(batch(world, "first-key", record(1)))
    assert held.wait(120)
    good = intake.submit(batch(world, "good-key", record(2)))
    bad = intake.submit(replace(batch(world, "bad-key", record(3)), vehicle_time=object()))
    more = intake.submit(batch(world, "more-key", record(4)))
    release.set()
    assert [len(f.result(120).ids) for f in (first, good, more)] == [1, 1, 1]
    with pytest.raises(SQLAlchemyError):
        bad.result(120)
    assert count(world, hazards) == 3
