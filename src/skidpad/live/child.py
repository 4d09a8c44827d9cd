"""The monitor's own process: `python -m skidpad.live.child`, started by `monitor_link`.

It reads the drive on its input, writes the folder that `skidpad monitor` writes of the recording,
and tells hazards in `alarms.jsonl` as they begin. Nothing that it does can reach the drive.
"""

from __future__ import annotations

import gc
import json
import sys
from pathlib import Path

import numpy as np

from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.errors import SkidpadError
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.live.isolation import isolate
from skidpad.live.walltime import WallTimer
from skidpad.live.watch import Alarms, watch
from skidpad.live.wire import WireSource

ALARMS = "alarms.jsonl"
WARM = 12  # cycles: every indicator has its history of 1 s then


def main(folder: str, channels: str, pin: str) -> int:
    """Watch one drive; the first line on the output says that kernels are warm."""
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
    """Judge a few cycles of a small world, so that the first real one finds warm code."""
    monitor = Monitor(channels)
    for k in range(WARM):
        monitor.update(Cycle(k, 0.1 * k, tuple(_scene(0.1 * k) for _ in channels)))


def settle() -> None:
    """No search for cycles of references from here on: one through all modules takes 40 to 70 ms.

    A drive of 6000 cycles among 40 vehicles leaves 1300 objects in such cycles, and the process ends
    with the drive.
    """
    gc.collect()
    gc.freeze()
    gc.disable()


def _scene(t: float) -> ChannelFrame:
    """Two cars on a straight road, one behind the other."""
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


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
