"""Alerts are relayed at once, tried again, escalated; a stop order is obeyed once or not at all."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from math import inf

import msgspec
import numpy as np
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from skidpad.core.errors import BackendError, ConfigError
from skidpad.fleet.alerting.dispatcher import Dispatcher
from skidpad.fleet.alerting.hub import Hub
from skidpad.fleet.alerting.receiver import Receiver, Verdict
from skidpad.fleet.alerting.relays import Mqtt, Webhook
from skidpad.fleet.broker import Broker
from skidpad.fleet.store.accounts import find_tenant
from support.fleet_world import NOW, Clock, mosquitto

SCENE = {"map": "town", "ego": {"x": 1.0, "y": 2.0, "heading": 0.1}, "v": 8.0}
ALERT = {"kind": "hazard", "text": "car ahead stopped", "scene": SCENE}


def raised(world, vehicle="red-1", key="alert-key-1", **change) -> str:
    answer = world.post(
        vehicle,
        "/api/v1/alerts",
        content=json.dumps(ALERT | change),
        headers={"Idempotency-Key": key},
    )
    assert answer.status_code == 200, answer.text
    return answer.json()["alert"]


def ordered(world, who: str, path: str, key: str | None = None):
    """An order by a request of its own."""
    return world.post(who, path, headers={"Idempotency-Key": key or secrets.token_hex(8)})


class Wire:
    """A relay that fails as often as it is told."""

    name = "wire"

    def __init__(self, failures: int = 0) -> None:
        self.failures, self.sent = failures, []

    def wants(self, operator):
        return True

    def send(self, alert):
        if self.failures:
            self.failures -= 1
            raise BackendError("wire: cut")
        self.sent.append((alert["id"], alert["level"]))


def dispatcher(world, wire) -> Dispatcher:
    return Dispatcher(world.fleet.engine, world.fleet.hub, world.clock, [wire])


@pytest.mark.req("C-175")
def test_an_alert_is_seen_by_its_operator_and_teleoperator_alone(world):
    id = raised(world)
    assert raised(world) == id  # the same again
    other = world.post("red-1", "/api/v1/alerts", content=json.dumps(ALERT | {"text": "x"}),
                       headers={"Idempotency-Key": "alert-key-1"})  # fmt: skip
    assert other.status_code == 409
    for name in ("red operator", "red teleoperator"):
        (alert,) = world.get(name, "/api/v1/alerts").json()["alerts"]
        assert (alert["id"], alert["text"], alert["scene"]["v"]) == (id, ALERT["text"], 8.0)
    assert world.get("blue operator", "/api/v1/alerts").json()["alerts"] == []
    assert world.get("axle", "/api/v1/alerts").status_code == 403


def test_an_alert_that_is_none_is_refused(lite):
    for bad in (
        {"kind": "ufo"}, {"text": ""}, {"text": "x" * 501}, {"extra": 1},
        {"scene": SCENE | {"v": 1e9}}, {"scene": SCENE | {"objects": [SCENE["ego"]] * 201}},
    ):  # fmt: skip
        answer = lite.post("red-1", "/api/v1/alerts", content=json.dumps(ALERT | bad),
                           headers={"Idempotency-Key": "alert-key-9"})  # fmt: skip
        assert answer.status_code == 422, bad


def test_what_nobody_takes_up_is_escalated_and_what_failed_is_tried_again(world):
    wire = Wire(failures=2)
    look = dispatcher(world, wire)
    id = raised(world)
    look.work()
    assert wire.sent == []
    for seconds in (0.5, 0.5, 1.0, 1.0):  # tries after 0, 1 and 1 + 2 s
        world.clock.now += seconds
        look.work()
    assert wire.sent == [(id, 0)]
    for level in (1, 2, 3):
        world.clock.now = NOW + 30.0 * level
        look.work()
        look.work()
        assert wire.sent[-1] == (id, level)
    world.clock.now = NOW + 500.0
    look.work()
    assert len(wire.sent) == 4
    (alert,) = world.get("red operator", "/api/v1/alerts").json()["alerts"]
    assert alert["level"] == 3
    assert [e["what"] for e in alert["events"]].count("relay failed") == 2


def test_an_acknowledged_alert_is_not_escalated_and_says_who_and_when(world):
    id = raised(world)
    world.clock.now += 4.0
    taken = world.post("red teleoperator", f"/api/v1/alerts/{id}/acknowledge").json()
    who = world.accounts["red teleoperator"].principal.id
    assert taken["acknowledged_by"] == who
    assert (taken["events"][-1]["at"], taken["events"][-1]["actor"]) == (NOW + 4.0, who)
    assert world.post("red operator", f"/api/v1/alerts/{id}/acknowledge").status_code == 409
    world.clock.now += 300.0
    wire = Wire()
    dispatcher(world, wire).work()
    assert wire.sent == [(id, 0)]
    assert world.post("red operator", f"/api/v1/alerts/{id}/escalate").json()["level"] == 1
    assert world.post("red operator", f"/api/v1/alerts/{id}/close").json()["closed"]
    assert world.post("red operator", f"/api/v1/alerts/{id}/escalate").status_code == 409


def test_who_waits_is_woken():
    hub = Hub()

    async def wait() -> int:
        waiting = asyncio.create_task(hub.wait_for_change("alerts red", 0, 1e6))
        await asyncio.sleep(0)
        hub.tell("alerts blue")
        hub.tell("alerts red")
        return await asyncio.wait_for(waiting, 120)

    assert asyncio.run(wait()) == 1
    assert asyncio.run(hub.wait_for_change("alerts red", 1, 0.04)) == 1  # gives up


def test_the_thread_relays_without_being_asked(lite):
    came = threading.Event()

    class Bell(Wire):
        def send(self, alert):
            came.set()

    look = lite.fleet.dispatcher
    look.relays = (Bell(),)
    look.start()
    raised(lite)
    assert came.wait(120)


def test_a_relay_that_does_not_answer_delays_no_other(lite):
    came, ended = threading.Event(), threading.Event()

    class Deaf(Wire):
        name = "deaf"

        def send(self, alert):
            ended.wait(120)

    class Bell(Wire):
        def send(self, alert):
            came.set()

    look = lite.fleet.dispatcher
    look.relays = (Deaf(), Bell())
    look.start()
    try:
        raised(lite)
        assert came.wait(120)
    finally:
        ended.set()


@contextmanager
def http_server(answer: int, location: str | None = None):
    """A server on this machine that keeps what it was sent."""
    got = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            got.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(answer)
            if location:
                self.send_header("Location", location)
            self.end_headers()

        do_GET = do_POST  # noqa: N815  # the library's name

        def log_message(self, *words):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/hook", got
        finally:
            server.shutdown()
            thread.join()


def test_a_relay_for_an_operator_that_nobody_enrolled_is_refused(lite):
    with lite.fleet.engine.begin() as connection:
        assert find_tenant(connection, "red")
        with pytest.raises(ConfigError, match="unknown operator 'Nobody'; the fleet knows: "):
            find_tenant(connection, "Nobody")


def test_a_webhook_goes_to_its_host_and_nowhere_else():
    with http_server(200) as (good, got), http_server(302, good) as (redirects, asked):
        Webhook("red", good, ["127.0.0.1"], 120.0).send({"id": "a"})
        assert got == [{"id": "a"}]
        with pytest.raises(BackendError, match="302"):
            Webhook("red", redirects, ["127.0.0.1"], 120.0).send({"id": "b"})
        assert (len(asked), len(got)) == (1, 1)
    with pytest.raises(BackendError):
        Webhook("red", good, ["127.0.0.1"]).send({"id": "c"})  # nobody there
    for url in (
        "https://evil.example/", "http://127.0.0.1@evil.example/", "http://ops.example/",
        "https://user:word@ops.example/", "file:///etc/passwd", "https://ops.example.evil.example/",
    ):  # fmt: skip
        with pytest.raises(ConfigError):
            Webhook("red", url, ["127.0.0.1", "ops.example"])
    assert not Webhook("red", good, ["127.0.0.1"]).wants("blue")


def test_a_webhook_takes_no_way_that_the_environment_names(monkeypatch):
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")  # where nobody listens
    with http_server(200) as (good, got):
        Webhook("red", good, ["127.0.0.1"], 120.0).send({"id": "a"})
        assert got == [{"id": "a"}]


def test_two_webhooks_of_an_operator_on_one_host_get_every_alert(lite):
    with http_server(200) as (one, first), http_server(200) as (other, second):
        operator = lite.accounts["red operator"].principal.tenant
        ways = (one, f"{one}/more", other)
        look = lite.fleet.dispatcher
        look.relays = tuple(Webhook(operator, way, ["127.0.0.1"], 120.0) for way in ways)
        id = raised(lite)
        look.work()
        look.work()
    assert [a["id"] for a in first] == [id, id]  # once for each address
    assert [a["id"] for a in second] == [id]
    assert len({relay.name for relay in look.relays}) == 3


def test_a_webhook_that_answers_drop_by_drop_is_given_up():
    """Each drop comes in time, the answer never does."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        gone = threading.Event()

        def drip():
            connection, _ = server.accept()
            with connection, suppress(OSError):
                connection.sendall(b"HTTP/1.1 200 OK\r\n")
                while not gone.wait(0.1):
                    connection.sendall(b"X: y\r\n")

        thread = threading.Thread(target=drip)
        thread.start()
        url = f"http://127.0.0.1:{server.getsockname()[1]}/"
        try:
            with pytest.raises(BackendError, match="Timeout"):
                Webhook("red", url, ["127.0.0.1"], 2.0).send({"id": "a"})
        finally:
            gone.set()
            thread.join()


def test_mqtt_carries_an_alert_to_whoever_subscribed(tmp_path):
    aiomqtt = pytest.importorskip("aiomqtt", reason="aiomqtt, for mosquitto, is not installed")
    with mosquitto(tmp_path) as port:
        relay = Mqtt(Broker(host="127.0.0.1", port=port), 120.0)

        async def through() -> tuple[str, dict]:
            async with aiomqtt.Client(
                "127.0.0.1", port, protocol=aiomqtt.ProtocolVersion.V5, timeout=120
            ) as client:
                await client.subscribe("skidpad/red/alerts", qos=1)
                await asyncio.to_thread(relay.send, {"id": "a", "operator": "red"})
                message = await asyncio.wait_for(anext(aiter(client.messages)), 120)
                return str(message.topic), json.loads(message.payload)

        assert asyncio.run(through()) == ("skidpad/red/alerts", {"id": "a", "operator": "red"})
    with pytest.raises(BackendError):
        relay.send({"id": "b", "operator": "red"})
    with pytest.raises(ConfigError, match="--mqtt-ca"):
        Broker(host="broker.example")


class Vehicle:
    """Fetches orders over the interface and judges them."""

    def __init__(self, world, name="red-1") -> None:
        self.world, self.name, self.clock = world, name, Clock(100.0)
        self.id = world.accounts[name].principal.vehicle
        self.receiver = Receiver(world.fleet.signer.public, self.id, self.clock)

    def ask(self) -> list[dict]:
        challenge = self.receiver.challenge()
        return self.world.get(self.name, "/api/v1/orders", challenge=challenge).json()

    def obey(self) -> list[Verdict]:
        return [self.receiver.receive(o["order"], o["signature"]) for o in self.ask()]


def test_a_stop_order_is_good_once(world):
    red, blue = Vehicle(world), Vehicle(world, "red-2")
    id = raised(world)
    assert ordered(world, "blue teleoperator", f"/api/v1/alerts/{id}/order/stop").status_code == 404
    assert ordered(world, "red operator", f"/api/v1/alerts/{id}/order/stop").status_code == 403
    assert red.obey() == []
    order = ordered(world, "red teleoperator", f"/api/v1/alerts/{id}/order/stop").json()["order"]
    assert blue.obey() == []  # not its order
    (sent,) = red.ask()
    assert red.ask() == []  # handed out once
    assert red.receiver.receive(sent["order"], sent["signature"]) is Verdict.OBEYED
    assert red.receiver.receive(sent["order"], sent["signature"]) is Verdict.REPLAYED
    assert blue.receiver.receive(sent["order"], sent["signature"]) is Verdict.FOREIGN
    assert world.post("blue-1", f"/api/v1/orders/{order}/obeyed").status_code == 404
    assert world.post("red-1", f"/api/v1/orders/{order}/obeyed").status_code == 200
    (alert,) = world.get("red teleoperator", "/api/v1/alerts").json()["alerts"]
    assert [e["what"] for e in alert["events"]] == ["stop ordered", "obeyed"]


def test_a_captured_order_or_answer_that_is_sent_again_orders_nothing(world):
    red, id = Vehicle(world), raised(world)
    path = f"/api/v1/alerts/{id}/order/"
    first = ordered(world, "red teleoperator", path + "slow", "order-key-1").json()
    assert red.obey() == [Verdict.OBEYED]
    world.clock.now += 60.0
    assert ordered(world, "red teleoperator", path + "slow", "order-key-1").json() == first
    assert ordered(world, "red teleoperator", path + "stop", "order-key-1").status_code == 409
    assert red.obey() == []
    assert world.post("red teleoperator", path + "slow").status_code == 422  # no key
    answer = f"/api/v1/orders/{first['order']}/"
    assert world.post("red-1", answer + "obeyed").status_code == 200
    for what in ("obeyed", "refused"):
        assert world.post("red-1", answer + what).status_code == 409
    (alert,) = world.get("red teleoperator", "/api/v1/alerts").json()["alerts"]
    assert [e["what"] for e in alert["events"]] == ["slow ordered", "obeyed"]


def test_a_stop_order_is_good_for_two_seconds_by_either_clock(lite):
    red, id = Vehicle(lite), raised(lite)
    ordered(lite, "red teleoperator", f"/api/v1/alerts/{id}/order/stop")
    lite.clock.now += 2.0
    assert red.ask() == []  # never fetched in time
    for age, verdict in ((2.1, Verdict.EXPIRED), (-0.1, Verdict.EXPIRED), (2.0, Verdict.OBEYED)):
        ordered(lite, "red teleoperator", f"/api/v1/alerts/{id}/order/stop")
        (sent,) = red.ask()
        assert red.receiver.v_max == inf
        red.clock.now += age
        assert red.receiver.receive(sent["order"], sent["signature"]) is verdict
    assert red.receiver.v_max == 0.0


def test_what_the_fleet_did_not_sign_stops_nobody(lite):
    red, id = Vehicle(lite), raised(lite)
    ordered(lite, "red teleoperator", f"/api/v1/alerts/{id}/order/stop")
    (sent,) = red.ask()
    other = Ed25519PrivateKey.generate().sign(sent["order"].encode()).hex()
    changed = sent["order"].replace('"what":"stop"', '"what":"slow"')
    assert changed != sent["order"]
    for text, signature in (
        (sent["order"], other), (changed, sent["signature"]), (sent["order"], "zz"), ("", ""),
        (sent["order"] + " ", sent["signature"]),
    ):  # fmt: skip
        assert red.receiver.receive(text, signature) is Verdict.FORGED
    assert red.receiver.v_max == inf
    assert red.receiver.receive(sent["order"], sent["signature"]) is Verdict.OBEYED


def test_a_vehicle_is_slowed_down_and_let_go_until_it_is_stopped(lite):
    red, id = Vehicle(lite), raised(lite)
    for order, verdict, v_max in (
        ("slow", Verdict.OBEYED, 2.0), ("resume", Verdict.OBEYED, inf),
        ("stop", Verdict.OBEYED, 0.0), ("resume", Verdict.STANDING, 0.0),
    ):  # fmt: skip
        ordered(lite, "red teleoperator", f"/api/v1/alerts/{id}/order/{order}")
        assert red.obey() == [verdict]
        assert red.receiver.v_max == v_max
    unknown = ordered(lite, "red teleoperator", f"/api/v1/alerts/{id}/order/fly")
    assert unknown.status_code == 422


@pytest.mark.slow
@pytest.mark.req("C-175")
def test_a_simulated_vehicle_obeys(lite, tmp_path):
    """It drives by its channels, raises an alert after 3 s, is slowed down, and stopped after 9 s."""
    from skidpad.campaign.channels.drive import drive_segment
    from skidpad.campaign.channels.routes import driven_routes
    from skidpad.recording.channels.cycles import cycles
    from skidpad.recording.sources import open_channels

    red, orders, alert = Vehicle(lite), {30: "slow", 90: "stop"}, []

    def guided(t: float) -> float:
        red.clock.now, lite.clock.now = 100.0 + t, NOW + t
        if order := orders.get(round(10.0 * t)):
            alert[:] = alert or [raised(lite)]
            ordered(lite, "red teleoperator", f"/api/v1/alerts/{alert[0]}/order/{order}")
            assert red.obey() == [Verdict.OBEYED]
        return red.receiver.v_max

    spec = msgspec.structs.replace(driven_routes()["route-1"], duration=16.0, seed=4)

    def speed(path) -> np.ndarray:
        found = cycles(open_channels(path, None))
        return np.array([np.hypot(*c.truth.ego[3:]) for c in found if c.truth is not None])

    drive_segment(spec, tmp_path / "free.mcap")
    drive_segment(spec, tmp_path / "ordered.mcap", guide=guided)
    free, obeyed = speed(tmp_path / "free.mcap"), speed(tmp_path / "ordered.mcap")
    assert np.array_equal(free[:30], obeyed[:30])
    assert 1.0 < obeyed[90] < 2.1  # m/s
    assert free[90] > 3.0
    assert obeyed[-1] < 0.1
    assert free[-1] > 1.0
