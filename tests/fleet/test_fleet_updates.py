"""Updates: only what two of three signed, never older than seen, and data alone."""

from __future__ import annotations

import base64
import gzip
import io
import json
from contextlib import nullcontext
from datetime import timedelta
from pathlib import Path

import httpx
import numpy as np
import pytest
from tuf.api.metadata import Metadata
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import ConfigError, FileError, OutputError
from skidpad.evidence.channels.identifier import model as model_module
from skidpad.evidence.channels.indicators import catalogue
from skidpad.fleet.loop import rollout
from skidpad.fleet.loop.plan import look
from skidpad.fleet.updates import signing
from skidpad.fleet.updates.client import UpdateClient, UpdateRefused
from skidpad.fleet.updates.payloads import PayloadKind, payload_name, read_payload_content
from skidpad.fleet.updates.repository import SIGNED_AT
from skidpad.fleet.upkeep import Upkeep
from skidpad.fleet.words import Refused
from support.fleet_maker import CONTENT, NAME, Maker, rules
from support.fleet_world import Clock, World, packed, record


class Car:
    """A vehicle that fetches updates over the interface."""

    def __init__(self, world: World, folder: Path, root: bytes, name: str = "red-1") -> None:
        self.world, self.name, self.clock = world, name, Clock(world.clock.now)
        self.client = UpdateClient(folder, root, self.stream, self.clock)

    def stream(self, path: str):
        return self.world.client.stream("GET", path, headers=self.world.headers(self.name))


@pytest.fixture
def maker(lite, tmp_path) -> Maker:
    return Maker(lite, tmp_path)


def test_a_signed_update_arrives_as_it_was(maker, tmp_path):
    car = Car(maker.world, tmp_path / "car", maker.root)
    with pytest.raises(UpdateRefused, match="was signed"):
        car.client.fetch(NAME)
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    path = car.client.fetch(NAME)
    assert path.read_bytes() == CONTENT
    assert read_payload_content(PayloadKind.RULES, CONTENT).rules
    assert maker.repository.content(NAME) == CONTENT


class Flood:
    """An answer that never ends, in parts of 10 kB."""

    status_code = 200

    def __init__(self) -> None:
        self.parts = 0

    def iter_raw(self, size=None):
        while self.parts < 10_000:  # 100 MB: who reads all of it has failed
            self.parts += 1
            yield b" " * 10_000


@pytest.mark.parametrize("what", ["timestamp.json", "root.json", NAME])
def test_an_answer_that_does_not_end_is_given_up_at_its_limit(maker, tmp_path, what):
    """Limits of The Update Framework hold while the answer is read: metadata 1 MB, a payload its length."""
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    car, flood = Car(maker.world, tmp_path / "car", maker.root), Flood()
    through = car.stream
    car.client.stream = lambda path: nullcontext(flood) if path.endswith(what) else through(path)
    with pytest.raises(UpdateRefused):
        car.client.fetch(NAME)
    assert 1 <= flood.parts <= 1024 * 1024 / 10_000 + 2


def test_a_link_that_breaks_is_a_refused_update(maker, tmp_path):
    car = Car(maker.world, tmp_path / "car", maker.root)

    def broken(path: str):
        raise httpx.ConnectError("away")

    car.client.stream = broken
    with pytest.raises(UpdateRefused, match="away"):
        car.client.fetch(NAME)


def test_the_server_takes_only_what_two_of_three_signed(maker):
    targets, root = maker.keys["targets"], maker.keys["root"]
    for signers in ([], targets[:1], [targets[0], root[0]], root[:2]):
        with pytest.raises(Refused, match="signed"):
            maker.repository.publish(maker.signed(NAME, CONTENT, signers), NAME, CONTENT)
    good = maker.signed(NAME, CONTENT)
    with pytest.raises(Refused, match="not the one"):
        maker.repository.publish(good, NAME, CONTENT + b" ")
    with pytest.raises(Refused, match="add this one"):
        maker.repository.publish(good, "other.yaml", CONTENT)
    plain = json.loads(good)
    plain["signed"]["version"] = 3
    changed = json.dumps(plain).encode()
    with pytest.raises(Refused):
        maker.repository.publish(changed, NAME, CONTENT)
    maker.repository.publish(good, NAME, CONTENT)
    with pytest.raises(Refused, match="version 3"):
        maker.repository.publish(good, NAME, CONTENT)  # the same again
    late = maker.signed("b.yaml", b"b")
    maker.world.clock.now += 200 * 86400.0
    with pytest.raises(Refused, match="expired"):
        maker.repository.publish(late, "b.yaml", b"b")


def test_a_stolen_server_cannot_install_what_was_not_signed(maker, tmp_path):
    """Whoever holds the server and its online key replaces payload and list; the car refuses."""
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    folder = maker.repository.folder
    (payload,) = (folder / "targets").iterdir()
    payload.write_bytes(CONTENT.replace(b"3.2", b"9.9"))
    with pytest.raises(UpdateRefused):
        Car(maker.world, tmp_path / "a", maker.root).client.fetch(NAME)
    payload.write_bytes(CONTENT)
    forged = maker.signed("evil.yaml", b"evil", maker.keys["targets"][:1])
    (folder / "metadata" / "3.targets.json").write_bytes(forged)
    maker.repository._publish(forged)
    with pytest.raises(UpdateRefused):
        Car(maker.world, tmp_path / "b", maker.root).client.fetch("evil.yaml")


def saved(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_an_older_state_is_refused_by_who_saw_a_newer_one(maker, tmp_path):
    car = Car(maker.world, tmp_path / "car", maker.root)
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    before = saved(maker.repository.folder / "metadata")
    car.client.fetch(NAME)
    maker.repository.publish(maker.signed("b.yaml", b"b"), "b.yaml", b"b")
    assert car.client.fetch("b.yaml").read_bytes() == b"b"
    for name, content in before.items():
        (maker.repository.folder / "metadata" / name).write_bytes(content)
    for name in (NAME, "b.yaml"):
        with pytest.raises(UpdateRefused):
            car.client.fetch(name)


def test_a_frozen_state_is_refused(maker, tmp_path):
    """Metadata that nobody renews expires: an attacker cannot hold a car at an old state."""
    maker.world.clock.now -= 3 * 86400.0  # published three days ago; a timestamp lasts one
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    with pytest.raises(UpdateRefused, match="Expired"):
        Car(maker.world, tmp_path / "car", maker.root).client.fetch(NAME)
    maker.world.clock.now += 3 * 86400.0
    assert Car(maker.world, tmp_path / "car", maker.root).client.fetch(NAME)  # signed anew
    stamp = Metadata.from_bytes(
        (maker.repository.folder / "metadata" / "timestamp.json").read_bytes()
    )
    assert stamp.signed.unrecognized_fields[SIGNED_AT] == int(maker.world.clock.now)


def test_a_clock_behind_the_last_signed_time_is_refused(maker, tmp_path):
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    car = Car(maker.world, tmp_path / "car", maker.root)
    car.client.fetch(NAME)
    car.clock.now -= 301.0
    with pytest.raises(UpdateRefused, match="behind"):
        car.client.fetch(NAME)
    fresh = Car(maker.world, tmp_path / "fresh", maker.root)
    fresh.clock.now -= timedelta(days=30).total_seconds()
    with pytest.raises(UpdateRefused, match="behind"):
        fresh.client.fetch(NAME)


def test_another_makers_root_and_files_open_nothing(maker, tmp_path):
    other = Maker(maker.world, tmp_path, "bolt")
    maker.repository.publish(maker.signed(NAME, CONTENT), NAME, CONTENT)
    with pytest.raises(UpdateRefused):
        Car(maker.world, tmp_path / "a", other.root).client.fetch(NAME)
    with pytest.raises(UpdateRefused):
        Car(maker.world, tmp_path / "b", maker.root, "blue-1").client.fetch(NAME)
    for name in (
        "..%2F..%2Fkeys%2Forders.key",
        "../../keys/orders.key",
        "....",
        "timestamp.json/..",
    ):
        answer = maker.world.get("red-1", f"/api/v1/updates/metadata/{name}")
        assert answer.status_code == 404, name


def test_payloads_are_data_that_the_reader_takes():
    model = Path(model_module.__file__).parent / "models" / "hazards.npz"
    thresholds = Path(catalogue.__file__).with_name("thresholds.yaml").read_bytes()
    assert read_payload_content(PayloadKind.MODEL, model.read_bytes()).detectors
    assert read_payload_content(PayloadKind.THRESHOLDS, thresholds).thresholds
    buffer = io.BytesIO()
    np.savez(buffer, card=np.array([{"a": 1}], dtype=object))  # needs pickle to be read
    bad = [
        (PayloadKind.MODEL, buffer.getvalue()), (PayloadKind.MODEL, b"\x80\x04cos\nsystem\n."),
        (PayloadKind.RULES, b"import os"), (PayloadKind.RULES, thresholds),
        (PayloadKind.THRESHOLDS, b"!!python/object/apply:os.system ['true']"),
        (PayloadKind.THRESHOLDS, b"a: &a [1]\nb: [*a, *a]"), (PayloadKind.RULES, b"{}"),
    ]  # fmt: skip
    for kind, content in bad:
        with pytest.raises(Refused):
            read_payload_content(kind, content)


def test_keys_that_sign_never_lie_with_the_data(tmp_path):
    for folder in ("data", "data/keys", "."):
        with pytest.raises(ConfigError, match="never lie"):
            signing.make_offline_keys(tmp_path / folder, tmp_path / "data")
    keys = signing.make_offline_keys(tmp_path / "offline", tmp_path / "data")
    assert [len(k) for k in keys.values()] == [3, 3]
    assert oct((tmp_path / "offline" / "root-1.key").stat().st_mode)[-3:] == "600"
    with pytest.raises(OutputError, match="exists"):
        signing.make_offline_keys(tmp_path / "offline", tmp_path / "data")
    (tmp_path / "no.key").write_text("no key")
    with pytest.raises(FileError):
        signing.load_key(tmp_path / "no.key")


def test_keys_and_signatures_by_the_commands(tmp_path):
    def run(*words):
        result = CliRunner().invoke(app, ["fleet", *map(str, words)])
        assert result.exit_code == 0, (result.output, result.exception)

    data, offline = tmp_path / "data", tmp_path / "offline"
    run("enrol", "manufacturer", "axle", "--tenant", "axle", "--data", data)
    run("keys", "--manufacturer", "axle", "--data", data, "--out", offline)
    (tmp_path / "rules.yaml").write_bytes(CONTENT)
    (current,) = data.glob("updates/*/metadata/1.targets.json")
    run("sign", tmp_path / "rules.yaml", "--kind", "rules", "--list", current,
        "--key", offline / "targets-1.key", "--key", offline / "targets-3.key",
        "--out", tmp_path / "next.json")  # fmt: skip
    signed = Metadata.from_bytes((tmp_path / "next.json").read_bytes())
    root = Metadata.from_bytes((offline / "root.json").read_bytes())
    root.signed.verify_delegate("targets", signed.signed_bytes, signed.signatures)
    assert list(signed.signed.targets) == [NAME]
    assert not list(data.rglob("root-*.key")) + list(data.rglob("targets-*.key"))


def sent(world, vehicle: str, drive: int, errors: tuple[int, int], release: str) -> None:
    summary = {"seconds": 60.0, "cycles": 600, "context": {}, "release": release,
               "judged": {"errors": errors[0], "before": errors[1]}}  # fmt: skip
    answer = world.send(vehicle, gzip.compress(json.dumps(summary).encode()), f"drive-{drive:08d}",
                        "drive", **{"X-Skidpad-Drive": f"{drive:032x}"})  # fmt: skip
    assert answer.status_code == 200, answer.text


def rolled_out(maker: Maker, content: bytes, hazards: list[str], errors, **plan) -> dict:
    """Release `content`; every chosen vehicle drives until the release has ended."""
    world = maker.world
    change = maker.change(content, hazards).json()["change"]
    name = payload_name(PayloadKind.RULES, content)
    release = maker.release(change, maker.signed(name, content), **plan).json()["release"]
    drive = 0
    for _ in range(200):
        for vehicle in ("red-1", "red-2"):
            world.clock.now += 10.0
            told = world.get(vehicle, "/api/v1/updates/assignment").json()
            drive += 1
            word = np.random.default_rng(drive).integers(0, 2)
            if told["release"] == release:
                sent(world, vehicle, hash_of(release, drive), errors(int(word)), release)
        now = world.post("axle", f"/api/v1/releases/{release}/look").json()["now"]
        if now["ended"]:
            return now
    raise AssertionError("undecided")


def hash_of(release: str, drive: int) -> int:
    return int(release[:8], 16) * 10_000 + drive


PLAN = {"stages": [0.999999, 1.0], "least_drives": 9, "looks": 2, "margin": 0.25}


@pytest.mark.req("C-003", "C-176", "C-178", "C-197")
def test_the_loop_from_hazard_to_re_evaluation_is_one_record(lite, tmp_path):
    """A good change is completed, a bad one is reverted, by what vehicles reported; all traced."""
    maker = Maker(lite, tmp_path)
    hazards = lite.send("red-1", packed(record(1), record(2))).json()["ids"]
    good = rolled_out(maker, rules(3.0), hazards, lambda word: (0, 1 + word), **PLAN)
    assert good["ended"] == "completed"
    stands = lite.get("red-1", "/api/v1/updates/assignment").json()
    assert stands["payload"] == good["payload"]
    bad = rolled_out(maker, rules(9.0), hazards, lambda word: (3 + word, 0), **PLAN)
    assert (bad["ended"], bad["before"], bad["stage"]) == ("reverted", good["payload"], 0)
    assert lite.get("red-1", "/api/v1/updates/assignment").json() == stands
    before = {"kind": "rules", "payload": base64.b64encode(rules()).decode()}
    table = lite.post(
        "axle", f"/api/v1/changes/{bad['change']}/evaluate", content=json.dumps(before)
    )
    assert {row["hazard"] for row in table.json()} == set(hazards)
    record_ = lite.get("axle", f"/api/v1/changes/{bad['change']}").json()
    assert [e["what"] for e in record_["events"]] == ["proposed", "released", "re-evaluated"]
    assert record_["hazards"] == hazards
    (release,) = record_["releases"]
    assert [e["what"] for e in release["events"]] == ["stage", "looked", "reverted"]
    assert release["events"][-1]["detail"]["to"] == good["payload"]
    assert len(record_["evaluations"]) == 2


def under_release(maker: Maker, errors: tuple[int, int], drives: int) -> str:
    """A release under which chosen vehicles drove, and at which nobody has looked."""
    (hazard,) = maker.world.send("red-1", packed(record(1))).json()["ids"]
    change = maker.change(CONTENT, [hazard]).json()["change"]
    release = maker.release(change, maker.signed(NAME, CONTENT), **PLAN).json()["release"]
    for drive in range(drives):
        maker.world.clock.now += 10.0
        vehicle = ("red-1", "red-2")[drive % 2]
        sent(maker.world, vehicle, hash_of(release, drive), errors, release)
    return release


@pytest.mark.req("C-176")
def test_a_bad_update_is_taken_back_without_anybody_asking(world, tmp_path):
    release = under_release(Maker(world, tmp_path), (3, 0), 24)
    upkeep = Upkeep(world.fleet)
    upkeep.work()
    (now,) = world.get("axle", "/api/v1/releases").json()
    assert [e["what"] for e in now["events"]] == ["stage", "looked", "reverted"]
    assert {e["actor"] for e in now["events"][1:]} == {"upkeep"}
    upkeep.work()  # what has ended is not looked at
    assert world.get("axle", "/api/v1/releases").json() == [now]
    assert world.post("axle", f"/api/v1/releases/{release}/look").status_code == 409


@pytest.mark.req("C-176")
def test_of_two_who_look_at_one_moment_one_looks(world, tmp_path, monkeypatch):
    """Between the reading and the keeping of one look the other process takes its own."""
    release = under_release(Maker(world, tmp_path), (0, 1), 24)
    who, judged = world.accounts["axle"].principal, []

    def slow(differences, plan, left):
        judged.append(len(differences))
        if len(judged) == 1:
            assert rollout.look_at(world.fleet, who, release) is not None
        return look(differences, plan, left)

    monkeypatch.setattr(rollout, "look", slow)
    with pytest.raises(Refused) as refused:
        rollout.look_at(world.fleet, who, release)
    assert refused.value.status == 409
    assert len(judged) == 2
    (now,) = world.get("axle", "/api/v1/releases").json()
    assert [e["what"] for e in now["events"]].count("looked") == 1


def test_what_a_release_needs(lite, tmp_path):
    maker = Maker(lite, tmp_path)
    (hazard,) = lite.send("red-1", packed(record(1))).json()["ids"]
    (foreign,) = lite.send("blue-1", packed(record(1))).json()["ids"]
    assert maker.change(rules(), [foreign]).status_code == 404
    assert maker.change(b"no rules", [hazard]).status_code == 422
    assert maker.change(rules(), []).status_code == 422
    change = maker.change(CONTENT, [hazard]).json()["change"]
    alone = maker.signed(NAME, CONTENT, maker.keys["targets"][:1])
    assert maker.release(change, alone).status_code == 422
    assert maker.release(change, maker.signed(NAME, CONTENT), least_drives=3).status_code == 422
    first = maker.release(change, maker.signed(NAME, CONTENT))
    assert first.status_code == 200
    second = maker.change(rules(2.0), [hazard]).json()["change"]
    busy = maker.release(
        second, maker.signed(payload_name(PayloadKind.RULES, rules(2.0)), rules(2.0))
    )
    assert busy.status_code == 409
    nothing = lite.post("axle", f"/api/v1/releases/{first.json()['release']}/look").json()
    assert nothing["finding"] is None  # too little was driven, and no look is spent


def test_another_makers_ids_in_a_request_are_absent(lite, tmp_path):
    """Ids in the body, as those in the path."""
    maker, other = Maker(lite, tmp_path), Maker(lite, tmp_path, "bolt")
    red = [record(k, (120.0 + k, 30.0)) for k in range(4)]
    hazards = lite.send("red-1", packed(*red)).json()["ids"]
    (own,) = lite.send("blue-1", packed(record(1))).json()["ids"]
    lite.post("axle", "/api/v1/analyses")
    cluster = lite.get("axle", "/api/v1/clusters").json()[0]["id"]
    change = maker.change(CONTENT, hazards[:1]).json()["change"]
    assert other.release(change, other.signed(NAME, CONTENT)).status_code == 404
    text = {"kind": "rules", "payload": base64.b64encode(CONTENT).decode(), "reason": "a test",
            "hazards": [own], "cluster": cluster}  # fmt: skip
    assert lite.post("bolt", "/api/v1/changes", content=json.dumps(text)).status_code == 404
    assert lite.post("bolt", "/api/v1/changes",
                     content=json.dumps(text | {"cluster": None})).status_code == 200  # fmt: skip
