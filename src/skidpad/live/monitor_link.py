"""The monitor beside a drive, in a process of its own: the arbiter never waits for it (C-005).

Lossless: the drive waits while the pipe is full, and the result is that of the recording. Live: a
thread of this process feeds the pipe from a bounded queue; a cycle that does not fit is dropped,
and its number kept. A monitor that dies or hangs is one sentence in `link.json`; the drive goes on.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from queue import Full, Queue
from typing import Any

import skidpad
from skidpad.live.outcome import LinkOutcome, write_outcome
from skidpad.live.settings import Flow, MonitorLinkSettings
from skidpad.live.wire import cycle_mark, end_mark, pack_item
from skidpad.recording.channels.mcap_files import Item

START_PATIENCE = 600.0  # s: kernels may have to be compiled first


class MonitorLink:
    """Passes everything that it hears on to a process of `skidpad.live.child`."""

    def __init__(
        self, channels: Sequence[str], folder: Path, settings: MonitorLinkSettings
    ) -> None:
        shutil.rmtree(folder, ignore_errors=True)  # of an earlier drive
        self.folder, self.settings = folder, settings
        self.cycles = 0
        self.missing: list[int] = []
        self.ended = ""  # why the monitor is gone; empty while it is there
        self.isolation: dict[str, Any] = {}
        self._cycle: list[bytes] = []
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115, closed by `close`
        self.process = _start(channels, folder, settings.pin, self._errors.fileno())
        assert self.process.stdin is not None
        self._pipe = self.process.stdin.fileno()
        os.set_blocking(self._pipe, False)
        self._await_ready()
        self._waiting: Queue[tuple[int, bytes] | None] = Queue(settings.capacity)  # None: the end
        self._feeder = threading.Thread(target=self._feed, name="monitor link", daemon=True)
        if settings.flow is Flow.LIVE:
            self._feeder.start()

    def hear(self, channel: int | None, item: Item) -> None:
        """Gathers an item for the cycle that is under way."""
        self._cycle.append(pack_item(channel, item))

    def cycle_over(self, k: int, t: float) -> None:
        """Sends the gathered cycle; a live link drops it whole, and counts it, when the queue is full."""
        self._cycle.append(cycle_mark(k, t, time.monotonic_ns()))
        content = b"".join(self._cycle)
        self._cycle.clear()
        self.cycles += 1
        if self.settings.flow is Flow.LOSSLESS:
            self._deliver(k, content)
        elif self.ended or self._waiting.full():
            self.missing.append(k)
        else:
            self._waiting.put_nowait((k, content))

    def close(self) -> None:
        """Ends the monitor, waits for it, and writes what became of the link."""
        if self.settings.flow is Flow.LIVE:
            self._end_feeder()
        self._push(end_mark())
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self._await_end()
        self.process.stdout.close()
        self._errors.close()
        write_outcome(self.folder, self.outcome)

    def _end_feeder(self) -> None:
        """Lets the thread deliver what waits, then ends it; one that died leaves missing cycles."""
        while self._feeder.is_alive():
            with suppress(Full):
                self._waiting.put(None, timeout=0.1)
                break
        self._feeder.join()
        while not self._waiting.empty():
            if left := self._waiting.get():
                self.missing.append(left[0])

    @property
    def outcome(self) -> LinkOutcome:
        """Returns what became of the link so far."""
        return LinkOutcome(
            flow=self.settings.flow,
            cycles=self.cycles,
            missing=sorted(self.missing),
            ended=self.ended or "complete",
            isolation=self.isolation,
        )

    def _feed(self) -> None:
        """Delivers the waiting cycles in order until the end is one of them; in a thread."""
        for k, content in iter(self._waiting.get, None):
            self._deliver(k, content)

    def _deliver(self, k: int, content: bytes) -> None:
        """Sends the bytes of cycle `k` to the child; notes `k` as missing when they did not arrive."""
        if not self._push(content):
            self.missing.append(k)

    def _push(self, content: bytes) -> bool:
        """Writes everything into the pipe, waiting for room; False when the monitor is gone.

        One that takes nothing for `patience` s is killed.
        """
        view = memoryview(content)
        while view and not self.ended:
            _, writable, _ = select.select([], [self._pipe], [], self.settings.patience)
            if not writable:
                self.process.kill()
                self._on_loss(f"the monitor took nothing for {self.settings.patience:g} s")
                break
            try:
                view = view[os.write(self._pipe, view) :]
            except BlockingIOError:
                continue  # room for less than the pipe writes at once
            except OSError:
                self._on_loss(self._last_words())
        return not self.ended

    def _on_loss(self, why: str) -> None:
        """Notes why the link ended, with the number of cycles before; the first reason stays."""
        self.ended = self.ended or f"{why}, after {self.cycles} cycles"

    def _last_words(self) -> str:
        """Returns how the process ended, with the last line that it said; kills one that lives on."""
        try:
            code = self.process.wait(self.settings.patience)
        except subprocess.TimeoutExpired:  # it hears no more, and lives
            self.process.kill()
            code = self.process.wait()
        self._errors.seek(0)
        said = self._errors.read().decode(errors="replace").strip().splitlines()
        return f"the monitor ended with code {code}" + (f" ({said[-1]})" if said else "")

    def _await_ready(self) -> None:
        """Waits for the child's first line, which tells its isolation; kills a child without one."""
        assert self.process.stdout is not None
        ready, _, _ = select.select([self.process.stdout], [], [], START_PATIENCE)
        line = self.process.stdout.readline() if ready else b""
        if line:
            self.isolation = json.loads(line)
            return
        self.process.kill()
        self._on_loss(self._last_words())

    def _await_end(self) -> None:
        """Waits at most `patience` s for the child to end, then kills it; notes a failure as a loss."""
        try:
            code = self.process.wait(self.settings.patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self._on_loss(f"the monitor did not end within {self.settings.patience:g} s")
            self.process.wait()
            return
        if code:
            self._on_loss(self._last_words())


def _start(
    channels: Sequence[str], folder: Path, pin: int | None, errors: int
) -> subprocess.Popen[bytes]:
    """Starts the monitor's process, which finds the same Skidpad as this one; errors: a descriptor."""
    root = str(Path(skidpad.__file__).parents[1])
    path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    words = [str(folder), json.dumps(list(channels)), json.dumps(pin)]
    return subprocess.Popen(
        [sys.executable, "-m", "skidpad.live.child", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        bufsize=0,
        env={**os.environ, "PYTHONPATH": path},
    )
