"""Batches over a real broker: the same receipts, refusals and promises as over HTTPS."""

from __future__ import annotations

import asyncio
import subprocess
from contextlib import closing

import pytest

from support.fleet_world import make_world, mosquitto, record, text_of
from support.programs import require_program

pytest.importorskip("aiomqtt", reason="aiomqtt, for mosquitto, is not installed")
from skidpad.cli.fleet.links import broker_of
from skidpad.core.errors import BackendError, ConfigError
from skidpad.fleet.broker import ANSWERS, TOPIC, Broker, connect_to, request_properties
from skidpad.fleet.mqtt import BatchListener
from skidpad.fleet.spool import Spool
from skidpad.fleet.uploader import mqtt_poster, send
from skidpad.fleet.words import Kind

WAIT_S = 120.0


@pytest.fixture
def broker(tmp_path):
    with mosquitto(tmp_path) as port:
        yield Broker(host="127.0.0.1", port=port)


@pytest.fixture
def listening(broker, tmp_path):
    """A fleet that takes batches from the broker."""
    with closing(make_world(tmp_path / "data", None)) as world:
        listener = BatchListener(world.fleet, broker, WAIT_S)
        listener.start()
        try:
            assert listener.listening.wait(WAIT_S)
            yield world
        finally:
            listener.close()


def test_a_listener_may_be_closed_twice_and_without_a_start(tmp_path):
    with closing(make_world(tmp_path / "data", None)) as world:
        listener = BatchListener(world.fleet, Broker(host="127.0.0.1", port=1), WAIT_S)
        listener.start()
        listener.close()
        listener.close()
        BatchListener(world.fleet, Broker(host="127.0.0.1", port=1), WAIT_S).close()


def posting(world, broker, name="red-1"):
    return mqtt_poster(broker, world.accounts[name].token, world.clock, WAIT_S)


@pytest.mark.req("C-151", "C-171")
def test_a_spool_is_emptied_over_the_broker_and_each_record_kept_once(listening, broker, tmp_path):
    spool = Spool(tmp_path / "spool")
    for k in range(3):
        spool.add_batch(Kind.HAZARDS, text_of(record(k)))
    sent = send(spool, posting(listening, broker))
    assert (sent.acknowledged, sent.refused, sent.waiting) == (3, 0, 0)
    ids = {i for receipt in spool.read_receipts().values() for i in receipt["ids"]}
    rows = listening.get("red operator", "/api/v1/hazards").json()
    assert {row["id"] for row in rows} == ids
    assert len(ids) == 3
    again = Spool(tmp_path / "again")
    again.add_batch(Kind.HAZARDS, text_of(record(0)))
    assert send(again, posting(listening, broker)).acknowledged == 1
    (receipt,) = again.read_receipts().values()
    assert receipt["known"]
    assert set(receipt["ids"]) <= ids


def test_the_broker_gives_nobody_more_than_https_does(listening, broker, tmp_path):
    spool = Spool(tmp_path / "spool")
    spool.add_batch(Kind.HAZARDS, b"nonsense")
    assert send(spool, posting(listening, broker)).refused == 1
    spool.add_batch(Kind.HAZARDS, text_of(record(1)))
    for name in ("red operator", "nobody"):
        listening.accounts.setdefault(name, type("Nobody", (), {"token": "wrong"}))
        with pytest.raises(BackendError, match="does not accept"):
            send(spool, posting(listening, broker, name))
    assert spool.count() == 1
    assert listening.get("red operator", "/api/v1/hazards").json() == []


def test_the_fleet_answers_to_vehicles_and_publishes_nowhere_else(listening, broker):
    """Whoever may publish must not have the fleet, which may more, publish where they want."""
    where = f"{ANSWERS}/{'0' * 32}"

    async def heard() -> list[str]:
        async with connect_to(broker, WAIT_S, waiting=8) as client:
            await client.subscribe("skidpad/#", qos=1)
            for target in ("skidpad/red/alerts", f"{ANSWERS}/x", where):
                about = request_properties(target, {"key": "key-0000-1"})
                await client.publish(f"{TOPIC}/hazards", b"x", qos=1, properties=about)
            topics: list[str] = []
            while len(topics) < 4:
                message = await asyncio.wait_for(anext(aiter(client.messages)), WAIT_S)
                topics.append(str(message.topic))
            return topics

    assert sorted(asyncio.run(heard())) == sorted([f"{TOPIC}/hazards"] * 3 + [where])


def test_the_fleet_logs_in_where_only_it_may_read_what_vehicles_send(tmp_path):
    """A broker that lets nobody in without a password, and vehicles only write."""
    hash_password = require_program("mosquitto_passwd", "mosquitto")
    words, rights = tmp_path / "words", tmp_path / "rights"
    for create, user in (("-c", "fleet"), ("", "vehicle")):
        options = [*filter(None, [create]), "-b", str(words), user, f"{user}-word"]
        subprocess.run([hash_password, *options], check=True, capture_output=True)
        (tmp_path / user).write_text(f"{user}-word\n")
    rights.write_text(
        f"user fleet\ntopic read {TOPIC}/#\ntopic write {ANSWERS}/#\n"
        f"user vehicle\ntopic write {TOPIC}/#\ntopic read {ANSWERS}/+\n"
    )
    for file in (words, rights):
        file.chmod(0o644)
    more = f"allow_anonymous false\npassword_file {words}\nacl_file {rights}\nuser root\n"
    with mosquitto(tmp_path, more) as port, closing(make_world(tmp_path / "data", None)) as world:
        at = f"127.0.0.1:{port}"
        listener = BatchListener(
            world.fleet, broker_of(at, None, "fleet", tmp_path / "fleet"), WAIT_S
        )
        listener.start()
        try:
            assert listener.listening.wait(WAIT_S)
            spool = Spool(tmp_path / "spool")
            spool.add_batch(Kind.HAZARDS, text_of(record(1)))
            assert send(spool, posting(world, broker_of(at, None, None, None))).waiting == 1
            car = broker_of(at, None, "vehicle", tmp_path / "vehicle")
            assert send(spool, posting(world, car)).acknowledged == 1
        finally:
            listener.close()
    with pytest.raises(ConfigError, match="go together"):
        broker_of("127.0.0.1", None, "fleet", None)


def test_without_a_broker_the_batch_waits(tmp_path):
    spool = Spool(tmp_path / "spool")
    spool.add_batch(Kind.HAZARDS, text_of(record(1)))
    nowhere = Broker(host="127.0.0.1", port=1)
    assert send(spool, mqtt_poster(nowhere, "token", timeout_s=5.0)).waiting == 1


def test_a_credential_has_one_bucket_for_both_links(listening, broker, tmp_path):
    """60 requests at once, however they come."""
    spool = Spool(tmp_path / "spool")
    spool.add_batch(Kind.HAZARDS, text_of(record(1)))
    answers = {listening.get("red-1", "/api/v1/vehicle").status_code for _ in range(60)}
    assert answers == {200}
    sent = send(spool, posting(listening, broker))
    assert (sent.acknowledged, sent.waiting) == (0, 1)
    listening.clock.now += 1.0
    assert send(spool, posting(listening, broker)).acknowledged == 1
