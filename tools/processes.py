"""What other processes take."""

from __future__ import annotations

import os
from pathlib import Path


def memory_mb(process: int, which: str = "VmRSS") -> float:
    """Resident memory, with "VmHWM" its peak; 0 where the system does not tell."""
    status = Path(f"/proc/{process}/status")
    for line in status.read_text().splitlines() if status.exists() else []:
        if line.startswith(which):
            return round(int(line.split()[1]) / 1024.0, 1)
    return 0.0


def processor_s(process: int) -> float:
    """Processor time of a process so far, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
