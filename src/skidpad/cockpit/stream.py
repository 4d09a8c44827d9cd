"""The websocket of a tab: pictures out as fast as they are acknowledged, words in."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import Any

from fastapi import FastAPI, WebSocket, WebSocketDisconnect

from skidpad.cockpit.bridge import Bridge

POLL = 0.006  # s between two looks for a new picture
CHECK = 0.05  # s between two looks at the dead man's switch and at tabs that sleep
ASK = 1.0  # s between two questions whether a tab is awake: timers of a hidden page may stand still
LOST_AFTER = 2.0  # s without an acknowledgement after which the next picture is sent anyway


class Stream:
    """Sends pictures to one tab and takes its words; keeps what was sent and what was taken."""

    def __init__(self, socket: WebSocket, bridge: Bridge, tab: str) -> None:
        self.socket, self.bridge, self.tab = socket, bridge, tab
        self.sent = self.taken = 0
        self.role: bool | None = None

    async def run(self) -> None:
        """Serves the tab until it is closed or the producer ends, then leaves the bridge."""
        await self.socket.accept()
        self.bridge.tabs.note_tab(self.tab)
        tasks = [asyncio.ensure_future(part()) for part in (self._send, self._receive, self._check)]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                with suppress(WebSocketDisconnect, RuntimeError):  # it was closed while sending
                    task.result()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self.bridge.leave(self.tab)

    async def _send(self) -> None:
        """Sends the newest picture as soon as the last is taken, until the producer ends."""
        waited = unasked = 0.0
        while True:
            await self._tell_role()
            if unasked > ASK:
                unasked = 0.0
                await self._tell(awake="?")
            if self.taken >= self.sent or waited > LOST_AFTER:
                newest = self.bridge.newest(self.sent)
                if newest is not None:
                    self.sent, message = newest
                    waited = 0.0
                    await self.socket.send_bytes(message)
            said = self.bridge.producer.result
            if said is not None:
                await self._tell(ended=said[1])
                return
            await asyncio.sleep(POLL)
            waited += POLL
            unasked += POLL

    async def _tell_role(self) -> None:
        """Tells the tab whether it drives, where that has changed."""
        role = self.bridge.may(self.tab)
        if role is not self.role:
            self.role = role
            await self._tell(drives=role, tabs=len(self.bridge.tabs))

    async def _tell(self, **what: Any) -> None:
        """Sends the named values to the tab as JSON."""
        await self.socket.send_text(json.dumps(what))

    async def _receive(self) -> None:
        """Takes the tab's messages in as they come, those that cannot be read left out."""
        while True:
            message = await self.socket.receive_text()
            self.bridge.tabs.note_tab(self.tab)  # whatever it says: it is awake
            with suppress(ValueError, AttributeError):  # not a message of ours
                await self._take(json.loads(message))

    async def _take(self, message: dict[str, Any]) -> None:
        """Takes in one message: a picture acknowledged, a sign of life, or a word to act on."""
        if "ack" in message:
            self.taken = int(message["ack"])
            return
        if "awake" in message:
            return
        wrong = self.bridge.say(self.tab, str(message.get("word")), message.get("value"))
        if wrong is not None:
            await self._tell(wrong=wrong)

    async def _check(self) -> None:
        """Has the bridge check its tabs every CHECK s."""
        while True:
            await asyncio.sleep(CHECK)
            self.bridge.check()


def add_stream(app: FastAPI, bridge: Bridge) -> None:
    """Adds the route /stream of the websocket to the application."""

    @app.websocket("/stream")
    async def stream(socket: WebSocket, tab: str) -> None:
        await Stream(socket, bridge, tab).run()
