"""Serve a producer's pictures until it or the person ends it."""

from __future__ import annotations

import os
import sys
import time
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING

from skidpad.cockpit.about import About
from skidpad.cockpit.bridge import Bridge
from skidpad.cockpit.producer import Producer
from skidpad.pages.server import Place, Server
from skidpad.pages.site import nicegui, site

if TYPE_CHECKING:
    from fastapi import FastAPI

PATIENCE = 0.5  # s between two looks at the keyboard's Ctrl-C
LAST_WORD = 1.5  # s in which the page shows how it ended
# s that a hidden page may sleep before it is loaded anew; a closed one is kept as long. Our choice.
SLEEP = 600.0


def serve(
    producer: Producer,
    about: About,
    place: Place,
    say: Callable[[str], None],
    browser: bool = True,
) -> str:
    """Serves the page until the run ends or Ctrl-C; returns a sentence on its end.

    say: takes the address. browser: opens one where there is a screen. InputError or SkidpadError
    when the run was refused or failed.
    """
    try:
        _serve(producer, about, place, say, browser)
    finally:
        producer.stop()
    return producer.outcome()


def _serve(
    producer: Producer,
    about: About,
    place: Place,
    say: Callable[[str], None],
    browser: bool,
) -> None:
    """Serves the page until the producer ends or Ctrl-C; opens a browser if wanted."""
    bridge = Bridge(producer, about.pauses)
    with Server(application(bridge, about), place) as server:  # first, as a port may be in use
        producer.start()
        address = server.address()
        say(f"{about.kind}: {address}  (Ctrl-C ends it)")
        if browser and has_screen():
            webbrowser.open(address)
        try:
            while not producer.wait(PATIENCE):
                pass
            if len(bridge.tabs):
                time.sleep(LAST_WORD)
        except KeyboardInterrupt:
            say("ending ...")


def application(bridge: Bridge, about: About) -> FastAPI:
    """Returns the application with the page at / and the stream of pictures."""
    nicegui()
    from skidpad.cockpit.page import STYLE, build
    from skidpad.cockpit.stream import add_stream

    pages = {"/": build(bridge, about)}
    return site(
        f"Skidpad {about.kind}",
        pages,
        routes=lambda app: add_stream(app, bridge),
        style=STYLE,
        kept=SLEEP,
    )


def has_screen() -> bool:
    """Returns True where a browser could be seen; a text browser would only take the terminal."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
