"""How every client script of the tests begins and ends."""

from __future__ import annotations

PREFACE = """
import carla, math, queue, sys, time
client = carla.Client("127.0.0.1", int(sys.argv[1]))
client.set_timeout(20.0)
world = client.get_world()

def synchronous(step=0.05):
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, step
    world.apply_settings(settings)

heard = {}

def listen(name, place=carla.Transform(), **attributes):  # of the script's `library` and `ego`
    blueprint = library.find(name)
    for key, value in attributes.items():
        blueprint.set_attribute(key, str(value))
    sensor = world.spawn_actor(blueprint, place, attach_to=ego)
    heard[sensor.id] = queue.Queue()
    sensor.listen(heard[sensor.id].put)
    return sensor

def finish():
    for sensor in world.get_actors().filter("sensor.*"):
        sensor.destroy()  # not stop: see skidpad.pytest_plugin.stop_sensors
    print("DONE", flush=True)
    import os
    os._exit(0)
"""
