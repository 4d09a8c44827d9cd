"""A vehicle on the road: it raises alerts at the fleet, asks for orders, tells what it did (C-175).

Driving is not known here: who drives reads `v_max` at every cycle, and nothing makes it wait for the
network. Without the fleet the vehicle drives on as it was last ordered; what is to be told waits.
"""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import msgspec

from skidpad.core.errors import BackendError, FileError
from skidpad.core.text.told import on_a_line
from skidpad.fleet.alerting.keeping import AlertText
from skidpad.fleet.alerting.receiver import Receiver, Verdict
from skidpad.fleet.rounds import Rounds

WAIT_S = 1.0  # that the fleet holds a question for orders open; half of an order's validity
AGAIN_S = 0.5  # after a question that was not answered
KEY_BYTES = 32  # Ed25519
TELL_S = 0.5  # between two tries to tell what waits
TOLD = {Verdict.OBEYED: "obeyed", Verdict.STANDING: "standing", Verdict.EXPIRED: "refused"}
LATER = frozenset(
    {408, 429}
)  # refusals that may end by themselves, besides those of a failing server


def pinned_key(file: Path) -> bytes:
    """Returns the fleet's public key (KEY_BYTES) of the hexadecimal file; FileError when it is none."""
    try:
        public = bytes.fromhex(file.read_text(encoding="ascii"))
    except (OSError, ValueError) as error:
        raise FileError(
            f"{file}: cannot be read as a key for orders ({on_a_line(error)})"
        ) from error
    if len(public) != KEY_BYTES:
        raise FileError(f"{file}: a key for orders has {KEY_BYTES} bytes, got {len(public)}")
    return public


class Sent(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An order as it comes."""

    order: str
    signature: str


@dataclass(frozen=True, slots=True)
class _Word:
    """Holds one request to the fleet that waits to be sent: path, headers and body."""

    path: str
    headers: dict[str, str]
    body: bytes


class Aboard:
    """Asks the fleet for orders and sends it alerts, in two threads from `start` to `close`.

    `ask` and `tell` are a round of each.
    """

    def __init__(
        self,
        client: httpx.Client,
        public: bytes,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """BackendError unless the fleet knows the vehicle of the client's credential.

        public: of the fleet's key for orders, pinned. clock: monotonic, counts the validity of orders.
        """
        self.client, self.say = client, say
        try:
            answer = client.get("/api/v1/vehicle")
        except httpx.TransportError as error:
            raise BackendError(f"the fleet cannot be reached ({on_a_line(error)})") from error
        if answer.status_code != 200:
            raise BackendError(f"the fleet does not accept this vehicle: {answer.text}")
        self.receiver = Receiver(public, answer.json()["vehicle"], clock)
        self.raised = self.obeyed = 0
        self._waiting: deque[_Word] = deque()
        self._threads = (Rounds("orders", self.ask, 0.0), Rounds("alerts", self.tell, TELL_S))

    @property
    def v_max(self) -> float:
        """Returns the most speed that orders allow, m/s: inf without one, 0 in a minimal-risk stop."""
        return self.receiver.v_max

    @property
    def waiting(self) -> int:
        """Returns how many messages the fleet has not taken yet."""
        return len(self._waiting)

    def start(self) -> None:
        """Starts the threads that ask and tell."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Ends both threads, and tries a last time to tell what waits; safe to call twice."""
        for thread in self._threads:
            thread.close()
        self.tell()

    def alert(self, key: str, alert: AlertText) -> None:
        """Queues an alert and wakes the sending thread, without waiting; key: of this alert alone."""
        headers = {"Idempotency-Key": key, "X-Skidpad-Time": f"{time.time():.3f}"}
        self._waiting.append(_Word("/api/v1/alerts", headers, msgspec.json.encode(alert)))
        self.raised += 1
        self._threads[1].wake()

    def ask(self, wait_s: float = WAIT_S) -> None:
        """Asks for orders, obeys the good ones and queues their words; waits AGAIN_S without an answer."""
        asked = {"challenge": self.receiver.challenge(), "wait": f"{wait_s:g}"}
        answer = self._request("GET", "/api/v1/orders", params=asked)
        if answer is None or answer.status_code != 200:
            self._threads[0].ended.wait(AGAIN_S)
            return
        try:
            found = msgspec.json.decode(answer.content, type=list[Sent])
        except (msgspec.MsgspecError, UnicodeError):
            found = []  # what cannot be read orders nothing
        for one in found:
            self._judge(one)

    def _judge(self, one: Sent) -> None:
        """Checks an order and says the verdict; of a well signed one a word is queued for the fleet."""
        verdict = self.receiver.receive(one.order, one.signature)
        what = json.loads(one.order) if verdict in TOLD else {}
        self.say(f"an order{' to ' + what['what'] if what else ''}: {verdict.value}")
        self.obeyed += verdict is Verdict.OBEYED
        if what:  # of a good signature, for this vehicle
            self._waiting.append(_Word(f"/api/v1/orders/{what['order']}/{TOLD[verdict]}", {}, b""))
            self._threads[1].wake()

    def tell(self) -> None:
        """Sends what waits, in order, and stops at the first that gets no answer, a 5xx, 408 or 429.

        What is refused otherwise is said and dropped.
        """
        while self._waiting:
            word = self._waiting[0]
            answer = self._request("POST", word.path, headers=word.headers, content=word.body)
            if answer is None or answer.status_code >= 500 or answer.status_code in LATER:
                return
            if answer.status_code != 200:
                self.say(f"the fleet did not take {word.path}: {answer.status_code} {answer.text}")
            self._waiting.popleft()

    def _request(self, method: str, path: str, **rest: Any) -> httpx.Response | None:
        """Sends a request and returns its answer, of any status; None when the fleet cannot be reached."""
        try:
            return self.client.request(method, path, **rest)
        except httpx.TransportError:
            return None
