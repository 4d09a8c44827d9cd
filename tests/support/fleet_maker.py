"""A maker of vehicles: its off-line keys, changes and releases."""

from __future__ import annotations

import base64
import json
import time
from pathlib import Path

import yaml

from skidpad.evidence.channels import hazards as hazards_module
from skidpad.fleet.updates import signing
from skidpad.fleet.updates.payloads import PayloadKind, payload_name
from support.fleet_world import World


def rules(limit: float = 3.2) -> bytes:
    """The practical rules with another limit of the time to collision; no anchors."""
    table = yaml.safe_load(Path(hazards_module.__file__).with_name("hazard_rules.yaml").read_text())
    text = json.dumps({"practical": table["practical"]})
    assert "ttc_ahead < 3.2" in text
    return text.replace("ttc_ahead < 3.2", f"ttc_ahead < {limit}").encode()


class Maker:
    """A maker's off-line keys and what it does with them, in a fleet whose clock is the real one."""

    def __init__(self, world: World, folder: Path, name: str = "axle") -> None:
        self.world, self.name = world, name
        world.clock.now = time.time()  # python-tuf goes by the system's clock
        self.keys = signing.make_offline_keys(folder / f"offline {name}", folder / "data")
        tenant = world.accounts[name].principal.tenant
        self.repository = world.fleet.repository(tenant)
        online = signing.new_key(world.fleet.online_key(tenant))
        self.root = signing.make_root(self.keys, online, world.clock.now)
        first = signing.empty_targets(self.keys["targets"][:2], world.clock.now)
        self.repository.begin(self.root, first)

    def signed(self, name: str, content: bytes, signers=None) -> bytes:
        signers = self.keys["targets"][1:] if signers is None else signers
        current = self.repository.targets()
        return signing.add_target(current, (name, content), {}, signers, self.world.clock.now)

    def change(self, content: bytes, hazards: list[str], kind: str = "rules"):
        text = {"kind": kind, "payload": base64.b64encode(content).decode(), "reason": "a test",
                "hazards": hazards}  # fmt: skip
        return self.world.post(self.name, "/api/v1/changes", content=json.dumps(text))

    def release(self, change: str, targets: bytes, **plan):
        text = {"change": change, "targets": base64.b64encode(targets).decode(), "plan": plan}
        return self.world.post(self.name, "/api/v1/releases", content=json.dumps(text))


NAME, CONTENT = payload_name(PayloadKind.RULES, rules()), rules()


def released(world, folder, hazard: str) -> tuple[str, str]:
    """A change of the red vehicles' maker, and its release."""

    maker = Maker(world, folder)
    change = maker.change(CONTENT, [hazard]).json()["change"]
    return change, maker.release(change, maker.signed(NAME, CONTENT)).json()["release"]
