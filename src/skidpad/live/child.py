"""The monitor's own process: `python -m skidpad.live.child`, started by `monitor_link`.

It reads the drive on its input, writes the folder that `skidpad monitor` writes of the recording,
and tells hazards in `alarms.jsonl` as they begin. Nothing that it does can reach the drive.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.errors import ConfigError, SkidpadError
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.live.watch import Alarms, Timer, watch
from skidpad.live.wire import WireSource

ALARMS = "alarms.jsonl"
WARM = 12  # cycles: every indicator has its history of 1 s then


def main(folder: str, channels: str, pin: str) -> int:
    """Watches one drive from standard input into `folder`; returns 0, or 2 after an error on stderr.

    channels, pin: JSON. The first line on the output says that kernels are warm, and the isolation.
    """
    source = WireSource(sys.stdin.buffer, tuple(json.loads(channels)))
    out = Path(folder)
    try:
        granted = isolate(json.loads(pin))
        warm_up(source.channels)
        settle()
        out.mkdir(parents=True, exist_ok=True)
        print(json.dumps(granted), flush=True)
        with (out / ALARMS).open("w", encoding="utf-8") as stream:
            watch(source, out, MonitorSettings(), WallTimer(source), Alarms(stream))
    except SkidpadError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def warm_up(channels: tuple[str, ...]) -> None:
    """Judges WARM cycles of a small world, so that the first real one finds warm code."""
    monitor = Monitor(channels)
    for k in range(WARM):
        monitor.update(Cycle(k, 0.1 * k, tuple(_scene(0.1 * k) for _ in channels)))


def settle() -> None:
    """Turns the search for cycles of references off for this process: one takes 40 to 70 ms.

    A drive of 6000 cycles among 40 vehicles leaves 1300 objects in such cycles, and the process ends
    with the drive.
    """
    gc.collect()
    gc.freeze()
    gc.disable()


def _scene(t: float) -> ChannelFrame:
    """Returns a frame at `t` s of two cars on a straight road, one behind the other."""
    ahead = np.linspace(0.0, 2.0, 11)
    box = np.array([[2.0, 0.9], [-2.0, 0.9], [-2.0, -0.9], [2.0, -0.9]])
    other = np.array([[20.0 + 8.0 * t, 0.0, 0.0, 8.0, 0.0]])
    return ChannelFrame(
        t=t,
        ego=np.array([10.0 * t, 0.0, 0.0, 10.0, 0.0]),
        ego_polygon=box,
        plan=np.column_stack([10.0 * (t + ahead), 0.0 * ahead, ahead]),
        objects=other,
        polygons=box[None],
        polygon_size=np.array([4], dtype=np.int64),
        predictions=other[:, None, :2] + other[:, None, 3:] * ahead[None, :, None],
        prediction_t=ahead,
        ids=np.array([1], dtype=np.int64),
        classes=np.array([14], dtype=np.int64),
    )


# --- a processor for the monitor alone, as far as the system allows (C-231)
GOVERNOR = "/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor"
HIGHEST = -20  # nice


def require_processor(pin: int) -> None:
    """Raises ConfigError unless this process may run on processor `pin`."""
    if not hasattr(os, "sched_getaffinity"):
        raise ConfigError("--pin: this system has no affinity of processes to processors")
    allowed = sorted(os.sched_getaffinity(0))
    if pin not in allowed:
        raise ConfigError(f"--pin must be one of the processors {allowed}, got {pin}")


def isolate(pin: int | None) -> dict[str, Any]:
    """Pins this process and raises its priority; returns what was granted, {} for None.

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


# --- wall time from a cycle's last word to its judgement, and what the system says of it (C-005)
SCHEDULE = Path("/proc/thread-self/schedstat")  # ns on a processor, ns waiting for one, slices


class WallTimer(Timer):
    """Takes processor time per part, and per cycle the wall time since it was sent, waits and faults."""

    def __init__(self, source: WireSource) -> None:
        super().__init__(time.thread_time_ns)
        self.source = source
        self._waited, self._faults = _waited_ns(), _faults()

    def end(self) -> None:
        """Adds wall_ms, waited_ms and faults to the row of a cycle that is judged and written."""
        waited, faults = _waited_ns(), _faults()
        row = self.rows[-1]
        row["wall_ms"] = (time.monotonic_ns() - self.source.sent_ns) / 1e6
        row["waited_ms"] = (waited - self._waited) / 1e6
        row["faults"] = float(faults - self._faults)
        self._waited, self._faults = waited, faults


def _waited_ns() -> int:
    """Returns the ns that this thread was ready and had no processor; 0 where the system does not say."""
    try:
        return int(SCHEDULE.read_bytes().split()[1])
    except (OSError, IndexError, ValueError):
        return 0


def _faults() -> int:
    """Returns the page faults of this process up to now, minor and major together."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_majflt + usage.ru_minflt


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
