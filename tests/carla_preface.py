"""How every client script of the tests begins and ends."""

from __future__ import annotations

PREFACE = """
import carla, math, sys, time
client = carla.Client("127.0.0.1", int(sys.argv[1]))
client.set_timeout(20.0)
world = client.get_world()

def synchronous(step=0.05):
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, step
    world.apply_settings(settings)

def finish():
    for sensor in world.get_actors().filter("sensor.*"):
        sensor.destroy()  # not stop: see skidpad.pytest_plugin.stop_sensors
    print("DONE", flush=True)
    import os
    os._exit(0)
"""
