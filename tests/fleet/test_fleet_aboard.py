"""A vehicle of `skidpad fleet drive`: alerts of its monitor, orders obeyed, and a fleet that is away."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import sys
import time
from math import inf

import httpx
import msgspec
import numpy as np
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from typer.testing import CliRunner

from skidpad.core.channels import Context
from skidpad.core.errors import BackendError, FileError
from skidpad.fleet.aboard import Aboard, pinned_key
from skidpad.fleet.alerting.keeping import AlertText, Body, Kind, Scene
from support.channel_worlds import frame
from support.fleet_world import Clock, make_world

ALERT = AlertText(Kind.HAZARD, "car ahead", Scene("town", Body(1.0, 2.0, 0.1), 8.0))
LONG_S = 600.0  # a busy machine is no fault


class Link:
    """A vehicle's requests, through or, off line, not; and answers that an attacker puts in."""

    def __init__(self, world, name="red-1") -> None:
        self.world, self.name, self.away, self.forged = world, name, False, None

    def get(self, path):
        return self.request("GET", path)

    def request(self, method, path, headers=None, **rest):
        if self.away:
            raise httpx.ConnectError("away")
        if self.forged is not None and path == "/api/v1/orders":
            return httpx.Response(200, content=self.forged)
        headers = self.world.headers(self.name) | (headers or {})
        return self.world.client.request(method, path, headers=headers, **rest)


def aboard(world, **rest):
    said, clock, link = [], Clock(100.0), Link(world, **rest)
    return Aboard(link, world.fleet.signer.public, said.append, clock), link, clock, said


def alerts_of(world):
    return world.get("red teleoperator", "/api/v1/alerts").json()["alerts"]


def order(world, alert, what="stop"):
    path = f"/api/v1/alerts/{alert}/order/{what}"
    headers = {"Idempotency-Key": secrets.token_hex(8)}
    answer = world.post("red teleoperator", path, headers=headers)
    assert answer.status_code == 200, answer.text


@pytest.mark.req("C-175")
def test_alerts_wait_until_the_fleet_is_there_and_come_once(lite):
    red, link, _, _ = aboard(lite)
    link.away = True
    red.alert("drive-1-7-hazard", ALERT)
    red.tell()
    assert (red.waiting, alerts_of(lite)) == (1, [])
    link.away = False
    red.tell()
    (alert,) = alerts_of(lite)
    assert (alert["text"], alert["scene"]["v"], red.waiting) == ("car ahead", 8.0, 0)
    red.alert("drive-1-7-hazard", ALERT)  # as after an answer that was lost
    red.tell()
    assert len(alerts_of(lite)) == 1


@pytest.mark.req("C-175")
def test_a_good_order_stops_it_and_the_fleet_hears_so(lite):
    red, _, _, _ = aboard(lite)
    red.alert("drive-1-7-hazard", ALERT)
    red.tell()
    (alert,) = alerts_of(lite)
    red.ask(0.0)
    assert red.v_max == inf
    order(lite, alert["id"])
    red.ask(0.0)
    assert red.v_max == 0.0
    order(lite, alert["id"], "resume")
    red.ask(0.0)
    assert red.v_max == 0.0
    red.tell()
    (alert,) = alerts_of(lite)
    told = [e["what"] for e in alert["events"]]
    assert told == ["stop ordered", "resume ordered", "obeyed", "standing"]


def test_what_the_fleet_did_not_sign_or_nobody_can_read_orders_nothing(lite):
    red, link, _, said = aboard(lite)
    text = json.dumps({"order": "0" * 32, "vehicle": red.receiver.vehicle, "what": "stop",
                       "challenge": red.receiver.challenge(), "valid_s": 2.0})  # fmt: skip
    signature = Ed25519PrivateKey.generate().sign(text.encode()).hex()
    forged = json.dumps([{"order": text, "signature": signature}]).encode()
    for link.forged in (forged, b"[{}]", b"{", b"\xff", b'[{"order": 1, "signature": 2}]'):
        red.ask(0.0)
    assert red.v_max == inf
    assert red.waiting == 0
    assert said == ["an order: forged"]


def test_an_order_that_came_late_is_refused_and_the_fleet_hears_so(lite):
    red, link, clock, _ = aboard(lite)
    red.alert("drive-1-7-hazard", ALERT)
    red.tell()
    order(lite, alerts_of(lite)[0]["id"])
    through = link.request

    def slow(*words, **rest):
        answer = through(*words, **rest)
        clock.now += 2.1
        return answer

    link.request = slow
    red.ask(0.0)
    red.tell()
    assert red.v_max == inf
    assert [e["what"] for e in alerts_of(lite)[0]["events"]] == ["stop ordered", "refused"]


def test_a_vehicle_that_the_fleet_does_not_know_does_not_begin(lite):
    with pytest.raises(BackendError, match="does not accept"):
        aboard(lite, name="red operator")


def test_what_is_no_key_is_told_in_one_sentence(lite, tmp_path):
    assert pinned_key(lite.fleet.data / "keys" / "orders.pub") == lite.fleet.signer.public
    for content in ("", "zz", "00" * 31):
        (tmp_path / "bad.pub").write_text(content)
        with pytest.raises(FileError, match=r"bad\.pub"):
            pinned_key(tmp_path / "bad.pub")


def test_the_monitors_alarms_become_alerts_with_the_scene_of_their_moment(tmp_path):
    """Half a line is no alarm; of two poses the one of the alarm's time is shown."""
    from skidpad.cli.fleet.drive import Watch

    raised = []

    class Fleet:
        v_max = inf
        say = raised.append

        def alert(self, key, alert):
            raised.append((key, alert))

    alarms = tmp_path / "alarms.jsonl"
    watch = Watch(Fleet(), alarms)
    watch.hear(None, Context(0.0, {"map": "town"}))
    watch.cycle_over(0, 0.0)
    for k, x in ((0, 10.0), (1, 20.0)):
        near, far = (x + 8.0, 0.0, 0.0, 5.0, 0.0), (x + 50.0, 0.0, 0.0, 5.0, 0.0)
        watch.hear(0, frame(0.1 * k, (x, 0.0, 0.0, 6.0, 8.0), [far, near]))
        watch.hear(1, frame(0.1 * k, (900.0, 0.0, 0.0, 0.0, 0.0), []))
    line = '{"cycle": 0, "t": 0.0, "hazard": "ego_tailgating"}\n'
    alarms.write_text(line + line[:20])
    watch.cycle_over(1, 0.1)
    ((key, alert),) = raised
    assert key == f"{watch.drive}-0-ego-tailgating"
    assert (alert.text, alert.kind) == ("ego tailgating at 0.0 s of the drive", Kind.HAZARD)
    scene = alert.scene
    assert (scene.map, scene.ego.x, scene.v) == ("town", 10.0, 10.0)
    assert [o.x for o in scene.objects] == [18.0, 60.0]
    alarms.write_text(line + line)
    watch.close()
    assert len(raised) == 2
    Fleet.v_max = 0.0
    watch.hear(0, frame(0.2, (20.0, 0.0, 0.0, 0.0, 0.0), []))
    watch.cycle_over(2, 0.2)
    watch.cycle_over(3, 0.3)
    assert raised[-1][1].kind is Kind.MINIMAL_RISK
    assert len(raised) == 3  # once


@pytest.mark.slow
@pytest.mark.req("C-175", "C-190")
def test_a_vehicle_of_the_command_alerts_and_is_stopped_by_a_teleoperator(tmp_path):
    """The service, the vehicle with its monitor, and the teleoperator are processes of their own."""
    from skidpad.cli.fleet.demo import serving
    from skidpad.cli.main import app
    from skidpad.core.channels import ChannelFrame, Decision
    from skidpad.recording.sources import open_channels
    from skidpad.stack.channels.arbiter import Reason

    world = make_world(tmp_path / "data", None)
    tokens = {name: world.accounts[name].token for name in ("red-1", "red teleoperator")}
    world.close()
    (tmp_path / "token").write_text(tokens["red-1"])
    out, stop = tmp_path / "out", time.monotonic() + LONG_S
    with serving(tmp_path / "data", 0) as address:
        words = [
            "fleet", "drive", "--to", address, "--token-file", str(tmp_path / "token"),
            "--orders-key", str(tmp_path / "data" / "keys" / "orders.pub"), "--out", str(out),
            "--route", "route-1", "--seconds", "25", "--seed", "8",
        ]  # fmt: skip
        bearer = {"Authorization": f"Bearer {tokens['red teleoperator']}"}
        with (
            subprocess.Popen(
                [sys.executable, "-m", "skidpad", *words],
                env=os.environ,
                stdout=subprocess.PIPE,
                text=True,
            ) as child,
            httpx.Client(
                base_url=address, headers=bearer, timeout=LONG_S, trust_env=False
            ) as client,
        ):
            alert: dict = {}
            while "obeyed" not in [e["what"] for e in alert.get("events", [])]:
                assert time.monotonic() < stop
                assert child.poll() is None
                if alert:
                    key = {"Idempotency-Key": secrets.token_hex(8)}
                    path = f"/api/v1/alerts/{alert['id']}/order/stop"
                    assert client.post(path, headers=key).status_code == 200
                    time.sleep(0.5)
                known = client.get("/api/v1/alerts", params={"wait": 0.0}).json()["alerts"]
                alert = known[-1] if known else {}
                time.sleep(0.2)
            assert child.wait(LONG_S) == 0
            kinds = {a["kind"] for a in client.get("/api/v1/alerts").json()["alerts"]}
            told = child.stdout.read()
            sent = CliRunner().invoke(
                app,
                [
                    "fleet",
                    "upload",
                    str(out / "drive.monitor"),
                    *words[2:6],
                    "--spool",
                    str(tmp_path / "spool"),
                ],
            )
            assert " 0 refused, 0 waiting" in sent.output, (sent.output, sent.exception)
    assert alert["kind"] == "hazard"
    assert alert["scene"]["map"]
    assert "an order to stop: obeyed" in told
    assert "1 order obeyed, 0 words that the fleet has not got" in told
    assert "; complete" in told  # the monitor
    assert kinds == {"hazard", "minimal_risk"}
    items = [m.item for m in open_channels(out / "drive.mcap", None).messages()]
    chosen = [i for i in items if isinstance(i, Decision)]
    seen = [i for i in items if isinstance(i, ChannelFrame)]
    assert chosen[0].driving
    assert (chosen[-1].driving, chosen[-1].reason) == ("", Reason.ORDERED.value)
    assert max(np.hypot(*i.ego[3:]) for i in seen) > 2.0
    assert np.hypot(*seen[-1].ego[3:]) < 0.1
    link = msgspec.json.decode((out / "drive.monitor" / "link.json").read_bytes())
    assert link["ended"] == "complete"
