"""The map's own objects: all have ids and boxes, and what is hidden is there for nobody."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import Scenery, SemanticClass
from skidpad.roads.bundled import load_map, map_file
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.ranging.around import Fan, look_around
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.maps import scenery
from skidpad.simulation.carla_server.maps.landscape import Landscape, objects, pieces, without
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.world.obstacles import obstacles

FENCE, WALL = SemanticClass.FENCE, SemanticClass.WALL


@pytest.mark.parametrize("name", ["town", "figure8", "motorway", "straight"])
def test_everything_beside_the_road_has_an_id_and_a_box(name):
    roads = load_map(map_file(name))
    found = objects(roads)
    assert len({o.id for o in found}) == len(found)
    kinds = {SemanticClass(o.label) for o in found}
    assert SemanticClass.GUARD_RAIL in kinds
    if name in ("town", "figure8", "motorway"):
        assert SemanticClass.BUILDING in kinds
    for barrier in roads.roadside.barriers:
        assert list(pieces(barrier.points))[-1][1] == len(barrier.points) - 1
    lengths = [2.0 * o.half[0] for o in found if o.source.kind == "barriers"]
    assert max(lengths) <= 50.0 + 1e-6


def test_boxes_of_barriers_hold_their_points():
    roads = load_map(map_file("motorway"))
    for o in objects(roads):
        if o.source.kind != "barriers":
            continue
        points = roads.roadside.barriers[o.source.row].points[o.source.first : o.source.last + 1]
        c, s = np.cos(o.centre.yaw), np.sin(o.centre.yaw)
        dx, dy = points[:, 0] - o.centre.x, points[:, 1] - o.centre.y
        assert np.abs(dx * c + dy * s).max() <= o.half[0] + 0.31
        assert np.abs(dy * c - dx * s).max() <= 0.31


def test_what_is_hidden_is_cut_out_of_the_map():
    roads = load_map(map_file("motorway"))
    rails = [o for o in objects(roads) if o.source.kind == "barriers" and o.source.row == 0]
    middle = rails[len(rails) // 2]
    left = without(roads, frozenset({middle.id}))
    assert len(left.roadside.barriers) == len(roads.roadside.barriers) + (len(rails) > 2)
    gone = middle.source.last - middle.source.first
    assert len(obstacles(left).names) == len(obstacles(roads).names) - gone
    assert left.content_hash != roads.content_hash
    everything = without(roads, frozenset(o.id for o in objects(roads)))
    assert not everything.roadside.boxes
    assert not obstacles(everything).names


def test_layers_act_on_layered_maps_only():
    roads = load_map(map_file("town"))
    plain, layered = Landscape(roads, layered=False), Landscape(roads, layered=True)
    for landscape in (plain, layered):
        landscape.load(1, on=False)  # buildings
    assert plain.roads is roads
    assert SemanticClass.BUILDING not in {o.label for o in layered.present()}
    assert len(layered.roads.roadside.boxes) < len(roads.roadside.boxes)
    layered.load(0xFFFF, on=True)
    assert layered.roads is roads


def test_parked_cars_are_objects_of_the_map_in_a_layer_of_their_own():
    roads = dress_map(load_map(map_file("town")), Scenery.FULL)
    landscape = Landscape(roads, layered=True)
    cars = [o for o in landscape.present() if o.label == SemanticClass.CAR]
    assert cars
    assert all(o.half[0] > 1.8 and o.half[2] > 0.7 for o in cars)
    landscape.load(16, on=False)  # carla.MapLayer.ParkedVehicles
    assert SemanticClass.CAR not in {o.label for o in landscape.present()}
    names = obstacles(roads).names
    assert names.count("car") == 4 * len(cars)
    assert "car" not in obstacles(landscape.roads).names


def test_lidar_meets_a_parked_car_in_its_shape():
    served = Served(ServerOptions(map="town_Opt", scenery=Scenery.FULL), StreamHub())
    car = next(o for o in objects(served.episode.map.roads) if o.label == SemanticClass.CAR)
    yaw, away = car.centre.yaw, car.half[0] + 3.0
    x, y = car.centre.x - away * np.cos(yaw), car.centre.y - away * np.sin(yaw)
    eye = Pose(x, y, car.centre.z - car.half[2] + 0.6, yaw=yaw)
    ahead = Fan(np.zeros(1), np.zeros(1), np.zeros(1, dtype=int), np.zeros(1, dtype=int))
    seen = look_around(served.episode.surroundings.picture().live, eye, ahead, 50.0, -1)
    assert seen.label[0] == SemanticClass.CAR
    assert seen.distance[0] == pytest.approx(3.0, abs=0.2)


def facing_a_building(served: Served):
    """A building, and a pose 12 m before its longer side."""
    building = next(
        o for o in objects(served.episode.map.roads) if o.label == SemanticClass.BUILDING
    )
    away = building.half[1] + 12.0
    yaw = building.centre.yaw + np.pi / 2.0
    x, y = building.centre.x - away * np.cos(yaw), building.centre.y - away * np.sin(yaw)
    return building, Pose(x, y, building.centre.z, yaw=yaw)


def test_lidar_ray_and_car_go_through_what_is_hidden():
    served = Served(ServerOptions(map="town_Opt", scenery=Scenery.NONE), StreamHub())
    episode = served.episode
    building, eye = facing_a_building(served)
    ahead = Fan(np.zeros(1), np.zeros(1), np.zeros(1, dtype=int), np.zeros(1, dtype=int))

    def seen():
        live = episode.surroundings.picture().live
        return look_around(live, eye, ahead, 100.0, -1)

    def met():
        way = (np.cos(eye.yaw), np.sin(eye.yaw), 0.0)
        hits = scenery.trace_ray(
            episode.landscape, episode.actors, (eye.x, eye.y, eye.z), way, 14.0
        )
        return [h.label for h in hits]

    before = seen()
    assert before.label[0] == SemanticClass.BUILDING
    assert before.distance[0] == pytest.approx(12.0, abs=0.01)
    assert met() == [SemanticClass.BUILDING]
    count = len(episode.moving.obstacles.names)
    episode.landscape.toggle([building.id], on=False)
    episode.relandscape()
    served.tick()
    after = seen()
    assert not len(after.ray) or after.distance[0] > 12.5
    assert met() == []
    assert len(episode.moving.obstacles.names) == count - 4
    episode.landscape.toggle([building.id], on=True)
    episode.relandscape()
    served.tick()
    assert seen().distance[0] == pytest.approx(12.0, abs=0.01)
    assert len(episode.moving.obstacles.names) == count


def test_layers_asked_for_at_loading():
    served = Served(ServerOptions(map="straight"), StreamHub())
    served.load("town_Opt", False, 0xFFFF & ~1)
    labels = {o.label for o in served.episode.landscape.present()}
    assert SemanticClass.BUILDING not in labels
    served.episode.spawn(Wanted("vehicle.tesla.model3", {}), served.episode.map.spawn_points[0])
    served.tick()
