"""Lines of JSON that are kept while long work goes on: each with its date and the machine's load."""

from __future__ import annotations

import json
import os
from datetime import datetime, timezone
from pathlib import Path
from typing import Any


def read(file: Path) -> list[dict[str, Any]]:
    """The lines of a file; what a kill cut off is left out."""
    found = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        try:
            found.append(json.loads(line))
        except ValueError:
            continue
    return found


def add(file: Path, line: dict[str, Any]) -> None:
    """Add a line, on a line of its own."""
    when = datetime.now(timezone.utc).isoformat(timespec="seconds")
    dated = line | {"when": when, "load": round(os.getloadavg()[0], 1)}
    cut = file.exists() and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as out:
        out.write("\n" * cut + json.dumps(dated) + "\n")
