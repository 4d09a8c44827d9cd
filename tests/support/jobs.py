"""Jobs that the tests of the pool send to worker processes."""

import os
import signal
import time
from pathlib import Path

from skidpad.core.states import VehicleCommand


def square(n):
    return n * n


def own_pid(_):
    return os.getpid()


def odd_only(n):
    if n % 2 == 0:
        raise ValueError(f"{n} is even")
    return n


def suicide(path):
    with open(path, "a") as f:
        f.write("x")
    os.kill(os.getpid(), signal.SIGKILL)


def sleep(seconds):
    time.sleep(seconds)


def die_first(path):
    if not Path(path).exists():
        Path(path).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "second"


def fork(n):
    os.fork()
    return n


def write_pid_and_sleep(path):
    Path(path).write_text(str(os.getpid()))
    time.sleep(60)


def environment(name):
    return os.environ.get(name)


class Suicide:
    """A stack that takes its process with it."""

    def __init__(self, specs, map, settings):
        pass

    def tick(self, frame):
        os.kill(os.getpid(), signal.SIGKILL)


class Raising:
    """A stack with a bug."""

    def __init__(self, specs, map, settings):
        pass

    def tick(self, frame):
        return VehicleCommand(throttle=1 / (10 - frame.tick))


class Speechless:
    """A stack that returns no command."""

    def __init__(self, specs, map, settings):
        pass

    def tick(self, frame):
        return None
