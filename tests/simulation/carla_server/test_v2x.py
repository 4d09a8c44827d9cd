"""V2X: when stations speak, what arrives, and what the unmodified client reads of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import log10, pi
from typing import Any

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.actors.registry import Attachment, Box
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.sensing import cam
from skidpad.simulation.carla_server.sensing.radio import (
    Boxes,
    Call,
    Radio,
    Way,
    find_crossed_boxes,
    knife_edge,
    loss,
)
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.snapshot import HEADER
from support.carla_streams import Kept

RADIO = Radio("Default", 5.9, 21.5, -99.0, 10.0, "highway", 2.7, 1.0, 500.0, None, False)


def call(x: float, z: float = 1.5) -> Call:
    return Call(1, "sensor.other.v2x", "Default", 21.5, (x, 0.0, z), 0.0, 0, [])


def test_loss_on_an_open_road_is_nearly_that_of_free_space():
    """Friis at 5.9 GHz and 100 m is 87.9 dB; WINNER's line of sight says 87.8."""
    friis = 20.0 * log10(4.0 * pi * 100.0 * 5.9e9 / 299_792_458.0)
    found = loss(RADIO, Way.CLEAR, call(0.0), (100.0, 0.0, 1.5), 0.0, [])
    assert found == pytest.approx(friis, abs=0.1)


def test_two_rays_meet_free_space_near_and_fall_by_forty_decibels_far_away():
    radio = replace(RADIO, geometric=True)

    def at(distance: float) -> float:
        return loss(radio, Way.CLEAR, call(0.0), (distance, 0.0, 1.5), 0.0, [])

    assert at(40_000.0) - at(4_000.0) == pytest.approx(40.0, abs=0.5)
    friis = 20.0 * log10(4.0 * pi * 3.0 * 5.9e9 / 299_792_458.0)
    assert at(3.0) == pytest.approx(friis, abs=6.1)


def test_an_edge_at_the_line_costs_six_decibels():
    """Half the wave is cut off: half the field, 6.0 dB (the formula says 6.02)."""
    lorry = Box(Pose(50.0, 0.0, 0.75), (4.0, 1.2, 0.75))
    found = knife_edge(lorry, (0.0, 0.0, 1.5), (100.0, 0.0, 1.5), RADIO.wavelength)
    assert found == pytest.approx(6.02, abs=0.05)
    taller = Box(Pose(50.0, 0.0, 1.75), (4.0, 1.2, 1.75))
    higher = knife_edge(taller, (0.0, 0.0, 1.5), (100.0, 0.0, 1.5), RADIO.wavelength)
    assert higher > found + 5.0


def test_lines_cross_boxes():
    boxes = [
        Box(Pose(10.0, 0.0, 1.0), (1.0, 1.0, 1.0)),
        Box(Pose(20.0, 1.2, 1.0, yaw=pi / 4.0), (1.0, 1.0, 1.0)),  # a corner reaches the line
        Box(Pose(20.0, 1.6, 1.0), (1.0, 1.0, 1.0)),
        Box(Pose(40.0, 0.0, 1.0), (1.0, 1.0, 1.0)),  # beyond the end
        Box(Pose(10.0, 0.0, 4.0), (1.0, 1.0, 1.0)),  # above
    ]
    among = Boxes.of(enumerate(boxes, start=1))
    assert find_crossed_boxes(among, (0.0, 0.0, 1.0), (30.0, 0.0, 1.0)) == boxes[:2]
    assert (
        find_crossed_boxes(among, (0.0, 0.0, 1.0), (30.0, 0.0, 1.0), besides=(1, 4)) == boxes[1:2]
    )
    assert find_crossed_boxes(Boxes.of([]), (0.0, 0.0, 1.0), (30.0, 0.0, 1.0)) == []


def test_a_station_speaks_when_something_changes_and_at_least_every_second():
    rhythm, pose = cam.Rhythm(0.1, 1.0, fixed=False, period=1.0), Pose(0.0, 0.0)
    told = [t for t in range(61) if rhythm.due(0.05 * t, pose, 0.0)]
    assert told == [0, 20, 40, 60]
    assert rhythm.due(3.1, replace(pose, x=4.1), 0.0)
    assert not rhythm.due(3.15, replace(pose, x=8.3), 0.0)  # sooner than 0.1 s
    assert rhythm.due(3.2, replace(pose, x=8.3), 0.0)
    assert rhythm.due(3.3, replace(pose, x=8.3), 0.6)
    assert rhythm.due(3.4, Pose(8.3, 0.0, yaw=0.08), 0.6)


@pytest.fixture
def pair(tmp_path):
    """A server of the straight road, and all that its sensors send."""
    hub = Kept()
    served = Served(ServerOptions(map="straight", data_dir=tmp_path), hub)
    return served, hub


def car(served: Served, x: float, kind: str = "sensor.other.v2x", **attributes: str):
    where = Pose(x, -1.75)
    vehicle = served.episode.spawn(Wanted("vehicle.tesla.model3", {}), where)
    wanted = Wanted(kind, {"use_etsi_fading": "false", **attributes})
    return served.episode.attach(wanted, Pose(0.0, 0.0, 1.6), vehicle.id, Attachment.RIGID)


def read(hub: Kept, sensor, dtype) -> np.ndarray:
    return np.frombuffer(hub.told[sensor.stream][-1][HEADER.size :], dtype=dtype)


def test_two_cars_hear_each_other_and_not_themselves(pair):
    served, hub = pair
    one, two = car(served, 200.0), car(served, 240.0)
    served.tick()
    (heard,) = read(hub, one, cam.AWARENESS)
    assert heard["header"]["station"] == two.parent
    assert heard["body"]["station"] == 5  # passenger car
    assert heard["power"] == pytest.approx(21.5 + 10.0 - (32.4 + 20.0 * log10(40.0 * 5.9)), abs=0.1)
    assert heard["body"]["vehicle"]["length"]["value"] == 48  # 4.79 m


def written(kind: np.dtype) -> np.ndarray:
    """Which bytes of a record belong to a field; the others are padding."""
    if kind.subdtype is not None:
        base, shape = kind.subdtype
        return np.tile(written(base), int(np.prod(shape)))
    if kind.fields is None:
        return np.ones(kind.itemsize, dtype=bool)
    found = np.zeros(kind.itemsize, dtype=bool)
    for part, offset, *_ in kind.fields.values():
        found[offset : offset + part.itemsize] = written(part)
    return found


def test_no_byte_of_the_servers_memory_goes_out_between_fields(pair):
    served, hub = pair
    one, two, _ = (car(served, x) for x in (200.0, 240.0, 280.0))
    for _ in range(30):
        served.tick()
    for sensor in (one, two):
        for told in hub.told[sensor.stream]:
            records = np.frombuffer(told[HEADER.size :], np.uint8).reshape(
                -1, cam.AWARENESS.itemsize
            )
            assert not records[:, ~written(cam.AWARENESS)].any()


def test_what_stands_between_weakens_and_distance_silences(pair):
    served, hub = pair
    one, near, far = car(served, 200.0), car(served, 240.0), car(served, 750.0)
    served.episode.spawn(Wanted("vehicle.carlamotors.european_hgv", {}), Pose(220.0, -1.75))
    served.tick()
    (heard,) = read(hub, one, cam.AWARENESS)
    assert heard["header"]["station"] == near.parent != far.parent
    assert heard["power"] < 21.5 + 10.0 - (32.4 + 20.0 * log10(40.0 * 5.9)) - 6.0


def test_texts_stay_on_their_channel_and_are_cut(pair):
    served, hub = pair
    kind = "sensor.other.v2x_custom"
    one, two = car(served, 200.0, kind), car(served, 240.0, kind)
    other = car(served, 270.0, kind, channel_id="Other")
    served.episode.sensors.of(one.id).equipment.queue.extend([b"first", b"x" * 300])
    served.tick()
    assert not {one.stream, other.stream} & set(hub.told)
    assert read(hub, two, cam.TEXT)["text"].tolist() == [b"first", b"x" * 99]
    hub.told.clear()
    served.tick()
    assert two.stream not in hub.told


Serve = Callable[..., Any]


def test_the_client_reads_awareness_and_texts(serve: Serve) -> None:
    """K-4: the wheel's own decoder against what the client knows of the sender."""
    serve("--map", "straight").client(
        """
synchronous()
library, roads = world.get_blueprint_library(), world.get_map()
first = roads.get_waypoint(roads.get_spawn_points()[0].location)
ego = world.spawn_actor(library.find("vehicle.tesla.model3"), first.transform)
bus = world.spawn_actor(library.find("vehicle.mitsubishi.fusorosa"), first.next(40.0)[0].transform)
van = world.spawn_actor(library.find("vehicle.dodge.charger_police"), first.next(70.0)[0].transform)
above = carla.Transform(carla.Location(z=4.0))
calm = dict(use_etsi_fading="false")
ears = listen("sensor.other.v2x", above, **calm)
def put(name, carrier):
    blueprint = library.find(name)
    blueprint.set_attribute("use_etsi_fading", "false")
    return world.spawn_actor(blueprint, above, attach_to=carrier)
put("sensor.other.v2x", bus), put("sensor.other.v2x", van)
texts = listen("sensor.other.v2x_custom", above, **calm)
mouth = put("sensor.other.v2x_custom", bus)
forward = first.transform.get_forward_vector()
van.set_target_velocity(forward * 9.0)
van.set_light_state(carla.VehicleLightState(carla.VehicleLightState.LeftBlinker))
time.sleep(0.5)
mouth.send("hello, world")
world.tick()
event = heard[ears.id].get(timeout=60.0)
assert event.get_message_count() == 2, event.get_message_count()
told = {m.get()["Message"]["Header"]["Station ID"]: m.get() for m in event}
assert set(told) == {bus.id, van.id}, told
snapshot = world.get_snapshot()
for actor, type in ((bus, "Bus"), (van, "Special Vehicle")):
    message = told[actor.id]["Message"]["Message"]
    part = message["CAM Parameters"]
    assert part["Basic Container"]["Station Type"] == type, part
    geo = roads.transform_to_geolocation(snapshot.find(actor.id).get_transform().location)
    place = part["Basic Container"]["Reference Position"]
    # the message counts in tenths of a microdegree, rounded to whole ones
    assert abs(place["Latitude"] - geo.latitude * 1e7) <= 5.01, (place, geo.latitude)
    assert abs(place["Longitude"] - geo.longitude * 1e7) <= 5.01, (place, geo.longitude)
    high = part["High Frequency Container"]["Basic Vehicle Container High Frequency"]
    v = snapshot.find(actor.id).get_velocity().length()
    assert abs(high["Speed"]["Value"] - 100.0 * v) <= 2, (high, v)
    assert high["Vehicle Length"]["Value"] == round(20.0 * actor.bounding_box.extent.x), high
    heading = (snapshot.find(actor.id).get_transform().rotation.yaw + 90.0) % 360.0
    assert abs(high["Heading"]["Value"] / 10.0 - heading) < 0.2, (high, heading)
    assert high["Lane Position"] is None and high["Vertical Acceleration"]["Value"] == 98, high
low = told[van.id]["Message"]["Message"]["CAM Parameters"]["Low Frequency Container"]
low = low["Basic Vehicle Low Frequency"]
assert low["Vehicle Role"] == "Emergency" and low["Exterior Light"] == 1 << 5, low
assert abs(told[bus.id]["Power"]
           - (31.5 - 32.4 - 20.0 * math.log10(5.9 * ears.get_location().distance(
               carla.Location(bus.get_location() + carla.Location(z=4.0)))))) < 0.2
(text,) = heard[texts.id].get(timeout=60.0)
said = text.get()["Message"]
assert said["Header"]["Station ID"] == bus.id and said["Message"] == "hello, world", said
"""
    )
