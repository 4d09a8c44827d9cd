"""Stacks that do what none should; each is the class under test of one run."""

import os
import sys
import time
from pathlib import Path

from skidpad.core.states import StackReport, VehicleCommand


class Stack:
    """Presses the pedal a little."""

    def __init__(self, specs, map, settings):
        self.map, self.settings = map, settings

    def tick(self, frame):
        self.act(frame)
        return VehicleCommand(throttle=0.3)

    def act(self, frame):
        pass


class Forking(Stack):
    """In its third tick it becomes two, and both go on."""

    def act(self, frame):
        if frame.tick == 3:
            os.fork()


class ForkingAtStart(Stack):
    def __init__(self, specs, map, settings):
        super().__init__(specs, map, settings)
        os.fork()


class LeavingAChild(Stack):
    """Dies, while a child of it keeps all its files open."""

    def act(self, frame):
        if os.fork() == 0:
            Path(self.settings["pid"]).write_text(str(os.getpid()))
            time.sleep(3600)
        while not Path(self.settings["pid"]).exists():
            time.sleep(0.01)
        os._exit(3)


class Exiting(Stack):
    def act(self, frame):
        sys.exit(7)


class ExitingHard(Stack):
    def act(self, frame):
        os._exit(7)


class Interrupting(Stack):
    def act(self, frame):
        raise KeyboardInterrupt


class Unprintable(Exception):
    def __repr__(self):
        raise ValueError("no words")

    __str__ = __repr__


class RaisingUnprintable(Stack):
    def act(self, frame):
        raise Unprintable


class Surrogates(Stack):
    def act(self, frame):
        raise ValueError("\ud800 half a letter")


class Chatty(Stack):
    def act(self, frame):
        raise ValueError("x" * 50_000_000)


class Wordy(Stack):
    """Presses with a text."""

    def tick(self, frame):
        return VehicleCommand(throttle="1")


class Unsure(Stack):
    def tick(self, frame):
        return VehicleCommand(handbrake="perhaps")


class RaisingReport(Stack):
    @property
    def report(self):
        raise OSError("no report")


class WordyReport(Stack):
    report = StackReport(distance="far")


class HugeReport(Stack):
    report = StackReport(radar_points=2**40)


class Wandering(Stack):
    """Goes elsewhere, and wants to stay there."""

    def __init__(self, specs, map, settings):
        super().__init__(specs, map, settings)
        os.chdir(settings["elsewhere"])

    def act(self, frame):
        Path("mine.txt").write_text("written where I went")


class Vandal(Stack):
    """Writes into what it is shown of the map."""

    def act(self, frame):
        column = getattr(getattr(self.map, self.settings["table"]), self.settings["column"])
        column[:] = 0


class Meddler(Stack):
    """Writes into its own settings."""

    def act(self, frame):
        self.settings["nested"].append(1)
