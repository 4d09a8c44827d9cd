"""The vehicle's side of an order: obeyed only when it answers a question just asked."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable
from enum import Enum
from math import inf

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

from skidpad.fleet.alerting.orders import VALID_S, Order

OPEN_MAX = 8  # questions that may be open at once
V_MAX = {Order.STOP: 0.0, Order.SLOW: 2.0, Order.RESUME: inf}  # m/s; 2.0: assumption


class Verdict(str, Enum):
    """What came of an order; only `OBEYED` changes how the vehicle drives."""

    OBEYED = "obeyed"
    STANDING = "standing"  # it was stopped by an order, and goes on by none
    FORGED = "forged"  # not signed by the fleet's key
    FOREIGN = "foreign"  # for another vehicle, or not an order
    REPLAYED = "replayed"  # answers no open question
    EXPIRED = "expired"


class Receiver:
    """Checks orders against the pinned key and the vehicle's own monotonic clock."""

    def __init__(self, public: bytes, vehicle: str, clock: Callable[[], float]) -> None:
        self._key = Ed25519PublicKey.from_public_bytes(public)
        self.vehicle, self.clock = vehicle, clock
        self._asked: dict[str, float] = {}
        self.v_max = inf  # m/s; 0: it is in a minimal-risk stop

    def challenge(self) -> str:
        """Returns a fresh random challenge and opens it; of all open ones the newest OPEN_MAX stay."""
        while len(self._asked) >= OPEN_MAX:
            del self._asked[next(iter(self._asked))]
        name = secrets.token_hex(16)
        self._asked[name] = self.clock()
        return name

    def receive(self, text: str, signature: str) -> Verdict:
        """Returns the verdict on an order; when obeyed, sets `v_max`. A stop stands against later orders.

        Its challenge is then used up. signature: hexadecimal.
        """
        try:
            self._key.verify(bytes.fromhex(signature), text.encode())
        except (InvalidSignature, ValueError):
            return Verdict.FORGED
        order = json.loads(text)
        if order["vehicle"] != self.vehicle or order["what"] not in set(Order):
            return Verdict.FOREIGN
        asked = self._asked.pop(order["challenge"], None)
        if asked is None:
            return Verdict.REPLAYED
        if not 0.0 <= self.clock() - asked <= VALID_S:
            return Verdict.EXPIRED
        if self.v_max == 0.0:
            return Verdict.STANDING
        self.v_max = V_MAX[Order(order["what"])]
        return Verdict.OBEYED
