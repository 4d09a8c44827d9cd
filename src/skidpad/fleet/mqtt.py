"""Batches over MQTT 5: a request with user properties, and the receipt as its response (C-151).

A vehicle publishes to `skidpad/batches/<kind>` with its credential, key, drive and time as user
properties and says where it waits for the answer. It is the same batch, checked by the same code and
acknowledged after the same commit as over HTTPS; whatever is lost on the way comes again under its key.
The broker sees credentials: only the fleet may be allowed to read these topics, and beyond one machine
it is reached by TLS only.
"""

from __future__ import annotations

import asyncio
import json
import logging
import re
import threading
from typing import Any

from skidpad.core.errors import SkidpadError
from skidpad.fleet.api.guard import Guard
from skidpad.fleet.broker import ANSWERS, TOPIC, Broker, connect_to, library, properties
from skidpad.fleet.checking import DRIVE, KEY, TIME_MAX, MessageHead, check_batch
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.intake import plain
from skidpad.fleet.words import Action, Kind, Refused

AT_ONCE = 64  # batches that are looked at before one of them is answered
WAITING = 128  # batches that wait to be looked at; what comes beyond is lost and sent again
ROOM = 65536  # bytes of a message besides its body
ANSWER = f"{ANSWERS}/[0-9a-f]{{32}}"  # where vehicles wait
AGAIN_S = 2.0  # until a broker that went away is tried again
log = logging.getLogger(__name__)


class BatchListener:
    """Takes batches from a broker in one thread and answers them."""

    def __init__(self, fleet: Fleet, broker: Broker, timeout_s: float = 10.0) -> None:
        library()
        self.fleet, self.broker, self.timeout_s = fleet, broker, timeout_s
        self.guard = Guard(fleet)
        self.listening = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._main: asyncio.Task[None] | None = None
        self._thread = threading.Thread(target=self._run, name="fleet-mqtt")

    def start(self) -> None:
        """Starts the thread, which connects again whenever the broker went away."""
        self._main = self._loop.create_task(self._listen())
        self._thread.start()

    def close(self) -> None:
        """Ends the thread, the first time; a batch without an answer is sent again by its vehicle."""
        if self._loop.is_closed():
            return
        if self._main is not None:
            self._loop.call_soon_threadsafe(self._main.cancel)
            self._thread.join()
        self._loop.close()

    def _run(self) -> None:
        """Runs the listener's loop until it is cancelled; runs in a thread."""
        assert self._main is not None
        try:
            self._loop.run_until_complete(self._main)
        except asyncio.CancelledError:
            return

    async def _listen(self) -> None:
        """Connects to the broker and answers its batches; after a failure tries again in AGAIN_S s."""
        failures = (library().MqttError, OSError, TimeoutError)
        while True:
            try:
                async with connect_to(
                    self.broker, self.timeout_s, self.fleet.limits.body + ROOM, WAITING
                ) as client:
                    await client.subscribe(f"{TOPIC}/+", qos=1)
                    self.listening.set()
                    await self._serve(client)
            except failures as error:
                log.warning("mqtt: %s", error)
            self.listening.clear()
            await asyncio.sleep(AGAIN_S)

    async def _serve(self, client: Any) -> None:
        """Answers each message in a task of its own, at most AT_ONCE at the same time."""
        free, tasks = asyncio.Semaphore(AT_ONCE), set()
        async for message in client.messages:
            await free.acquire()
            task = asyncio.ensure_future(self._answer(client, message))
            tasks.add(task)
            task.add_done_callback(tasks.discard)
            task.add_done_callback(lambda _: free.release())

    async def _answer(self, client: Any, message: Any) -> None:
        """Takes a message's batch and publishes status and content to its response topic.

        Where that topic is not allowed the batch is taken unanswered; an answer that cannot be published
        is logged and lost.
        """
        where = str(getattr(message.properties, "ResponseTopic", ""))
        status, content = await self._take_message(message)
        if not re.fullmatch(ANSWER, where):  # else anybody could have the fleet publish anywhere
            return
        about = properties(CorrelationData=getattr(message.properties, "CorrelationData", b""))
        answer = json.dumps({"status": status, "content": content})
        try:
            await client.publish(where, answer, qos=1, properties=about)
        except (library().MqttError, OSError) as error:
            log.warning("mqtt: an answer was lost (%s)", error)

    async def _take_message(self, message: Any) -> tuple[int, dict[str, Any]]:
        """Takes a message's batch; returns status and content as over HTTPS, never raises."""
        told = dict(getattr(message.properties, "UserProperty", []))
        try:
            who = self.guard.principal(told.get("authorization"))
            if not who.may(Action.REPORT):
                raise Refused(403, f"the role {who.role.value} may not {Action.REPORT.value}")
            if len(message.payload) > self.fleet.limits.body:
                raise Refused(413, f"a body may have {self.fleet.limits.body} bytes")
            about = _read_properties(str(message.topic), told)
            batch = await asyncio.to_thread(check_batch, self.fleet, who, about, message.payload)
            return 200, plain(await asyncio.wrap_future(self.fleet.intake.submit(batch)))
        except Refused as error:
            return error.status, {"detail": str(error)}
        except SkidpadError as error:
            return 422, {"detail": str(error)}
        except Exception:  # this batch's answer; the next one is looked at all the same
            log.exception("a batch could not be taken")
            return 500, {"detail": "the fleet failed; try again"}


def _read_properties(topic: str, told: dict[str, str]) -> MessageHead:
    """Returns what stands beside a message's body; Refused (422) when it is not what it must be."""
    kind, key, drive = topic.rpartition("/")[2], told.get("key", ""), told.get("drive", "")
    if kind not in {k.value for k in Kind}:
        raise Refused(422, f"the topic must end with one of: {', '.join(k.value for k in Kind)}")
    if not re.fullmatch(KEY, key) or not re.fullmatch(DRIVE, drive):
        raise Refused(422, f"key must match {KEY} and drive {DRIVE}")
    try:
        time = float(told["time"]) if "time" in told else None
    except ValueError:
        time = float("nan")
    if time is not None and not -TIME_MAX <= time <= TIME_MAX:
        raise Refused(422, f"time must be a number between {-TIME_MAX:g} and {TIME_MAX:g}")
    return MessageHead(Kind(kind), key, drive, time)
