"""A command of skidpad in a process of its own, which prints the address of its page."""

import os
import re
import select
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import skidpad

SOURCE = str(Path(skidpad.__file__).parents[1])  # what is tested, whatever is installed
PATIENCE = 300.0  # s; a machine may be busy, and kernels may have to be compiled


class Command:
    """`skidpad ...` in a process of its own, which prints the address of its page."""

    def __init__(self, *words, cwd):
        env = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "skidpad", *map(str, words)],
            cwd=cwd,
            env=env | {"PYTHONUNBUFFERED": "1", "PYTHONPATH": SOURCE},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self.said = ""

    def address(self):
        """Wait for it."""
        while (found := re.search(r"http://\S+", self.said)) is None:
            ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE)
            piece = os.read(self.process.stdout.fileno(), 4096) if ready else b""
            assert piece, f"it printed no address: {self.said}"
            self.said += piece.decode()
        return found.group()

    def ended(self):
        """Wait for the end: exit status and everything that was said."""
        out, _ = self.process.communicate(timeout=PATIENCE)
        self.said += out.decode()
        return self.process.returncode, self.said


@contextmanager
def running(*words, cwd):
    command = Command(*words, cwd=cwd)
    try:
        yield command
    finally:
        if command.process.poll() is None:
            command.process.send_signal(signal.SIGINT)
            command.process.communicate(timeout=PATIENCE)
        command.process.stdout.close()
