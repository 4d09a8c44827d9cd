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


STAGE = """
import numpy as np
synchronous()
library, roads = world.get_blueprint_library(), world.get_map()
first = roads.get_waypoint(roads.get_spawn_points()[0].location).get_right_lane()

def spawn(name, transform):
    return world.spawn_actor(library.find(name), transform)

ego = spawn("vehicle.tesla.model3", first.transform)
lead = spawn("vehicle.audi.etron", first.next(25.0)[0].transform)
aside = spawn("vehicle.carlamotors.carlacola", first.next(20.0)[0].get_right_lane().transform)
foot = first.next(12.0)[0].transform
left = foot.get_right_vector() * -1.5
walker = spawn("walker.pedestrian.0001",
               carla.Transform(foot.location + left + carla.Location(z=1.0), foot.rotation))
world.tick()

def tick(times=1):
    for _ in range(times):
        frame = world.tick()
    return frame

def at(sensor, frame):
    while True:
        data = heard[sensor.id].get(timeout=120.0)
        if data.frame >= frame:
            assert data.frame == frame
            return data

def seen_from(transform, actor):
    p = actor.get_transform().transform(actor.bounding_box.location)
    return np.array(transform.get_inverse_matrix()) @ np.array([p.x, p.y, p.z, 1.0])
"""
