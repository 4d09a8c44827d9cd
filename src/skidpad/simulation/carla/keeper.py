"""A server that we start ourselves, and start anew before it grows old or after it died."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence

from skidpad.core.errors import BackendError
from skidpad.simulation.carla.watchdog import rest

PATIENCE = 300.0  # s until a new server answers; Unreal loads its first map in that time
GLANCE = 0.25  # s between two looks
STOP_LIMIT = 20.0  # s
LINUX = sys.platform == "linux"
PR_SET_PDEATHSIG = 1  # Linux, sys/prctl.h


class ServerKeeper:
    """Owns one server process; `before_run` makes sure that it answers."""

    def __init__(self, command: Sequence[str], host: str, port: int, every: int) -> None:
        """every: runs after which the server is started anew, 0: only when it died."""
        self.command, self.host, self.port, self.every = tuple(command), host, port, every
        self.starts = 0
        self._runs = 0
        self._process: subprocess.Popen[bytes] | None = None

    def before_run(self) -> None:
        """Starts a server where none is there or it is too old, and counts the run.

        BackendError when it does not come up.
        """
        alive = self._process is not None and self._process.poll() is None
        if alive and not (self.every and self._runs >= self.every):
            self._runs += 1
            return
        self.stop()
        self._start()
        self._runs = 1

    def _start(self) -> None:
        """Starts the server process and waits until it answers.

        After PATIENCE s without an answer it is stopped; BackendError.
        """
        try:
            self._process = subprocess.Popen(
                self.command,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                preexec_fn=_die_with_parent if LINUX else None,  # noqa: PLW1509  one call, no lock
            )
        except OSError as error:
            raise BackendError(
                f"the CARLA server cannot be started with {' '.join(self.command)!r}: "
                f"{error.strerror}"
            ) from error
        self.starts += 1
        for _ in range(round(PATIENCE / GLANCE)):
            if self._process.poll() is not None:
                break
            if answers(self.host, self.port):
                return
            rest(GLANCE)
        self.stop()
        raise BackendError(
            f"the server started with {' '.join(self.command)!r} never answered at "
            f"{self.host}:{self.port}"
        )

    def stop(self) -> None:
        """Ends the server with all its children; safe to call twice."""
        process, self._process = self._process, None
        if process is None:
            return
        for sign in (signal.SIGTERM, signal.SIGKILL):
            if process.poll() is None:
                os.killpg(process.pid, sign)
                try:
                    process.wait(STOP_LIMIT)
                except subprocess.TimeoutExpired:
                    continue


def answers(host: str, port: int) -> bool:
    """Returns whether a server accepts connections at this address."""
    try:
        socket.create_connection((host, port), GLANCE).close()
    except OSError:
        return False
    return True


def _die_with_parent() -> None:
    """Asks the kernel to end this process with its parent: a worker that is killed cannot stop its server."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
