"""A server in a process of its own, for tests and programs that want one for a while."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager

from skidpad.core.errors import BackendError

READY = re.compile(r"ready: CARLA \S+ on \S+:(\d+)")
STOP_LIMIT = 10.0  # s


class ServerProcess(AbstractContextManager["ServerProcess"]):
    """`skidpad carla-server` on a free port of 127.0.0.1; a context manager."""

    def __init__(self, options: Sequence[str] = (), start_limit: float = 600.0) -> None:
        """options: as on the command line. start_limit: s, the first start compiles kernels."""
        command = [sys.executable, "-m", "skidpad", "carla-server", "--port", "0", *options]
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        alarm = threading.Timer(start_limit, self._process.kill)
        alarm.start()
        try:
            self.port = self._wait_for_port()
        finally:
            alarm.cancel()
        threading.Thread(target=self._drain, daemon=True).start()

    def _wait_for_port(self) -> int:
        """Returns the port from the server's ready line; raises BackendError where it ends before."""
        said = []
        assert self._process.stdout is not None
        for line in self._process.stdout:
            said.append(line)
            found = READY.search(line)
            if found:
                return int(found[1])
        self._process.wait()
        raise BackendError(f"skidpad carla-server did not start: {''.join(said)[-2000:]}")

    def _drain(self) -> None:
        """Reads on to the end of the output, so that the server never blocks on a full pipe."""
        assert self._process.stdout is not None
        for _ in self._process.stdout:
            pass

    def stop(self) -> None:
        """Ends the server process; it is safe to call twice."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(STOP_LIMIT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    @property
    def pid(self) -> int:
        """Returns the id of the server's process."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Returns whether the server's process still runs."""
        return self._process.poll() is None

    def __exit__(self, *error: object) -> None:
        self.stop()
