"""Batches over a real broker: the same receipts, refusals and promises as over HTTPS."""

from __future__ import annotations

from contextlib import closing

import pytest

from fleet_world import make_world, mosquitto, record, text_of

pytest.importorskip("aiomqtt", reason="aiomqtt, for mosquitto, is not installed")
from skidpad.core.errors import BackendError
from skidpad.fleet.broker import Broker
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


def posting(world, broker, name="red-1"):
    return mqtt_poster(broker, world.accounts[name].token, world.clock, WAIT_S)


@pytest.mark.req("C-151", "C-171")
def test_a_spool_is_emptied_over_the_broker_and_each_record_kept_once(listening, broker, tmp_path):
    spool = Spool(tmp_path / "spool")
    for k in range(3):
        spool.put(Kind.HAZARDS, text_of(record(k)))
    sent = send(spool, posting(listening, broker))
    assert (sent.acknowledged, sent.refused, sent.waiting) == (3, 0, 0)
    ids = {i for receipt in spool.acknowledged().values() for i in receipt["ids"]}
    rows = listening.get("red operator", "/api/v1/hazards").json()
    assert {row["id"] for row in rows} == ids
    assert len(ids) == 3
    again = Spool(tmp_path / "again")
    again.put(Kind.HAZARDS, text_of(record(0)))
    assert send(again, posting(listening, broker)).acknowledged == 1
    (receipt,) = again.acknowledged().values()
    assert receipt["known"]
    assert set(receipt["ids"]) <= ids


def test_the_broker_gives_nobody_more_than_https_does(listening, broker, tmp_path):
    spool = Spool(tmp_path / "spool")
    spool.put(Kind.HAZARDS, b"nonsense")
    assert send(spool, posting(listening, broker)).refused == 1
    spool.put(Kind.HAZARDS, text_of(record(1)))
    for name in ("red operator", "nobody"):
        listening.accounts.setdefault(name, type("Nobody", (), {"token": "wrong"}))
        with pytest.raises(BackendError, match="does not accept"):
            send(spool, posting(listening, broker, name))
    assert spool.count() == 1
    assert listening.get("red operator", "/api/v1/hazards").json() == []


def test_without_a_broker_the_batch_waits(tmp_path):
    spool = Spool(tmp_path / "spool")
    spool.put(Kind.HAZARDS, text_of(record(1)))
    nowhere = Broker(host="127.0.0.1", port=1)
    assert send(spool, mqtt_poster(nowhere, "token", timeout_s=5.0)).waiting == 1
