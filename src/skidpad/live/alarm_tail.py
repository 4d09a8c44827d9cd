"""What a monitor beside a drive adds to its file of alarms, read while the drive goes on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


class AlarmTail:
    """Reads the alarms of a file that grows, each once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._read = 0  # bytes

    def read(self) -> list[dict[str, Any]]:
        """Returns the alarms that were written in full since the last call."""
        try:
            with self.path.open("rb") as file:
                file.seek(self._read)
                content = file.read()
        except FileNotFoundError:
            return []  # the monitor has not begun
        lines = content[: content.rfind(b"\n") + 1]
        self._read += len(lines)
        return [json.loads(line) for line in lines.splitlines()]
