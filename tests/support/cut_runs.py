"""Runs that are cut at a tick and go on."""

from __future__ import annotations

from skidpad.campaign.cells.matrix import describe_run
from skidpad.campaign.driving.drivers import describe_driver
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import SensorLevel, TrafficStart
from skidpad.physics.presets import find_weather

SCRIPTS = ("ghost_cut_in", "lead_slowdown", "front_accident")


STACKS = '''
from skidpad.core.states import VehicleCommand

class Counting:
    """Says more throttle with every tick."""

    def __init__(self, specs, map, settings):
        self.ticks = [0]

    def tick(self, frame):
        self.ticks[0] += 1
        return VehicleCommand(throttle=min(self.ticks[0] / 400.0, 1.0))


class Reading(Counting):
    """Holds an open file."""

    def __init__(self, specs, map, settings):
        super().__init__(specs, map, settings)
        self.file = open(__file__)


class Giving(Reading):
    """Says what of it is to be saved."""

    def __getstate__(self):
        return self.ticks

    def __setstate__(self, ticks):
        self.ticks = ticks
'''


def spec_of(map, configuration, *, level=SensorLevel.OBJECTS, duration=40.0, weather="rain-night"):
    course = Roads(map=map, vehicles=20, allow_fewer=True, traffic=TrafficStart.FIXED)
    template = RunSpec(
        course=course,
        duration=duration,
        sensors=level,
        settings=load_profile("recommended", {}),
    )
    return describe_run(describe_driver(configuration, {}), find_weather(weather), 3, template)


def go_on(run, ticks=None):
    """Drives so many ticks, or to the end."""
    while ticks is None or ticks > 0:
        if run.step() is None:
            return
        ticks = None if ticks is None else ticks - 1
