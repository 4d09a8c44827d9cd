"""Sending a spool: each batch until it is acknowledged, and nothing is lost when nobody answers."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import httpx

from skidpad.core.errors import BackendError
from skidpad.fleet.broker import ANSWERS, TOPIC, Broker, connect_to, library, request_properties
from skidpad.fleet.identity import new_id
from skidpad.fleet.spool import Spool, Waiting

TIMEOUT_S = 60.0
FINAL = frozenset({400, 409, 413, 422})  # this batch will never be taken
DENIED = frozenset({401, 403})
FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 300.0
Post = Callable[[Waiting], httpx.Response]


@dataclass(frozen=True, slots=True)
class Sent:
    """What became of a spool."""

    acknowledged: int
    refused: int
    waiting: int

    def __str__(self) -> str:
        return f"{self.acknowledged} acknowledged, {self.refused} refused, {self.waiting} waiting"


def poster(client: httpx.Client, clock: Callable[[], float] = time.time) -> Post:
    """Returns a function that sends a batch through `client`, whose headers carry the credential."""

    def post(batch: Waiting) -> httpx.Response:
        headers = {
            "Idempotency-Key": batch.key,
            "X-Skidpad-Drive": batch.drive,
            "X-Skidpad-Time": f"{clock():.3f}",
            "Content-Type": "application/gzip",
        }
        url = f"/api/v1/batches/{batch.kind.value}"
        return client.post(url, content=batch.body, headers=headers)

    return post


def mqtt_poster(
    broker: Broker, token: str, clock: Callable[[], float] = time.time, timeout_s: float = TIMEOUT_S
) -> Post:
    """Returns a function that sends a batch through a broker; its answer reads like one over HTTPS.

    That raises httpx.TransportError when no answer comes within `timeout_s`.
    """
    library()

    def post(batch: Waiting) -> httpx.Response:
        told = {
            "authorization": f"Bearer {token}", "key": batch.key, "drive": batch.drive,
            "time": f"{clock():.3f}",
        }  # fmt: skip
        try:
            answer = asyncio.run(_through(broker, batch, told, timeout_s))
            return httpx.Response(int(answer["status"]), json=answer["content"])
        except (library().MqttError, OSError, TimeoutError) as error:
            raise httpx.TransportError(f"mqtt: {error}") from error
        except (ValueError, KeyError, TypeError) as error:
            raise httpx.TransportError("mqtt: an answer that cannot be read") from error

    return post


async def _through(
    broker: Broker, batch: Waiting, told: dict[str, str], timeout_s: float
) -> dict[str, Any]:
    """Sends a batch over MQTT and returns the fleet's answer, awaited for `timeout_s` s."""
    where = f"{ANSWERS}/{new_id()}"
    async with connect_to(broker, timeout_s) as client:
        await client.subscribe(where, qos=1)
        about = request_properties(where, told)
        topic = f"{TOPIC}/{batch.kind.value}"
        await client.publish(topic, batch.body, qos=1, properties=about)
        message = await asyncio.wait_for(anext(aiter(client.messages)), timeout_s)
        answer: dict[str, Any] = json.loads(message.payload)
        return answer


def send(spool: Spool, post: Post) -> Sent:
    """Sends what waits, once each, until the fleet is busy or out of reach; returns the counts.

    BackendError when the credential is not accepted: waiting would not help.
    """
    acknowledged = refused = 0
    for batch in spool.batches():
        try:
            answer = post(batch)
        except httpx.TransportError:
            break  # off line: the rest would fare alike
        if answer.status_code in DENIED:
            raise BackendError(f"the fleet does not accept this vehicle: {_detail(answer)}")
        if answer.status_code == 200:
            receipt = _receipt(answer)
            if receipt is None:
                break  # not from the fleet: the log-in page of a wireless network, for example
            spool.acknowledge(batch.key, receipt)
            acknowledged += 1
        elif answer.status_code in FINAL:
            spool.refuse(batch.key)
            refused += 1
        else:
            break  # busy
    return Sent(acknowledged, refused, spool.count())


def send_all(
    spool: Spool, post: Post, patience_s: float, sleep: Callable[[float], None] = time.sleep
) -> Sent:
    """Sends until nothing waits, pausing ever longer; gives up after `patience_s` of pauses.

    Returns the sums of all rounds. BackendError as in `send`.
    """
    pause, paused, acknowledged, refused = FIRST_PAUSE_S, 0.0, 0, 0
    while True:
        sent = send(spool, post)
        acknowledged, refused = acknowledged + sent.acknowledged, refused + sent.refused
        if not sent.waiting or paused >= patience_s:
            return Sent(acknowledged, refused, sent.waiting)
        pause = FIRST_PAUSE_S if sent.acknowledged else min(pause * 2.0, LONGEST_PAUSE_S)
        rest = min(pause, patience_s - paused)
        sleep(rest)
        paused += rest


def rounds(
    look: Callable[[], object],
    send_now: Callable[[], Sent],
    every_s: float,
    sleep: Callable[[float], None] = time.sleep,
) -> Iterator[Sent]:
    """Yields what became of the spool after each round: `look`, `send_now`, then `every_s` s of sleep."""
    while True:
        look()
        yield send_now()
        sleep(every_s)


def _receipt(answer: httpx.Response) -> dict[str, Any] | None:
    """Returns the fleet's receipt for a batch; None where the answer is no JSON object, so not its own."""
    try:
        receipt = answer.json()
    except ValueError:
        return None
    return receipt if isinstance(receipt, dict) else None


def _detail(answer: httpx.Response) -> Any:
    """Returns why a request was refused: the answer's detail, or its status."""
    try:
        return answer.json()["detail"]
    except (ValueError, KeyError, TypeError):
        return f"status {answer.status_code}"
