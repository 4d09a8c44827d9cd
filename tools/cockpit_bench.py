"""What the cockpit costs: CPU per view, five views together, a seek, and a drive with a browser beside it.

    python tools/cockpit_bench.py [SECONDS] [CHROMIUM] [--quality full|draft] [--pictures]

Prints the numbers of docs/benchmarks.md; processor time of this process where it says CPU. Five views
together are drawn as a page has them drawn, in one thread per processor. --pictures: no drive with a browser.
"""

from __future__ import annotations

import argparse
import subprocess
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
from skidpad.cockpit.studio import Looks, Studio, View, plane
from skidpad.cockpit.words import Link
from skidpad.core.courses import Roads
from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.vocabulary import Quality
from skidpad.pages.server import Server
from skidpad.physics.presets import preset
from skidpad.stack.configurations import functions_of

FIVE = (View.DRIVER, View.TOP, View.LEFT, View.REAR, View.RIGHT)
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")


def spec(weather: str, seconds: float) -> RunSpec:
    """Twenty vehicles around configuration 3."""
    driver = AdasDriver(label="3", functions=functions_of(3))
    return RunSpec(driver=driver, course=Roads(), weather=preset(weather), duration=seconds)


def studio_of(recording: RecordedRun, first: int, quality: Quality) -> Studio:
    """Returns a studio for the moments of a recording from `first` on."""
    outside = recording.seat(first).outside
    looks = Looks(quality=quality)
    return Studio(recording.map, recording.table, outside, recording.spec.seed, looks=looks)


def views(recording: RecordedRun, moments: range, quality: Quality) -> dict[str, float]:
    """Median CPU milliseconds per view, drawn alone and handed on, and of JPEG for all."""
    found = {}
    for view in View:
        studio = studio_of(recording, moments[0], quality)
        took = []
        for k in moments:
            truth = recording.moment(k).truth
            begin = time.process_time()
            images = studio.look(truth)
            plane(images[view.value])
            took.append(1000.0 * (time.process_time() - begin))
        found[view.value] = median(took[2:])
    return found


def together(
    recording: RecordedRun, moments: range, quality: Quality
) -> tuple[float, float, float]:
    """Returns median wall, least wall and median CPU ms of five colour views, as a page has them drawn."""
    studio = studio_of(recording, moments[0], quality)
    wall, cpu = [], []
    for k in moments:
        truth = recording.moment(k).truth
        begin = time.perf_counter(), time.process_time()
        studio.draw(studio.look(truth), FIVE)
        wall.append(1000.0 * (time.perf_counter() - begin[0]))
        cpu.append(1000.0 * (time.process_time() - begin[1]))
    return median(wall[2:]), min(wall[2:]), median(cpu[2:])


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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("seconds", nargs="?", type=float, default=60.0)
    parser.add_argument("chromium", nargs="?", default="chromium")
    parser.add_argument("--quality", choices=[q.value for q in Quality], default="full")
    parser.add_argument("--pictures", action="store_true")
    args = parser.parse_args()
    with TemporaryDirectory() as name:
        folder, quality = Path(name), Quality(args.quality)
        for weather in ("clear-noon", "rain-night"):
            run = spec(weather, 20.0)
            drive_at_desk(run, Desk(Recorded([]), run), folder / weather)
            recording = RecordedRun(folder / weather)
            cost = views(recording, range(200, 300), quality)
            print(weather, msgspec.json.encode({k: round(v, 2) for k, v in cost.items()}).decode())
            wall, least, cpu = together(recording, range(200, 300), quality)
            print(
                f"five colour views together, {args.quality}: median {wall:.1f} ms, "
                f"least {least:.1f} ms, CPU {cpu:.1f} ms"
            )
            print("seek: median {:.0f} ms, longest {:.0f} ms".format(*seeks(recording)))
        if not args.pictures:
            print(drive(args.seconds, args.chromium, folder))


if __name__ == "__main__":
    main()
