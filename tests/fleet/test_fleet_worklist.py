"""Recurring hazards as a ranked list: by alarms times precision, with period and trend."""

from __future__ import annotations

import gzip
import json

import pytest
from msgspec.structs import replace

from skidpad.cli.fleet.links import open_maps, place_finder
from skidpad.core.vocabulary import HazardType
from skidpad.fleet.insight.worklist import rank_work
from skidpad.fleet.patterns import analysis
from skidpad.fleet.patterns.analysis import name_subjects, newest_clusters
from skidpad.fleet.site.work import work_text, work_title
from support.fleet_world import packed, record


def test_many_alarms_that_are_rarely_true_stand_below_few_that_often_are(world):
    world.clock.now = 20_000 * 86_400.0
    close = [record(k) for k in range(6)]
    lost = [record(10 + k, hazard=HazardType.INCONSISTENT_LOCALISATION) for k in range(2)]
    ids = world.send("red-1", packed(*close[:4], *lost), "batch-key-1").json()["ids"]
    world.clock.now += 2 * 86_400.0
    ids += world.send("red-1", packed(*close[4:]), "batch-key-2").json()["ids"]
    clusters = [
        {"id": "a", "type": "ego_tailgating", "members": ids[:4] + ids[6:]},
        {"id": "b", "type": "inconsistent_localisation", "members": ids[4:6]},
    ]
    who = world.accounts["red operator"].principal
    with world.fleet.engine.connect() as connection:
        first, second = rank_work(connection, who, clusters)
        foreign = world.accounts["blue operator"].principal
        assert rank_work(connection, foreign, clusters) == []
    assert (first.cluster["id"], second.cluster["id"]) == ("b", "a")
    assert first.likely_true == pytest.approx(2 * 102 / 195)  # the rules "practical"
    assert second.likely_true == pytest.approx(6 * 3 / 672)
    assert (second.earlier, second.later) == (4, 2)
    assert "2024-10-04 to 2024-10-06, 4 in the first half, 2 in the second" in work_text(second)
    assert work_text(first).startswith("about 1.0 likely true (52 % [45, 59] of 195 alarms)")


def drive(world, number: int, release: str, *records) -> None:
    """Red-1 drives with a release, and sends what it drove and the hazards that it met."""
    name = {"X-Skidpad-Drive": f"{number:032x}"}
    summary = {"seconds": 60.0, "cycles": 600, "context": {}, "release": release}
    body = gzip.compress(json.dumps(summary).encode())
    assert world.send("red-1", body, f"drive-{number:06d}", "drive", **name).status_code == 200
    if records:
        sent = world.send("red-1", packed(*records), f"hazard-{number:06d}", **name)
        assert sent.status_code == 200, sent.text


def listed(world, **filters):
    world.clock.now += 1.0
    assert world.post("axle", "/api/v1/analyses").status_code == 200
    return world.get("axle", "/api/v1/recurring", **filters).json()


@pytest.mark.req("C-173", "C-193")
def test_a_hazard_appears_is_fixed_by_a_release_and_reopened_when_it_recurs(world):
    day = 86_400.0
    world.clock.now = start = 20_000 * day
    # it appears with the first release
    for k in range(4):
        drive(world, k, "1.0", record(k))
        world.clock.now += day
    (one,) = listed(world)
    assert (one["state"], one["alarms"], one["owner"]) == ("new", 4, "")
    place = f"/api/v1/recurring/{one['subject']}"
    # only who has the right may triage
    fixed = {"state": "fixed", "owner": "Ada", "release": "1.1", "note": "later braking"}
    for name, status in (("red teleoperator", 403), ("red-1", 403), ("bolt", 404), (None, 401)):
        assert world.post(name, f"{place}/state", json=fixed).status_code == status, name
    assert world.post("axle", f"{place}/state", json={"state": "open", "owner": "Ada"}).is_success
    world.clock.now += 1.0
    assert listed(world, state="open", owner="Ada")[0]["subject"] == one["subject"]
    assert listed(world, state="new") == []
    # what cannot be said is refused with one sentence
    for wrong in ({"state": "fixed"}, {"state": "reopened"}, {"state": "open"}, {"state": "gone"}):
        answer = world.post("axle", f"{place}/state", json=wrong)
        assert answer.status_code == 422
        assert "state" in answer.json()["detail"]
    # a release fixes it: drives with it stay quiet, one with the old release does not reopen it
    assert world.post("axle", f"{place}/state", json=fixed).is_success
    world.clock.now += day
    drive(world, 10, "1.1")
    drive(world, 11, "1.0", record(4))
    world.clock.now += 20 * day
    drive(world, 12, "1.1")
    (one,) = listed(world)
    assert (one["state"], one["release"], one["alarms"]) == ("fixed", "1.1", 5)
    assert one["earlier"] > one["later"], "it falls in the trend"
    assert listed(world, release="1.1") == []
    assert listed(world, since=world.clock.now - day) == []
    # it recurs with the release that should have fixed it
    drive(world, 13, "1.1", record(5))
    (one,) = listed(world)
    assert (one["state"], one["owner"], one["alarms"]) == ("reopened", "Ada", 6)
    assert [w["subject"] for w in listed(world, release="1.1", weather="day, dry")] == [
        one["subject"]
    ]
    # every change is an event; looking again adds none
    listed(world)
    events = world.get("axle", f"{place}/events").json()
    assert [e["state"] for e in events] == ["open", "fixed", "reopened"]
    assert [e["actor"] for e in events[:2]] == [world.accounts["axle"].principal.id] * 2
    assert events[1]["note"] == "later braking"
    assert start < events[0]["at"] < events[1]["at"] < events[2]["at"]
    # the operator of the same vehicle triages for itself
    assert world.post("red operator", "/api/v1/analyses").is_success
    (theirs,) = world.get("red operator", "/api/v1/recurring").json()
    assert (theirs["subject"], theirs["state"], theirs["owner"]) == (one["subject"], "new", "")
    assert world.get("red operator", f"{place}/events").json() == []
    # one click to the scenario
    scenario = world.post("axle", f"/api/v1/hazards/{one['representative']}/scenario")
    assert scenario.headers["content-type"] == "application/zip"


def test_a_fixed_hazard_that_recurs_with_a_later_release_is_reopened(world):
    world.clock.now = 20_000 * 86_400.0
    for k in range(3):
        drive(world, k, "1.0", record(k))
    (one,) = listed(world)
    fixed = {"state": "fixed", "owner": "Ada", "release": "1.1"}
    assert world.post("axle", f"/api/v1/recurring/{one['subject']}/state", json=fixed).is_success
    world.clock.now += 100.0
    drive(world, 10, "1.1")
    drive(world, 11, "1.0", record(4))
    assert listed(world)[0]["state"] == "fixed", "a release without the fix says nothing"
    drive(world, 12, "1.2", record(5))
    (one,) = listed(world)
    assert (one["state"], one["release"]) == ("reopened", "1.1")


def test_risk_times_precision_ranks_and_an_alarm_without_a_score_counts_in_full(world):
    def scored(number, score):
        return replace(record(number), extremes={"safety_score": score})

    ids = world.send("red-1", packed(scored(1, 0.9), scored(2, 0.9), scored(3, 0.1), record(4)),
                     "batch-key-1").json()["ids"]  # fmt: skip
    clusters = [
        {"id": "a", "type": "ego_tailgating", "map": "town", "members": ids[:2]},
        {"id": "b", "type": "ego_tailgating", "map": "town", "members": ids[2:3]},
        {"id": "c", "type": "ego_tailgating", "map": "town", "members": ids[3:]},
    ]
    who = world.accounts["red operator"].principal
    with world.fleet.engine.connect() as connection:
        ranked = rank_work(connection, who, clusters)
    assert [one.cluster["id"] for one in ranked] == ["c", "b", "a"]
    assert ranked[1].mean_risk == pytest.approx(0.9)
    assert ranked[1].weight == pytest.approx(0.9 * ranked[1].precision.share)
    assert ranked[0].mean_risk is None
    assert ranked[2].weight == pytest.approx(0.2 * ranked[2].precision.share)


@pytest.mark.req("C-193")
def test_a_state_outlives_the_first_alarm_of_its_hazard(world, monkeypatch):
    """What an analysis no longer looks at takes no state with it."""
    monkeypatch.setattr(analysis, "HAZARDS_MAX", 4)
    for k in range(4):
        drive(world, k, "1.0", record(k))
        world.clock.now += 10.0
    (one,) = listed(world)
    state = {"state": "open", "owner": "Ada"}
    assert world.post("axle", f"/api/v1/recurring/{one['subject']}/state", json=state).is_success
    for k in range(4, 10):  # two at a time: each analysis still knows two of the ones before
        drive(world, k, "1.0", record(k))
        world.clock.now += 10.0
        if k % 2:
            (one,) = listed(world)
            assert (one["state"], one["owner"], one["alarms"]) == ("open", "Ada", 4)
    events = world.get("axle", f"/api/v1/recurring/{one['subject']}/events").json()
    assert [e["state"] for e in events] == ["open"]
    # who looks with other rights has states of its own
    world.clock.now += 1.0
    assert world.post("red operator", "/api/v1/analyses").is_success
    (theirs,) = world.get("red operator", "/api/v1/recurring").json()
    assert theirs["state"] == "new"


def test_a_group_is_what_most_of_its_alarms_belonged_to():
    known = dict.fromkeys("abcd", "a") | dict.fromkeys("xy", "x")
    assert name_subjects([["c", "d", "e"]], known) == ["a"]
    assert name_subjects([["a", "x", "y"]], known) == ["x"]
    assert name_subjects([["p", "q"]], known) == ["p"]
    # where one becomes two, the first keeps the subject and the other gets a new one
    assert name_subjects([["b", "c"], ["d", "e"]], known) == ["a", "d"]
    assert name_subjects([["b", "c"], ["a", "d"]], known) == ["a", "d"]


def test_the_work_list_is_filtered_by_severity_and_by_the_kind_of_road(world):
    def scored(number, score, **words):
        return replace(record(number, **words), extremes={"safety_score": score})

    world.fleet.locate = place_finder(open_maps(None))
    street, off = (121.0, 4.0), (400.0, 400.0)
    sent = [*(scored(k, 0.3, place=street) for k in range(3)),
            *(scored(10 + k, 0.7, place=off) for k in range(3)),
            *(record(20 + k, place=street, map="nowhere") for k in range(3))]  # fmt: skip
    drive(world, 1, "1.0", *sent)
    found = {w["severity"]: w for w in listed(world)}
    assert set(found) == {"severe", "notable", "not scored"}
    assert found["severe"]["place"] == "road 2, 61 m from junction 9003"
    assert found["severe"]["road"] == "street up to 60 km/h"
    for other in ("notable", "not scored"):
        assert (found[other]["place"], found[other]["road"]) == (None, None)
    for filters, wanted in (
        ({"severity": "notable"}, ["notable"]),
        ({"severity": "slight"}, []),
        ({"road": "street up to 60 km/h"}, ["severe"]),
        ({"road": "junction"}, []),
    ):
        assert [w["severity"] for w in listed(world, **filters)] == wanted, filters
    assert world.get("axle", "/api/v1/recurring", severity="dire").status_code == 422
    with world.fleet.engine.connect() as connection:
        who = world.accounts["axle"].principal
        work = rank_work(
            connection, who, newest_clusters(connection, who), locate=world.fleet.locate
        )
    titles = {one.severity.value: work_title(one) for one in work}
    assert titles["severe"] == (
        "3 x ego tailgating, 1 vehicle, town, road 2, 61 m from junction 9003"
    )
    assert titles["notable"].endswith("town, x 400 m, y 400 m")
    assert work_text(next(w for w in work if w.severity.value == "severe")).startswith(
        "severe, mean risk 0.70; "
    )
