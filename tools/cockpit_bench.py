"""What the cockpit costs: CPU per view, five views together, a seek, and a drive with a browser beside it.

    python tools/cockpit_bench.py [SECONDS] [CHROMIUM]

Prints the numbers of docs/benchmarks.md; processor time of this process where it says CPU.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import msgspec

from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.cockpit.about import About
from skidpad.cockpit.bridge import Bridge
from skidpad.cockpit.driving import about, drive_job
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.pictures import Encoder
from skidpad.cockpit.producer import Producer
from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.replaying import Replayer
from skidpad.cockpit.serving import application
from skidpad.cockpit.studio import Studio, View, plane
from skidpad.cockpit.words import Link
from skidpad.core.run import AdasDriver, Roads, RunSpec
from skidpad.pages.server import Server
from skidpad.physics.presets import preset
from skidpad.stack.configurations import functions_of

FIVE = (View.DRIVER, View.TOP, View.LEFT, View.REAR, View.RIGHT)
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")


def spec(weather: str, seconds: float) -> RunSpec:
    """Twenty vehicles around configuration 3."""
    driver = AdasDriver(label="3", functions=functions_of(3))
    return RunSpec(driver=driver, course=Roads(), weather=preset(weather), duration=seconds)


def views(recording: RecordedRun, moments: range) -> dict[str, float]:
    """Median CPU milliseconds per view, drawn alone and handed on, and of JPEG for all."""
    table, first = recording.table, recording.seat(moments[0]).outside
    found = {}
    for view in View:
        studio = Studio(recording.map, table, first, recording.spec.seed)
        took = []
        for k in moments:
            truth = recording.moment(k).truth
            begin = time.process_time()
            images = studio.look(truth)
            plane(images[view.value])
            took.append(1000.0 * (time.process_time() - begin))
        found[view.value] = median(took[2:])
    return found


def together(recording: RecordedRun, moments: range) -> tuple[float, float]:
    """Median wall and CPU milliseconds of five colour views of a moment, drawn as a page has them drawn."""
    studio = Studio(
        recording.map, recording.table, recording.seat(moments[0]).outside, recording.spec.seed
    )
    wall, cpu = [], []
    for k in moments:
        truth = recording.moment(k).truth
        begin = time.perf_counter(), time.process_time()
        studio.draw(studio.look(truth), FIVE)
        wall.append(1000.0 * (time.perf_counter() - begin[0]))
        cpu.append(1000.0 * (time.process_time() - begin[1]))
    return median(wall[2:]), median(cpu[2:])


def seeks(recording: RecordedRun) -> tuple[float, float]:
    """Median and longest wall milliseconds from the word to the picture, its JPEG included."""
    feed, link, encoder = Feed(), Link(None), Encoder()
    replayer = Replayer(recording, feed, link)
    took = []
    for n in range(40):
        begin = time.perf_counter()
        link.seek = (n * 7919) % recording.ticks
        replayer.turn()
        replayer.show()
        packet = feed.take()
        assert packet is not None
        encoder.message(packet)
        took.append(1000.0 * (time.perf_counter() - begin))
    feed.close()
    return median(took[1:]), max(took[1:])


def drive(seconds: float, chromium: str, folder: Path) -> str:
    """A paced drive with a headless browser that looks at it: how it ended, and how fast it was."""
    producer = Producer(drive_job, about(spec("clear-noon", seconds), folder / "paced"))
    bridge = Bridge(producer)
    command = [
        chromium,
        *FLAGS,
        f"--user-data-dir={folder / 'profile'}",
        "--remote-debugging-port=0",
    ]
    with Server(application(bridge, About("drive"))) as server:
        producer.start()
        browser = subprocess.Popen(
            [*command, server.address()], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        factors = []
        while not producer.wait(0.5):
            if bridge.told.get("rtf"):
                factors.append(bridge.told["rtf"])
        browser.terminate()
        browser.wait()
        producer.stop()
    slow = bridge.told.get("slow_pct")
    mean = sum(factors) / max(len(factors), 1)
    return f"{producer.outcome()}\nmean real-time factor {mean:.3f}, ticks below 0.9: {slow} %"


def main() -> None:
    """Measure and print."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    chromium = sys.argv[2] if len(sys.argv) > 2 else "chromium"
    with TemporaryDirectory() as name:
        folder = Path(name)
        for weather in ("clear-noon", "rain-night"):
            run = spec(weather, 20.0)
            drive_at_desk(run, Desk(Recorded([]), run), folder / weather)
            recording = RecordedRun(folder / weather)
            cost = views(recording, range(200, 300))
            print(weather, msgspec.json.encode({k: round(v, 2) for k, v in cost.items()}).decode())
            wall, cpu = together(recording, range(200, 300))
            print(f"five colour views together: median {wall:.1f} ms, CPU {cpu:.1f} ms")
            print("seek: median {:.0f} ms, longest {:.0f} ms".format(*seeks(recording)))
        print(drive(seconds, chromium, folder))


if __name__ == "__main__":
    main()
