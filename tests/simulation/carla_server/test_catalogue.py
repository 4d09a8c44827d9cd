from __future__ import annotations

import pytest

from skidpad.core.vocabulary import ActorKind
from skidpad.simulation.carla_server.actors.catalogue import (
    AttributeType,
    Family,
    choose_attributes,
    load_catalogue,
)
from skidpad.simulation.carla_server.protocol.wire import WireError
from skidpad.simulation.carla_server.vehicles.vehicles import model_of


def test_the_catalogue_has_what_a_0_9_16_server_was_seen_to_offer() -> None:
    by_family: dict[Family, int] = {}
    for blueprint in load_catalogue().values():
        by_family[blueprint.family] = by_family.get(blueprint.family, 0) + 1
    assert by_family[Family.VEHICLE] == 41
    assert by_family[Family.WALKER] == 52
    assert by_family[Family.PROP] >= 98
    assert by_family[Family.SENSOR] == 19


@pytest.mark.parametrize(
    ("id", "attribute", "default"),
    [
        ("static.trigger.friction", "friction", "3.5"),
        ("sensor.lidar.ray_cast", "range", "10.0"),
        ("sensor.camera.rgb", "chromatic_aberration_intensity", "0.0"),
        ("vehicle.dodge.charger_2020", "number_of_wheels", "4"),
        ("vehicle.bh.crossbike", "number_of_wheels", "2"),
        ("walker.pedestrian.0001", "is_invincible", "true"),
        ("sensor.other.radar", "points_per_second", "1500"),
    ],
)
def test_attributes_that_scripts_rely_on(id: str, attribute: str, default: str) -> None:
    assert load_catalogue()[id].attributes[attribute].recommended[0] == default


def test_every_default_parses_as_its_type() -> None:
    for blueprint in load_catalogue().values():
        defaults = {a.id: a.recommended[0] for a in blueprint.attributes.values() if a.modifiable}
        assert choose_attributes(blueprint, defaults) == choose_attributes(blueprint, {})


@pytest.mark.parametrize(
    ("name", "value"),
    [("color", "300,0,0"), ("color", "red"), ("driver_id", "7"), ("ros_publish_tf", "true")],
)
def test_values_are_checked(name: str, value: str) -> None:
    blueprint = load_catalogue()["vehicle.audi.tt"]
    if name == "ros_publish_tf":
        assert choose_attributes(blueprint, {name: value})[name] == value
        return
    with pytest.raises(WireError):
        choose_attributes(blueprint, {name: value})


def test_a_float_of_c_plus_plus_is_kept_as_one_that_all_sensors_read() -> None:
    """`5.9f` was accepted and kept, and a camera that read its fov ended in an internal error."""
    blueprint = load_catalogue()["sensor.camera.rgb"]
    assert choose_attributes(blueprint, {"fov": "5.9f"})["fov"] == "5.9"
    for wrong in ("inf", "5.9ff", "f"):
        with pytest.raises(WireError, match="fov"):
            choose_attributes(blueprint, {"fov": wrong})


def test_every_vehicle_has_physics_of_its_size() -> None:
    for blueprint in load_catalogue().values():
        if blueprint.family is Family.VEHICLE:
            model = model_of(blueprint)
            assert (model.length, model.width, model.height) == blueprint.size
            assert blueprint.kind <= ActorKind.BICYCLE
            assert 10.0 < model.mass < 40_000.0


def test_cars_of_different_makes_have_different_default_colours() -> None:
    makes = ("tesla.model3", "audi.tt", "mini.cooper_s", "carlamotors.firetruck")
    found = [load_catalogue()[f"vehicle.{m}"].attributes["color"].recommended for m in makes]
    assert len({colours[0] for colours in found}) == len(makes)
    assert len({frozenset(colours) for colours in found}) == 1


def test_fixed_attributes_cannot_be_set() -> None:
    blueprint = load_catalogue()["vehicle.audi.tt"]
    assert choose_attributes(blueprint, {"number_of_wheels": "9"})["number_of_wheels"] == "4"
    assert blueprint.attributes["color"].type is AttributeType.COLOUR


def test_sensors_of_events_have_no_period() -> None:
    catalogue = load_catalogue()
    sensors = {b.id for b in catalogue.values() if b.family is Family.SENSOR}
    timed = {id for id in sensors if "sensor_tick" in catalogue[id].attributes}
    assert sensors - timed == {"sensor.other.collision", "sensor.other.lane_invasion"}
