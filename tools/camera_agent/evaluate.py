"""What the shipped camera driver can do: `python -m camera_agent.evaluate scenarios|road|blank [N]`.

scenarios: the catalogue on dry road with N seeds that training never saw; road: N km of the motorway, a
map that it never saw, alone and among 20 vehicles; blank: the scenarios and a kilometre of road with
black images.
"""

from __future__ import annotations

import sys

import numpy as np

from skidpad.campaign.cells.grip import Cross, cross, seeds, template
from skidpad.campaign.runs.run import Run, run
from skidpad.core.courses import Roads
from skidpad.core.frames import SensorFrame
from skidpad.core.run import CameraDriver, Friction, RunSpec
from skidpad.core.vocabulary import Outcome, SensorLevel
from skidpad.evidence.statistics import clopper_pearson
from skidpad.physics.presets import preset
from skidpad.scenarios.shipped import NAMES
from skidpad.stack.camera import driver

V = 80.0 / 3.6  # m/s, the driver's cruise speed


class Blind(driver.CameraDriver):
    """The same with black images."""

    def picture(self, frame: SensorFrame) -> driver.Picture:
        """Nothing."""
        return np.zeros_like(super().picture(frame))


def scenarios(n: int, kind: type[driver.CameraDriver] | None = None) -> None:
    """Completion of the catalogue on dry road, and how far the ego left its lane."""
    base = template(driver=CameraDriver(), sensors=SensorLevel.PIXELS)
    for name in NAMES:
        varied = Cross(scenarios=(name,), weather=[preset("rain_0")], frictions=[Friction.ORIGINAL])
        runs = [run(cell, kind) for cell in cross(base, varied, seeds(0, n))]
        done = sum(r.outcome is Outcome.COMPLETED and not left(r) for r in runs)
        low, high = clopper_pearson(done, n)
        astray = max(float(np.ptp(r.log.actors.y[:, 0])) for r in runs)
        told = f"{done} of {n} completed and on the road (95 % {low:.2f} to {high:.2f})"
        far = float(np.mean([way(r) for r in runs]))
        print(f"{name}: {told}, at most {astray:.2f} m sideways, {far:.0f} m driven", flush=True)


def road(km: float, kind: type[driver.CameraDriver] | None = None) -> None:
    """Departures and contacts on the held-out map."""
    for vehicles in (0, 20):
        spec = RunSpec(
            driver=CameraDriver(),
            course=Roads(map="motorway", vehicles=vehicles),
            duration=1000.0 * km / V,
            seed=1,
        )
        driven = run(spec, kind)
        print(
            f"motorway, {vehicles} vehicles: {way(driven) / 1000.0:.1f} km, "
            f"{len(driven.log.contacts)} contacts, {departures(driven)} departures, "
            f"{len(driven.log.invasions)} markings crossed, {driven.error.strip()[-200:]}",
            flush=True,
        )


def way(driven: Run) -> float:
    """m that the ego drove."""
    a = driven.log.actors
    return float(np.hypot(np.diff(a.x[:, 0]), np.diff(a.y[:, 0])).sum())


def left(driven: Run) -> bool:
    """All wheels were off every lane at some time."""
    return departures(driven) > 0


def departures(driven: Run) -> int:
    """How often all wheels left the road."""
    off = driven.off_road
    assert off is not None
    return int(off[0]) + int(np.count_nonzero(np.diff(off.astype(np.int8)) > 0))


if __name__ == "__main__":
    what, count = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 10
    if what == "road":
        road(count)
    elif what == "blank":
        scenarios(int(count), Blind)
        road(1.0, Blind)
    else:
        scenarios(int(count))
