"""Recurring hazards are found, whatever the order, and represented by one of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import HazardType
from skidpad.fleet.identity import digest
from skidpad.fleet.patterns.analysis import POINTS, SIGNALS, from_plain, series_of, to_plain
from skidpad.fleet.patterns.clusters import (
    Case,
    ClusterSettings,
    find_clusters,
    recurring,
    warping_table,
)
from skidpad.fleet.store.accounts import add_person, add_vehicle
from skidpad.fleet.words import Role
from support.examples import examples
from support.fleet_world import NOW, packed, record

N = len(SIGNALS)
FALLING = np.tile(np.linspace(1.0, 0.0, POINTS)[:, None], (1, N))
FLAT = np.full((POINTS, N), 0.5)


def case(k: int, place=(0.0, 0.0), course=FALLING, **rest) -> Case:
    rng = np.random.default_rng(k)
    x, y = np.array(place) + rng.normal(0.0, 4.0, 2)
    return Case(
        f"id{k}", digest(str(k).encode()), f"v{k % 4}", rest.get("type", "ego_tailgating"),
        rest.get("map", "town"), rest.get("weather", "day, dry"), float(x), float(y),
        np.clip(course + rng.normal(0.0, 0.02, (POINTS, N)), 0.0, 1.0),
    )  # fmt: skip


def crowd() -> list[Case]:
    """Eight at one crossing, six at another, four strangers far apart, three of another kind."""
    cases = [case(k) for k in range(8)]
    cases += [case(k, (900.0, 300.0)) for k in range(10, 16)]
    cases += [case(k, (5000.0 * k, -3000.0 * k), FLAT) for k in range(20, 24)]
    return cases + [case(k, type="crossing_object") for k in range(30, 33)]


@pytest.mark.req("C-193")
def test_what_recurs_is_found_and_strangers_are_left_alone():
    found = find_clusters(crowd())
    assert [set(c.members) for c in found] == [
        {f"id{k}" for k in range(8)},
        {f"id{k}" for k in range(10, 16)},
        {f"id{k}" for k in range(30, 33)},
    ]
    assert [c.vehicles for c in found] == [4, 4, 3]
    for cluster in found:
        assert cluster.members[0] == cluster.representative
        assert cluster.distances[0] == 0.0
        assert list(cluster.distances) == sorted(cluster.distances)


@settings(max_examples=examples(10))
@given(st.permutations(range(21)))
def test_the_order_in_which_hazards_came_changes_nothing(order):
    cases = crowd()
    assert find_clusters([cases[i] for i in order]) == find_clusters(cases)


def test_who_went_another_way_is_let_go_by_its_course():
    """Same place and the same least, greatest and mean: only the course in time tells them apart."""
    wave = 0.5 + 0.5 * np.sin(np.linspace(0.0, 6.0 * np.pi, POINTS))
    rising = FALLING[::-1]
    cases = [case(k) for k in range(7)] + [case(99, course=rising)]
    tight = ClusterSettings(warp=1.0)
    assert "id99" not in find_clusters(cases, tight)[0].members
    assert np.ptp(wave) > 0.9
    loose = ClusterSettings(warp=100.0)
    assert "id99" in find_clusters(cases, loose)[0].members


def test_the_representative_is_the_medoid():
    (cluster,) = find_clusters([case(k) for k in range(8)])
    table = warping_table([case(k).series for k in range(8)])
    assert cluster.representative == f"id{int(np.argmin(table.sum(axis=1)))}"


def slow_warping(a: np.ndarray, b: np.ndarray) -> float:
    """Dynamic time warping as it is defined."""
    cost = np.full((len(a) + 1, len(b) + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(len(a)):
        for j in range(len(b)):
            step = min(cost[i, j], cost[i, j + 1], cost[i + 1, j])
            cost[i + 1, j + 1] = float(((a[i] - b[j]) ** 2).sum()) + step
    return float(np.sqrt(cost[-1, -1]))


def test_warping_is_what_its_definition_says():
    some = [case(1).series, case(2, course=FLAT).series, case(3, course=FALLING[::-1]).series]
    table = warping_table(some)
    for i in range(3):
        for j in range(3):
            assert table[i, j] == pytest.approx(slow_warping(some[i], some[j]), abs=1e-9)


def test_the_exact_key_is_map_kind_cell_and_weather():
    one = replace(case(1), x=10.0, y=10.0)
    same = replace(one, id="b", digest="b", x=24.9, y=0.1)
    others = [
        replace(one, id="c", x=25.1), replace(one, id="d", map="figure8"),
        replace(one, id="e", weather="night, dry"), replace(one, id="f", type="stuck_vehicle"),
    ]  # fmt: skip
    found = recurring([*others, same, one], ClusterSettings())
    assert list(found) == [("town", "ego_tailgating", 0, 0, "day, dry")]
    assert set(next(iter(found.values()))) == {one.id, "b"}


def test_settings_out_of_range_are_refused():
    for bad in ({"cell": 0.0}, {"least": 1}, {"warp": float("nan")}):
        with pytest.raises(ConfigError):
            ClusterSettings(**bad)


def test_a_series_tells_closing_in_from_nothing():
    close = series_of(record(1))
    assert close.shape == (POINTS, N)
    assert (close >= 0.0).all()
    assert (close <= 1.0).all()
    assert np.array_equal(from_plain(to_plain(close)), np.round(close, 4))
    nothing = series_of(structs.replace(record(1), worlds=()))
    assert (nothing[0] == [neutral for _, _, neutral in SIGNALS]).all()
    assert close[:, 0].min() < nothing[:, 0].min()  # time to collision ahead


@pytest.mark.req("C-173")
def test_an_analysis_on_demand_is_kept_and_read_by_its_own_tenant(world):
    for k in range(4):
        near = [record(10 * k + i, (120.0 + i, 30.0)) for i in range(2)]
        far = [record(10 * k + 5, (900.0 + k, -200.0), HazardType.EGO_TAILGATED)]
        vehicle = ("red-1", "red-2")[k % 2]
        assert world.send(vehicle, packed(*near, *far), f"batch-key-{k}").status_code == 200
    done = world.post("axle", "/api/v1/analyses").json()
    assert (done["hazards"], done["unreadable"], done["clusters"]) == (12, 0, 2)
    mine = world.get("axle", "/api/v1/clusters").json()
    assert [(len(c["members"]), c["type"], c["vehicles"]) for c in mine] == [
        (8, "ego_tailgating", 2), (4, "ego_tailgated", 2),
    ]  # fmt: skip
    one = world.get("axle", f"/api/v1/clusters/{mine[0]['id']}")
    assert one.json()["members"] == mine[0]["members"]
    assert (
        world.get("axle", f"/api/v1/hazards/{mine[0]['representative']}/record").status_code == 200
    )
    for other in ("bolt", "red operator", "blue operator"):
        assert world.get(other, f"/api/v1/clusters/{mine[0]['id']}").status_code == 404
        assert world.get(other, "/api/v1/clusters").json() == []
    again = world.post("axle", "/api/v1/analyses").json()
    assert again["clusters"] == 2


@pytest.mark.req("C-173")
def test_the_service_looks_by_itself_and_only_when_something_came(world):
    from skidpad.fleet.upkeep import REST_S, Upkeep

    upkeep = Upkeep(world.fleet)
    upkeep.work()
    assert world.get("red operator", "/api/v1/clusters").json() == []
    hazards = [record(k, (120.0 + k, 30.0)) for k in range(4)]
    world.send("red-1", packed(*hazards), "batch-key-1")
    upkeep.work()
    first = world.get("red operator", "/api/v1/clusters").json()
    assert [len(c["members"]) for c in first] == [4]
    assert [len(c["members"]) for c in world.get("axle", "/api/v1/clusters").json()] == [4]
    assert world.get("blue operator", "/api/v1/clusters").json() == []
    world.clock.now += 2 * REST_S
    upkeep.work()
    again = world.get("red operator", "/api/v1/clusters").json()
    assert [c["analysis"] for c in again] == [c["analysis"] for c in first]
    world.send("red-1", packed(record(9, (121.0, 30.0))), "batch-key-2")
    upkeep.work()
    (grown,) = world.get("red operator", "/api/v1/clusters").json()
    assert len(grown["members"]) == 5


def test_who_makes_cars_and_runs_others_sees_by_role_what_each_may(world):
    """One organisation, two roles: what it learns as a maker is no operator's to read."""
    from skidpad.fleet.upkeep import Upkeep

    with world.fleet.engine.begin() as connection:
        for k in (1, 2):
            car = add_vehicle(connection, "axle", "bolt", f"axle-{k}", NOW)
            world.accounts[f"axle-{k}"] = car
        person = add_person(connection, "axle", Role.OPERATOR, "olga", NOW)
        world.accounts["axle operator"] = person
    for vehicle, x in (("red-1", 120.0), ("axle-1", 900.0)):
        near = [record(k, (x + k, 30.0)) for k in range(4)]
        assert world.send(vehicle, packed(*near), f"{vehicle}-key-1").status_code == 200
    Upkeep(world.fleet).work()
    (made,) = world.get("axle", "/api/v1/clusters").json()
    (run,) = world.get("axle operator", "/api/v1/clusters").json()
    assert (made["x"] < 200.0, run["x"] > 800.0) == (True, True)
    for who, foreign in (("axle", run), ("axle operator", made)):
        assert world.get(who, f"/api/v1/clusters/{foreign['id']}").status_code == 404
