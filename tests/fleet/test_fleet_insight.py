"""What readers get: trends with intervals, places, research that names nobody, the safety case."""

from __future__ import annotations

import gzip
import itertools
import json
import re
import subprocess
import sys
from contextlib import closing, contextmanager
from pathlib import Path

import duckdb
import numpy as np
import polars as pl
import pytest

import channels_tables as tables
from skidpad.core.errors import FileError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.statistics import linear_ratio_limits
from skidpad.fleet.insight.places import ADVICE
from skidpad.fleet.insight.precision import measured_precision
from skidpad.fleet.insight.research import HOUR, K, export
from skidpad.fleet.insight.trends import compact, trends
from skidpad.fleet.service import Places, open_fleet
from skidpad.fleet.site.drawing import KINDS
from skidpad.fleet.store.accounts import add_vehicle
from skidpad.fleet.warehouse import MANY_VEHICLES, TAKE, Warehouse
from support.fleet_world import NOW, World, indicator_row, make_world, packed, record

DRAWS = 2000


def send_rows(world: World, vehicle: str, key: str, *rows: dict) -> None:
    body = gzip.compress("\n".join(map(json.dumps, rows)).encode())
    assert world.send(vehicle, body, key, "indicators").status_code == 200


@pytest.mark.req("C-194")
def test_trends_hold_what_was_sent_and_no_more_than_ones_own(world):
    send_rows(world, "red-1", "key-aaaa-1", indicator_row(0, 60), indicator_row(1, 0, mean=0.5))
    send_rows(world, "red-2", "key-aaaa-2", indicator_row(0, 240))
    send_rows(world, "blue-1", "key-aaaa-3", indicator_row(0, 600))
    assert compact(world.fleet) == 3
    assert compact(world.fleet) == 0
    (trend,) = world.get("red operator", "/api/v1/trends").json()["indicators"]
    assert (trend["share"], trend["vehicles"], trend["cycles"]) == (300 / 1800, 2, 1800)
    assert trend["mean"] == pytest.approx((0.9 * 600 + 0.5 * 600 + 0.9 * 600) / 1800)
    low, high = trend["interval"]
    assert low <= trend["share"] <= high
    (blue,) = world.get("bolt", "/api/v1/trends").json()["indicators"]
    assert blue["share"] == 1.0
    world.clock.now += 3 * 86400.0
    send_rows(world, "red-1", "key-aaaa-4", indicator_row(0, 0))
    later = world.get("axle", "/api/v1/trends").json()["indicators"]
    assert [t["share"] for t in later] == [300 / 1800, 0.0]


def test_every_vehicle_is_told_of_where_they_are_few_and_only_there(lite):
    """Sums over 30 vehicles suffice for limits; of fewer each is needed, whatever other days hold."""
    house, few = lite.fleet.warehouse, [(5, 100), (0, 300), (7, 50)]
    many = [(k % 4, 100 + k) for k in range(MANY_VEHICLES)]
    rows = pl.DataFrame(
        [
            {"manufacturer": "m", "operator": "o", "vehicle": f"{k:032x}", "received": day * 86400.0,
             "indicator": "ego_location_similarity", "n": n, "violated": violated, "mean": 0.5}
            for day, counts in enumerate((few, many))
            for k, (violated, n) in enumerate(counts)
        ]
    )  # fmt: skip
    with house.lock:
        house.take([("batch", 0.0)], rows)
    first, second = house.moments("operator", "o", 1)
    assert list(zip(first.each_violated, first.each_n, strict=True)) == few
    assert (second.each_violated, second.each_n) == ([], [])
    assert second.vn == sum(violated * n for violated, n in many)
    assert second.vehicles == MANY_VEHICLES
    assert house.moments("operator", "another", 1) == []


def test_a_kill_while_batches_are_summed_up_counts_nothing_twice(lite, monkeypatch):
    send_rows(lite, "red-1", "key-aaaa-1", indicator_row(0, 60))
    monkeypatch.setattr("skidpad.fleet.warehouse.TAKE", TAKE + "; SELECT error('killed')")
    with pytest.raises(duckdb.Error):
        compact(lite.fleet)
    monkeypatch.undo()
    (trend,) = lite.get("axle", "/api/v1/trends").json()["indicators"]
    assert trend["cycles"] == 600


def test_without_its_file_the_trends_are_made_again(tmp_path):
    with closing(make_world(tmp_path / "data", None)) as one:
        send_rows(one, "red-1", "key-aaaa-1", indicator_row(0, 60))
        before = one.get("axle", "/api/v1/trends").json()
    (tmp_path / "data" / "trends.duckdb").unlink()
    with closing(open_fleet(Places(data=tmp_path / "data"))) as fleet:
        assert compact(fleet) == 1
        who = one.accounts["axle"].principal
        assert [t.share for t in trends(fleet, who)] == [t["share"] for t in before["indicators"]]
        assert compact(fleet) == 0


def test_a_damaged_or_taken_file_of_trends_is_one_sentence(tmp_path):
    path = tmp_path / "trends.duckdb"
    path.write_bytes(b"nonsense" * 1000)
    with pytest.raises(FileError, match="delete it"):
        Warehouse(path).moments(None, "", 1)
    path.unlink()
    code = (
        f"import duckdb, sys; c = duckdb.connect({str(path)!r}); print('up', flush=True);"
        " sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout.readline() == b"up\n"
        with pytest.raises(FileError, match="another process"):
            Warehouse(path).moments(None, "", 1)
        other.stdin.close()
    assert Warehouse(path).moments(None, "", 1) == []


def test_a_batch_from_before_the_clock_went_back_is_found_at_the_next_start(tmp_path):
    with closing(make_world(tmp_path / "data", None)) as one:
        send_rows(one, "red-1", "key-aaaa-1", indicator_row(0, 60))
        assert compact(one.fleet) == 1
        one.clock.now -= 10 * 86400.0
        send_rows(one, "red-1", "key-aaaa-2", indicator_row(0, 60))
        assert compact(one.fleet) == 0
    with closing(open_fleet(Places(data=tmp_path / "data"))) as fleet:
        assert compact(fleet) == 1


def test_hazards_per_hour_count_the_drives_without_any(world):
    for k in range(3):
        summary = {"seconds": 1800.0, "cycles": 1, "context": {}}
        headers = {"X-Skidpad-Drive": f"{k:032x}"}
        body = gzip.compress(json.dumps(summary | {"k": k}).encode())
        assert world.send("red-1", body, f"drive-key-{k}", "drive", **headers).status_code == 200
    world.send(
        "red-1", packed(record(1), record(2)), "hazard-key", **{"X-Skidpad-Drive": f"{0:032x}"}
    )
    (rate,) = world.get("axle", "/api/v1/trends").json()["hazards"]
    assert (rate["events"], rate["hours"], rate["rate"]) == (2, 1.5, 2 / 1.5)
    assert rate["rules"] == "practical"
    assert rate["precision"] == {"true": 3, "false": 669, "low": 0.0, "high": 0.012}
    assert world.get("bolt", "/api/v1/trends").json()["hazards"] == []


def test_the_precision_of_alarms_is_that_of_the_published_table():
    page = (Path(__file__).parents[2] / "docs" / "channels-tables.md").read_text()
    table = page.split("<!-- table: scores -->")[1].split("<!-- end -->")[0]
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in table.split("\n")
        if "|" in line
    ]
    seen = 0
    for rules, hazard, found, false, _, share, *_ in rows[2:]:
        known = measured_precision(rules.replace(" ", "_"), hazard.replace(" ", "_"))
        if known is None or rules == "tracked":  # whose rules are newer than this table
            continue
        seen += 1
        assert (known.true, known.false) == (int(found), int(false))
        limits = [float(v) / 100.0 for v in re.findall(r"[\d.]+", share)[1:]]
        assert limits == pytest.approx([v for v in (known.low, known.high) if v is not None])
        assert 100.0 * known.share == pytest.approx(float(share.split(" ")[0]), abs=0.06)
    assert seen == 6


def test_the_precision_of_the_default_rules_is_that_of_their_newest_drives():
    told = json.loads((tables.RESULTS / "rules.json").read_text())
    rules = told["drives"]["natural"]["rules"]
    for hazard, names in tables.TRACKED.items():
        row = next(rules[name][hazard] for name in names if name in rules)
        known = measured_precision("tracked", hazard)
        assert (known.true, known.false) == (row["tp"], row["fp"])
    assert (
        tables.with_tracked_precision("kept\ntracked:\nold", Path("none")) == "kept\ntracked:\nold"
    )


def test_precision_says_limits_and_count():
    assert measured_precision("practical", "ego_tailgated").describe() == "2 % [1, 4] of 353 alarms"
    assert (
        measured_precision("as_printed", "inconsistent_localisation").describe()
        == "71 % of 7 alarms"
    )
    assert measured_precision("tracked", "unseen_by_a_channel") is None


@pytest.mark.req("C-174")
def test_an_authority_learns_places_and_no_vehicle(world):
    vehicles = ("red-1", "red-2", "blue-1")
    for k, vehicle in enumerate(vehicles):
        hazards = [record(10 * k + i, (110.0 + i, 20.0)) for i in range(2)]
        hazards.append(
            record(10 * k + 5, (9000.0, 0.0), HazardType.STUCK_VEHICLE, precipitation="80")
        )
        if k:  # a place of two vehicles only
            hazards.append(record(10 * k + 7, (5000.0, 5000.0)))
        assert world.send(vehicle, packed(*hazards), f"batch-key-{k}").status_code == 200
    answer = world.get("authority", "/api/v1/places")
    assert [(p["x"], p["y"], p["hazard"], p["weather"], p["count"]) for p in answer.json()] == [
        (150.0, 50.0, "ego_tailgating", "day, dry", 6),
        (9050.0, 50.0, "stuck_vehicle", "day, heavy rain", 3),
    ]
    page = world.get("authority", "/api/v1/places.html").text
    assert "sight distance" in page
    pdf = world.get("authority", "/api/v1/places.pdf").content
    assert pdf.startswith(b"%PDF")
    for name in vehicles:
        who = world.accounts[name].principal
        for secret in (who.vehicle, who.tenant, who.id, name):
            assert secret not in answer.text + page
    assert world.get("red operator", "/api/v1/places").json() == []  # two of one's own are too few
    assert world.get("researcher", "/api/v1/places").status_code == 403


@contextmanager
def crowd(tmp_path, n: int):
    one = make_world(tmp_path / "data", None)
    with one.fleet.engine.begin() as connection:
        for k in range(n):
            one.accounts[f"car-{k}"] = add_vehicle(connection, "red", "axle", f"car-{k}", NOW)
    with closing(one):
        yield one


@pytest.mark.req("C-177")
def test_nobody_is_found_again_in_the_research_export(tmp_path):
    """An attacker sees every export, knows all other vehicles' hazards, and asks about one of them."""
    with crowd(tmp_path, 9) as world:
        attack(world)


def attack(world: World) -> None:
    rng = np.random.default_rng(3)
    hour = int(NOW // HOUR)
    told: dict[tuple, set[str]] = {}
    seen: list[list[dict]] = []
    for step in range(12):
        world.clock.now = (hour + step) * HOUR + 10.0
        for k in range(9):
            for i in range(int(rng.integers(0, 3))):
                place = (float(rng.integers(0, 2)) * 500.0 + 250.0, 250.0)
                world.clock.now += 1.0
                one = record(1000 * step + 10 * k + i, place)
                body = packed(one)
                assert world.send(f"car-{k}", body, f"{step}-{k}-{i}-key").status_code == 200
                told.setdefault((hour + step, place[0]), set()).add(f"car-{k}")
        seen.append(export(world.fleet))
    assert seen[-1] == []  # nothing younger than a day
    for step in range(12):
        world.clock.now = (hour + step + 25) * HOUR + 1.0
        late = record(900_000 + step, (250.0, 250.0))
        assert world.send("car-0", packed(late), f"late-{step}-key").status_code == 200
        seen.append(export(world.fleet))
    final = seen[-1]
    assert final
    expected = {key for key, cars in told.items() if len(cars) >= K}
    assert {(r["hour"], r["x"]) for r in final} == expected
    for before, after in itertools.pairwise(seen):  # differences are whole hours
        assert after[: len(before)] == before
        new = after[len(before) :]
        assert not {r["hour"] for r in new} & {r["hour"] for r in before}
        for r in new:
            assert len(told[r["hour"], r["x"]]) >= K
            assert r["hazards_at_least"] % K == 0
    text = json.dumps(final)
    for account in world.accounts.values():
        assert account.principal.id not in text
        assert (account.principal.vehicle or "none") not in text
    assert set(final[0]) == {"hour", "map", "x", "y", "hazard", "weather", "hazards_at_least"}
    assert world.get("researcher", "/api/v1/research").json() == final


def test_an_export_with_one_vehicle_less_differs_by_whole_rows_only(tmp_path):
    """One car more or less between two steps of five vehicles' hazards: nothing tells them apart."""
    exports = []
    for n, without in ((7, None), (7, "car-6")):
        with crowd(tmp_path / f"{without}", n) as world:
            world.clock.now = NOW // HOUR * HOUR
            for k in range(n):
                if f"car-{k}" != without:
                    body = packed(record(k, (250.0, 250.0)))
                    assert world.send(f"car-{k}", body, f"car-key-{k}").status_code == 200
            world.clock.now += 26 * HOUR
            exports.append(export(world.fleet))
    assert exports[0] == exports[1]  # 7 and 6 hazards both read "at least 5"


MOST = 3  # hazards of the target in one hour, as the attacker supposes
LOOKS = (30, 42)  # h after which exports are taken besides the last one


def fitting(others: list[int], published: int | None) -> set[int]:
    """How many hazards of the target fit what was published; others: hazards of every other vehicle.

    By hand from what the page promises: a row from five vehicles on, hazards in whole fives.
    """

    def promised(own: int) -> int | None:
        vehicles, hazards = len(others) + (own > 0), sum(others) + own
        return hazards - hazards % 5 if vehicles >= 5 else None

    return {own for own in range(MOST + 1) if promised(own) == published}


def published(world: World) -> dict[int, int]:
    """Hazards by hour, as an export tells them."""
    return {r["hour"]: r["hazards_at_least"] for r in export(world.fleet)}


@pytest.mark.req("C-177")
def test_who_knows_all_vehicles_but_one_learns_at_a_step_only_and_nothing_from_a_second_export(
    tmp_path,
):
    """Full background knowledge: every record of the population but the target's own."""
    hours, rng = 48, np.random.default_rng(11)
    first = int(NOW // HOUR)
    known: dict[int, list[int]] = {}
    truth: dict[int, int] = {}
    exports: dict[int, dict[int, int]] = {}  # by the hour before which all are out
    with crowd(tmp_path, 10) as world:
        for hour in range(first, first + hours):
            world.clock.now = hour * HOUR + 10.0
            cars = rng.permutation(np.arange(1, 10))[: rng.integers(2, 10)].tolist()
            known[hour] = rng.integers(1, 3, len(cars)).tolist()
            truth[hour] = int(rng.integers(0, MOST + 1))
            for car, n in [*zip(cars, known[hour], strict=True), (0, truth[hour])]:
                if n:
                    number = 100 * (hour - first) + 10 * car
                    body = packed(*(record(number + i, (250.0, 250.0)) for i in range(n)))
                    answer = world.send(f"car-{car}", body, f"{hour}-{car}-key")
                    assert answer.status_code == 200
            if hour - first in LOOKS:
                exports[hour - 24] = published(world)
        world.clock.now = (first + hours + 25) * HOUR
        exports[first + hours] = published(world)
    alone = {hour: fitting(known[hour], exports[first + hours].get(hour)) for hour in truth}
    for hour, own in truth.items():
        out = [e for until, e in exports.items() if hour < until]
        together = set.intersection(*(fitting(known[hour], e.get(hour)) for e in out))
        assert own in together == alone[hour]  # a second export rules out no more
        vehicles, over = len(known[hour]), sum(known[hour]) % 5
        if vehicles < K - 1:
            assert together == set(range(MOST + 1))  # no row whatever the target did
        if vehicles >= K and over + MOST < 5:
            assert together == set(range(MOST + 1))
        if vehicles >= K and over + own < 5:
            assert {0, own} <= together  # as if it had not been there
    sure = [hour for hour, own in alone.items() if 0 not in own or own == {0}]
    steps = [hour for hour in sure if len(known[hour]) == K - 1 or sum(known[hour]) % 5 + MOST >= 5]
    assert sure == steps
    assert len(sure) == 18  # of 48, as docs/fleet.md tells


HALF = (
    indicator_row(0, 300),
    indicator_row(0, 0, indicator="object_location_similarity"),
)  # of 600 cycles each


def test_the_safety_case_says_what_is_known_and_how_sure(lite):
    assert {c["verdict"] for c in lite.get("axle", "/api/v1/safety-case").json()} == {"no evidence"}
    for k in range(2):
        send_rows(lite, f"red-{k + 1}", "key-aaaa-1", *HALF)
    found = {c["id"]: c for c in lite.get("axle", "/api/v1/safety-case").json()}
    assert (found["S1"]["verdict"], found["S1"]["share"]) == ("open", 0.5)
    assert found["S4"]["verdict"] == "open"  # two vehicles prove nothing
    assert found["S2"]["verdict"] == "no evidence"
    assert {c["id"] for c in lite.get("authority", "/api/v1/safety-case").json()} == set(found)


def test_eight_vehicles_that_nearly_agree_challenge_a_claim(tmp_path):
    with crowd(tmp_path, 8) as many:
        for k in range(8):
            rows = (
                indicator_row(0, 300 + k),
                indicator_row(0, 0, indicator="object_location_similarity"),
            )
            send_rows(many, f"car-{k}", f"car-key-{k}", *rows)
        found = {c["id"]: c for c in many.get("axle", "/api/v1/safety-case").json()}
        assert (found["S1"]["verdict"], found["S4"]["verdict"]) == ("challenged", "open")


def test_an_interval_over_vehicles_holds_the_share_that_they_were_drawn_with():
    """Shares of vehicles differ (beta), cycles are binomial."""
    rng = np.random.default_rng(7)
    for vehicles in (30, 100):
        held = 0
        for _ in range(DRAWS):
            n = rng.integers(300, 900, vehicles).astype(float)
            y = rng.binomial(n.astype(int), rng.beta(4.0, 12.0, vehicles)).astype(float)
            products = (float(y @ y), float(n @ y), float(n @ n))
            y3, y2n, yn2, n3 = (float(v.sum()) for v in (y**3, y * y * n, y * n * n, n**3))
            sums = (float(y.sum()), float(n.sum()))
            limits = linear_ratio_limits(vehicles, sums, products, (y3, y2n, yn2, n3))
            assert limits is not None
            held += limits.low <= 0.25 <= limits.high
        assert held / DRAWS >= 0.94 - 2.0 * (0.94 * 0.06 / DRAWS) ** 0.5, vehicles


def test_nothing_seen_in_few_vehicles_is_no_proof(tmp_path):
    with crowd(tmp_path, 7) as many:
        for k in range(7):
            send_rows(many, f"car-{k}", f"car-key-{k}", indicator_row(0, 0))
        (trend,) = many.get("axle", "/api/v1/trends").json()["indicators"]
    assert trend["interval"] == [0.0, pytest.approx(1.0 - 0.025 ** (1 / 7))]


def test_every_kind_of_hazard_has_advice_and_a_colour():
    assert set(ADVICE) == set(HazardType)
    assert set(KINDS) == {kind.value for kind in HazardType}
