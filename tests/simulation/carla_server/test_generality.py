"""K-5: a client that we did not tune for, on a map that we did not ship."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

Serve = Callable[..., Any]

UNSEEN = """
import os, queue, random
chance = random.Random(SEED)
length, bend = chance.uniform(150.0, 400.0), 1.0 / chance.choice((-1, 1)) / chance.uniform(60, 200)
width, lanes = chance.uniform(2.9, 4.1), chance.randint(1, 3)
side = "".join(
    f'<lane id="-{i}" type="driving"><width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane>'
    for i in range(1, lanes + 1))
xodr = f'''<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4" name="unseen">
<geoReference><![CDATA[+proj=tmerc +lat_0=10.5 +lon_0=20.5]]></geoReference></header>
<road name="a" length="{length}" id="{chance.randint(1, 5000)}" junction="-1"><planView>
<geometry s="0" x="{chance.uniform(-900, 900)}" y="{chance.uniform(-900, 900)}"
 hdg="{chance.uniform(-3, 3)}" length="{length}"><arc curvature="{bend}"/></geometry></planView>
<elevationProfile><elevation s="0" a="{chance.uniform(-5, 30)}" b="0.02" c="0" d="0"/>
</elevationProfile><lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
<right>{side}</right></laneSection></lanes></road></OpenDRIVE>'''
world = client.generate_opendrive_world(xodr)
synchronous(chance.choice((0.02, 0.05, 0.1)))
roads, library = world.get_map(), world.get_blueprint_library()
assert world.get_random_location_from_navigation() is None  # no pavement, no shoulder
points = roads.get_spawn_points()
assert points
for point in points:
    lane = roads.get_waypoint(point.location)
    assert lane.transform.location.distance(point.location) < 0.6, (lane.transform, point)

frames, sensors, mine = [world.tick()], [], []

def act_spawn():
    blueprint = chance.choice(library.filter(chance.choice(("vehicle.*", "walker.*", "*prop*"))))
    if blueprint.has_attribute("color"):
        blueprint.set_attribute("color", ",".join(str(chance.randint(0, 255)) for _ in "rgb"))
    actor = world.try_spawn_actor(blueprint, chance.choice(points))
    if actor is not None:
        mine.append(actor)

def act_sensor():
    cars = [a for a in mine if a.is_alive and a.type_id.startswith("vehicle")]
    if not cars or len(sensors) > 5:
        return
    blueprint = library.find("sensor.camera." + chance.choice(("rgb", "depth")))
    size = chance.randint(8, 300), chance.randint(8, 200)
    blueprint.set_attribute("image_size_x", str(size[0]))
    blueprint.set_attribute("image_size_y", str(size[1]))
    blueprint.set_attribute("fov", str(chance.uniform(20, 150)))
    place = carla.Transform(carla.Location(chance.uniform(-2, 2), 0, chance.uniform(1, 3)),
                            carla.Rotation(chance.uniform(-80, 80), chance.uniform(-180, 180), 9))
    camera = world.spawn_actor(blueprint, place, attach_to=chance.choice(cars))
    heard = queue.Queue()
    camera.listen(heard.put)
    sensors.append((camera, size, heard))

def act_drive():
    for actor in mine:
        if actor.is_alive and actor.type_id.startswith("vehicle"):
            actor.apply_control(carla.VehicleControl(chance.random(), chance.uniform(-1, 1),
                                                     chance.choice((0.0, chance.random()))))
        elif actor.is_alive and actor.type_id.startswith("walker"):
            actor.apply_control(carla.WalkerControl(carla.Vector3D(1, 1, 0), chance.random() * 3))

def act_push():
    for actor in mine:
        if actor.is_alive and actor.type_id.startswith("vehicle"):
            chance.choice((actor.add_impulse, actor.add_force, actor.set_target_velocity,
                           actor.add_torque))(carla.Vector3D(*(chance.uniform(-9, 9),) * 3))

def act_tick():
    frames.append(world.tick())

def act_destroy():
    if mine:
        victim = mine.pop(chance.randrange(len(mine)))
        if not any(c.parent is not None and c.parent.id == victim.id for c, _, _ in sensors):
            victim.destroy()

def act_weather():
    world.set_weather(carla.WeatherParameters(precipitation=chance.uniform(0, 100),
                                              sun_altitude_angle=chance.uniform(-90, 90)))

acts = (act_spawn, act_sensor, act_drive, act_push, act_tick, act_tick, act_destroy, act_weather)
for _ in range(150):
    chance.choice(acts)()
time.sleep(0.3)
act_tick()
assert frames == list(range(frames[0], frames[0] + len(frames)))
for camera, size, heard in sensors:
    while True:
        image = heard.get(timeout=120.0)
        assert (image.width, image.height) == size
        assert len(image.raw_data) == 4 * size[0] * size[1]
        if image.frame == frames[-1]:
            break
snapshot = world.get_snapshot()
for actor in mine:
    t = snapshot.find(actor.id).get_transform()
    assert all(math.isfinite(v) for v in (t.location.x, t.location.y, t.location.z))
"""


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_random_calls_on_an_unseen_map(serve: Serve, seed: int) -> None:
    serve("--seed", str(seed)).client(UNSEEN.replace("SEED", str(seed)))
