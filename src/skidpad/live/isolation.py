"""A processor for the monitor alone, as far as the system allows (C-231)."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from skidpad.core.errors import ConfigError

GOVERNOR = "/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor"
HIGHEST = -20  # nice


def require_processor(pin: int) -> None:
    """ConfigError unless this process may run on processor `pin`."""
    if not hasattr(os, "sched_getaffinity"):
        raise ConfigError("--pin: this system has no affinity of processes to processors")
    allowed = sorted(os.sched_getaffinity(0))
    if pin not in allowed:
        raise ConfigError(f"--pin must be one of the processors {allowed}, got {pin}")


def isolate(pin: int | None) -> dict[str, Any]:
    """Pin this process and raise its priority; says what was granted.

    The governor is read only: to change it is the administrator's.
    """
    if pin is None:
        return {}
    require_processor(pin)
    os.sched_setaffinity(0, {pin})
    with suppress(OSError):  # where it is not allowed; what holds is read below
        os.setpriority(os.PRIO_PROCESS, 0, HIGHEST)
    governor = Path(GOVERNOR.format(pin))
    return {
        "processor": pin,
        "nice": os.getpriority(os.PRIO_PROCESS, 0),
        "governor": governor.read_text().strip() if governor.exists() else "unknown",
    }
