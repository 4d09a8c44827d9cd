"""Serve a producer's pictures until it or the person ends it."""

from __future__ import annotations

import os
import sys
import time
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from skidpad.cockpit.bridge import Bridge
from skidpad.cockpit.producer import Producer
from skidpad.pages.server import Place, Server
from skidpad.pages.site import nicegui, site

if TYPE_CHECKING:
    from fastapi import FastAPI

PATIENCE = 0.5  # s between two looks at the keyboard's Ctrl-C
LAST_WORD = 1.5  # s in which the page shows how it ended


def serve(
    producer: Producer,
    kind: str,
    place: Place,
    say: Callable[[str], None],
    timeline: dict[str, Any] | None = None,
    browser: bool = True,
) -> str:
    """Serve until the end and return its sentence. kind: drive or replay."""
    try:
        _serve(producer, kind, place, say, timeline, browser)
    finally:
        producer.stop()
    return producer.outcome()


def _serve(
    producer: Producer,
    kind: str,
    place: Place,
    say: Callable[[str], None],
    timeline: dict[str, Any] | None,
    browser: bool,
) -> None:
    bridge = Bridge(producer)
    with Server(
        application(bridge, kind, timeline), place
    ) as server:  # first, as a port may be in use
        producer.start()
        address = server.address()
        say(f"{kind}: {address}  (Ctrl-C ends it)")
        if browser and has_screen():
            webbrowser.open(address)
        try:
            while not producer.wait(PATIENCE):
                pass
            if len(bridge.tabs):
                time.sleep(LAST_WORD)
        except KeyboardInterrupt:
            say("ending ...")


def application(bridge: Bridge, kind: str, timeline: dict[str, Any] | None) -> FastAPI:
    """The page and its stream."""
    nicegui()
    from skidpad.cockpit.page import STYLE, build
    from skidpad.cockpit.stream import add_stream

    pages = {"/": build(bridge, kind, timeline)}
    return site(f"Skidpad {kind}", pages, routes=lambda a: add_stream(a, bridge), style=STYLE)


def has_screen() -> bool:
    """A browser could be seen here; a terminal's text browser would only take the terminal."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
