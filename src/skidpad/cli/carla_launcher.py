"""`skidpad carla-launcher`: a `CarlaUE4.sh` that starts our server, for programs that start CARLA.

Such programs call `$CARLA_ROOT/CarlaUE4.sh` with Unreal's options. Those about ports and the map are
understood (CARLA's documentation, "Command-line options"); those about graphics and sound say nothing
to a server without a window.
"""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from skidpad.core.errors import ConfigError

NAME = "CarlaUE4.sh"
PORT = re.compile(
    r"-(?:carla-rpc-port|carla-port|carla-world-port|world-port)=(\d+)", re.IGNORECASE
)
STREAMING = re.compile(r"-carla-streaming-port=(\d+)", re.IGNORECASE)
MAP = re.compile(r"(?:/Game/(?:[\w/]*/)?)?(\w+)")
UNREAL = "--unreal"  # what follows are Unreal's options
MARK = "# Written by `skidpad carla-launcher`"


def carla_launcher(
    folder: Annotated[Path, typer.Argument(help="What programs take for CARLA_ROOT.")],
    options: Annotated[
        list[str] | None, typer.Argument(help="After --: options of `skidpad carla-server`.")
    ] = None,
) -> None:
    """Write CarlaUE4.sh, so that programs that start CARLA start `skidpad carla-server`."""
    script = folder / NAME
    if script.exists() and MARK not in script.read_text(encoding="utf-8", errors="replace"):
        raise ConfigError(f"{script} is there and not ours; name another folder")
    command = [sys.executable, "-m", "skidpad", "carla-unreal", *(options or []), UNREAL]
    text = f'#!/bin/sh\n{MARK}\nexec {shlex.join(command)} "$@"\n'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        script.write_text(text, encoding="utf-8")
        script.chmod(0o755)
    except OSError as error:
        raise ConfigError(f"{script} cannot be written: {error.strerror}") from error
    typer.echo(f"export CARLA_ROOT={shlex.quote(str(folder.resolve()))}")


def translate_options(arguments: list[str]) -> list[str]:
    """Returns options of `skidpad carla-server`: those before UNREAL as they are, Unreal's translated.

    Prints what is asked for and cannot be had.
    """
    at = arguments.index(UNREAL) if UNREAL in arguments else 0
    own, given = arguments[:at], arguments[at + 1 :]
    if problem := find_refused(given):
        typer.echo(f"skidpad: {problem}", err=True)
    return own + server_options(given)


def server_options(given: list[str]) -> list[str]:
    """Returns the options of our server for those of Unreal's; others mean nothing here."""
    found: list[str] = []
    for word in given:
        if port := PORT.fullmatch(word):
            found += ["--port", port[1]]
        elif not word.startswith("-") and (name := MAP.fullmatch(word)):
            found += ["--map", name[1]]
    return found


def find_refused(given: list[str]) -> str:
    """Returns a sentence on a streaming port that cannot be had, "" when all is well."""
    ports = [int(p[1]) for p in map(PORT.fullmatch, given) if p] or [2000]
    streams = [int(s[1]) for s in map(STREAMING.fullmatch, given) if s]
    if streams and streams[-1] not in (0, ports[-1] + 1):
        return f"streams use port {ports[-1] + 1}, not {streams[-1]}"
    return ""
