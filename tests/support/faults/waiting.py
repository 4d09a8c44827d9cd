"""For tests that wait for what must happen, however busy the machine is."""

import time

PATIENCE = 300.0  # s


def waited(condition):
    """Whether it came true; a test does not ask how long it took."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.01)
    return False
