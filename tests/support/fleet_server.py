"""The fleet service as a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path


def start_fleet(data: Path, *words: str) -> tuple[subprocess.Popen, str]:
    """`skidpad fleet serve` as a process, and its address once it says it."""
    child = subprocess.Popen(
        [sys.executable, "-m", "skidpad", "fleet", "serve", "--data", str(data), "--port", "0", *words],
        stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )  # fmt: skip
    line = child.stdout.readline()
    return child, re.search(r"https?://\S+", line).group(0)
