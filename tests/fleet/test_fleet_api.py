"""Every route x role x foreign id; limits; what is refused before it is read."""

from __future__ import annotations

import gzip
import io
import json
import zipfile
import zlib

import pytest
from lxml import etree

from skidpad.fleet.api.guard import Needs
from skidpad.fleet.service import Rate
from skidpad.fleet.unpacking import unpack
from skidpad.fleet.words import RIGHTS, Action, Limits, Refused, Role
from support.fleet_maker import released
from support.fleet_world import packed, record, text_of

OPEN = {"/api/v1/openapi.json"}  # describes the interface, holds no record


def routes(app):
    """Every operation with the action that its dependency asks for."""
    found = []
    for route in app.routes:
        found += _operations(route)
    return found


def _operations(route):
    if hasattr(route, "dependant"):
        needs = [d.call.action for d in route.dependant.dependencies if isinstance(d.call, Needs)]
        return [(method, route.path, needs) for method in route.methods]
    inner = getattr(route, "original_router", None) or getattr(route, "routes", None)
    if inner is None:
        return [(m, route.path, []) for m in getattr(route, "methods", None) or ()]
    return [op for r in getattr(inner, "routes", inner) for op in _operations(r)]


def test_every_operation_asks_for_exactly_one_right(lite):
    table = routes(lite.client.app)
    assert len(table) >= 5
    for method, path, needs in table:
        assert (len(needs) == 1) is (path not in OPEN), (method, path)
    assert set(RIGHTS) == set(Action)


def test_the_interface_describes_every_operation(lite):
    found = lite.client.get("/api/v1/openapi.json").json()
    told = {(m.upper(), path) for path, ways in found["paths"].items() for m in ways}
    assert told == {(m, path) for m, path, _ in routes(lite.client.app) if path not in OPEN}
    assert found["info"]["title"] == "Skidpad fleet"


def filled(path: str, ids: dict[str, str]) -> str:
    for name, value in ids.items():
        path = path.replace("{" + name + "}", value)
    assert "{" not in path, path
    return path


def others(world) -> tuple[str, str, str]:
    """An alert, an order and a cluster of the red operator's vehicles."""
    scene = {"map": "town", "ego": {"x": 0.0, "y": 0.0, "heading": 0.0}, "v": 1.0}
    text = json.dumps({"kind": "fault", "text": "t", "scene": scene})
    headers = {"Idempotency-Key": "alert-key-1"}
    alert = world.post("red-1", "/api/v1/alerts", content=text, headers=headers).json()["alert"]
    way = f"/api/v1/alerts/{alert}/order/stop"
    order = world.post("red teleoperator", way, headers=headers).json()["order"]
    more = packed(*(record(k, (100.0 + k, 0.0)) for k in range(5, 9)))
    assert world.send("red-2", more).status_code == 200
    world.post("axle", "/api/v1/analyses")
    return alert, order, world.get("axle", "/api/v1/clusters").json()[0]["id"]


@pytest.mark.req("C-195")
def test_every_route_for_every_role_and_foreign_id(lite, tmp_path):
    """No credential: 401. A role without the right: 403. Another tenant's id: 404, as if absent."""
    (hazard,) = lite.send("red-1", packed(record(1))).json()["ids"]
    alert, order, cluster = others(lite)
    change, release = released(lite, tmp_path, hazard)
    ids = {"hazard": hazard, "alert": alert, "order": order, "cluster": cluster,
           "change": change, "release": release, "subject": hazard}  # fmt: skip
    words = {"kind": "hazards", "what": "obeyed", "to": "slow", "name": "timestamp.json"}
    asked, key = {"challenge": "0" * 32}, {"Idempotency-Key": "some-key-1"}
    people = {
        Role.MANUFACTURER: "bolt", Role.OPERATOR: "blue operator", Role.VEHICLE: "blue-1",
        Role.TELEOPERATOR: "blue teleoperator", Role.AUTHORITY: "authority",
        Role.RESEARCHER: "researcher",
    }  # fmt: skip
    for method, path, needs in routes(lite.client.app):
        if path in OPEN:
            continue
        target = filled(path, ids | words)
        nobody = lite.client.request(method, target)
        assert nobody.status_code == 401, (method, path)
        wrong = lite.client.request(method, target, headers={"Authorization": "Bearer skidpad-x"})
        assert wrong.status_code == 401, (method, path)
        for role, name in people.items():
            lite.clock.now += 10.0
            answer = lite.client.request(
                method, target, headers=lite.headers(name) | key, params=asked
            )
            if role not in RIGHTS[needs[0]]:
                assert answer.status_code == 403, (method, path, role)
            elif any("{" + name + "}" in path for name in ids):
                assert answer.status_code == 404, (method, path, role)
            assert not any(id in answer.text for id in ids.values()), (method, path, role)
            assert answer.status_code < 500, (method, path, role)


def test_rows_are_those_of_ones_own_tenant(world):
    ids = {}
    for number, vehicle in enumerate(("red-1", "red-2", "blue-1")):
        (ids[vehicle],) = world.send(vehicle, packed(record(number))).json()["ids"]
    seen = {
        name: {row["id"] for row in world.get(name, "/api/v1/hazards").json()}
        for name in ("red operator", "blue operator", "axle", "bolt", "red-1")
    }
    assert seen == {
        "red operator": {ids["red-1"], ids["red-2"]},
        "axle": {ids["red-1"], ids["red-2"]},
        "blue operator": {ids["blue-1"]},
        "bolt": {ids["blue-1"]},
        "red-1": {ids["red-1"]},
    }
    by_foreign = world.get(
        "blue operator", "/api/v1/hazards", vehicle=world.accounts["red-1"].principal.vehicle
    )
    assert by_foreign.json() == []


@pytest.mark.req("C-157", "C-196")
def test_a_scenario_is_made_when_a_stakeholder_asks_in_their_own_fleet(lite):
    (hazard,) = lite.send("red-1", packed(record(1))).json()["ids"]
    answer = lite.post("axle", f"/api/v1/hazards/{hazard}/scenario")
    assert answer.status_code == 200
    archive = zipfile.ZipFile(io.BytesIO(answer.content))
    scenario, road = sorted(archive.namelist(), reverse=True)
    root = etree.fromstring(archive.read(scenario))
    assert root.find(".//LogicFile").get("filepath") == road
    assert len(root.findall(".//ScenarioObject")) == 4  # two egos, one object in each world
    assert all(one.compress_size < one.file_size for one in archive.infolist())
    again = lite.post("axle", f"/api/v1/hazards/{hazard}/scenario")
    assert again.content == answer.content  # whenever it is asked for


def test_bombs_are_not_unpacked():
    limits = Limits(body=100_000, unpacked=2_000_000)
    bomb = gzip.compress(b"0" * 80_000_000)
    assert len(bomb) < limits.body
    for body in (
        bomb,
        gzip.compress(gzip.compress(b"0" * 10**7)) + b"x",
        zlib.compress(b"x"),
        b"",
        b"\x1f\x8b",
    ):
        with pytest.raises(Refused):
            unpack(body, limits)
    assert unpack(gzip.compress(text_of(record(1))), limits) == text_of(record(1))


def test_requests_beyond_a_limit_are_refused(lite):
    big = lite.send("red-1", b"0" * (8 * 1024 * 1024 + 1))
    assert big.status_code == 413
    bomb = lite.send("red-1", gzip.compress(b"0" * 8_000_000))
    assert bomb.status_code == 413
    for key in ("short", "../../../etc", "a" * 65):
        assert lite.send("red-1", packed(record(1)), key=key).status_code == 422
    assert lite.send("red-1", packed(record(1)), kind="../drive").status_code in (404, 422)
    answers = [lite.get("red operator", "/api/v1/hazards").status_code for _ in range(61)]
    assert answers == [200] * 60 + [429]
    assert lite.get("blue operator", "/api/v1/hazards").status_code == 200  # only that one waits
    lite.clock.now += 1.0
    assert lite.get("red operator", "/api/v1/hazards").status_code == 200


def test_a_bucket_fills_at_its_rate_and_never_backwards():
    rate = Rate(2.0, 3)
    assert [rate.take("v", 10.0) for _ in range(3)] == [0.0, 0.0, 0.0]
    assert rate.take("v", 10.0) == 0.5
    assert rate.take("v", 9.0) == 0.5  # a clock set back gives nothing
    assert rate.take("v", 9.5) == 0.0
    assert rate.take("v", 1000.0) == 0.0


def test_drives_and_indicators_are_checked(lite):
    def send(kind, content, key):
        return lite.send("red-1", gzip.compress(content), key, kind).status_code

    drive = {"seconds": 60.0, "cycles": 600, "context": {"map": "town"}}
    assert send("drive", json.dumps(drive).encode(), "drive-key-1") == 200
    assert send("drive", json.dumps(drive | {"seconds": -1}).encode(), "drive-key-2") == 422
    assert send("drive", b"[]", "drive-key-3") == 422
    row = {"minute": 0, "subject": "a+b", "indicator": "channel_agreement", "n": 600, "violated": 0,
           "mean": 0.9, "least": 0.8, "greatest": 1.0}  # fmt: skip
    assert send("indicators", json.dumps(row).encode(), "indicators-1") == 200
    assert send("indicators", json.dumps(row | {"n": -1}).encode(), "indicators-2") == 422
    assert send("indicators", json.dumps(row | {"x": 1}).encode(), "indicators-3") == 422
    two = json.dumps(row).encode() + b"\n\n" + json.dumps(row | {"minute": 1}).encode()
    assert send("indicators", two, "indicators-4") == 200
    assert send("indicators", json.dumps(row, indent=1).encode(), "indicators-5") == 422
