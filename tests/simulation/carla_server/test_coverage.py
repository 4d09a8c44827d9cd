from __future__ import annotations

from pathlib import Path

from carla_coverage import rewritten
from skidpad.simulation.carla_server.actors.catalogue import Family, load_catalogue
from skidpad.simulation.carla_server.actors.effects import Remarks, load_acting
from skidpad.simulation.carla_server.sensing.producers import PRODUCERS

PAGE = Path(__file__).parents[3] / "docs" / "carla.md"


def test_the_page_shows_what_is_registered() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert rewritten(text) == text, "run python tools/carla_coverage.py FILE"


def test_every_acting_attribute_exists() -> None:
    catalogue = load_catalogue()
    table = load_acting()
    for sensor, names in table.sensors.items():
        assert names <= set(catalogue[sensor].attributes), sensor
    for family, names in table.families.items():
        for blueprint in catalogue.values():
            if blueprint.family is family:
                assert names <= set(blueprint.attributes)
    assert set(PRODUCERS) == set(table.sensors)
    assert set(PRODUCERS) <= {b.id for b in catalogue.values() if b.family is Family.SENSOR}


def test_vain_attributes_are_remarked_once() -> None:
    remarks = Remarks()
    blueprint = load_catalogue()["sensor.camera.rgb"]
    remarks.remark(blueprint, {"calibration_constant": "16.0", "fov": "60"})
    assert not remarks.made
    for _ in range(3):
        remarks.remark(blueprint, {"calibration_constant": "1.0"})
    assert remarks.made == {("sensor.camera.rgb", "attribute calibration_constant")}
