"""Which vehicles of a CARLA server take part in traffic, from a library made up here."""

from __future__ import annotations

import pytest

from skidpad.simulation.carla.blueprints import traffic_blueprints


class Blueprint:
    def __init__(self, id: str, wheels: int = 4) -> None:
        self.id, self.wheels = id, wheels

    def get_attribute(self, name: str) -> str:
        assert name == "number_of_wheels"
        return str(self.wheels)


class Library(list[Blueprint]):
    def filter(self, pattern: str) -> list[Blueprint]:
        assert pattern == "vehicle.*"
        return self


@pytest.mark.req("A-206")
def test_traffic_has_four_wheels_none_of_the_excluded_and_a_fixed_order() -> None:
    excluded = ("micro.microlino", "carlamotors.carlacola", "tesla.cybertruck", "volkswagen.t2")
    bikes = [Blueprint("vehicle.bh.crossbike", 2), Blueprint("vehicle.three.wheeler", 3)]
    out = [Blueprint(f"vehicle.{id}") for id in (*excluded, "mercedes.sprinter")]
    cars = [
        Blueprint(f"vehicle.{id}") for id in ("volkswagen.t2_2021", "audi.tt", "bmw.grandtourer")
    ]
    chosen = traffic_blueprints(Library([*cars, *out, *bikes]))
    assert [b.id for b in chosen] == [
        "vehicle.audi.tt", "vehicle.bmw.grandtourer", "vehicle.volkswagen.t2_2021"
    ]  # fmt: skip
