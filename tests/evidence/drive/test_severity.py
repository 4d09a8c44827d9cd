"""Contacts are graded by the larger delta-v of the two, else by the closing speed (decision T-4)."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import ActorKind, RelocationReason, Supervision
from skidpad.evidence.drive.collisions import (
    CrashKind,
    contact_crashes,
    find_crashes,
    shown_crashes,
)
from skidpad.evidence.drive.metrics import run_metrics, weather_metrics
from skidpad.evidence.drive.prepared import prepare
from skidpad.evidence.drive.severity import Contact, Measure, Severity, graded_contacts
from skidpad.evidence.drive.story import tell_story
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.run.events import Relocation
from skidpad.recording.run.log import RunLog
from support.makelog import DT, actor_table, drive, pose
from support.makemap import straight_map

KMH = 3.6
TICK = 10
FREE, BRAKE, REALIGN = Supervision.NONE, Supervision.BRAKE, Supervision.REALIGN


def touch(v_closing: float = 3.0, actor: int = 1, tick: int = TICK) -> ContactEvent:
    return ContactEvent(tick, actor, "" if actor > 0 else "guardrail", 900.0, v_closing, 0.0, 0.0)


def struck(
    ego: float = 0.0,
    other: float = 0.0,
    *,
    kind: ActorKind = ActorKind.CAR,
    contact: ContactEvent | None = None,
    braking: float = 0.0,
) -> RunLog:
    """The ego loses `ego` km/h in the tick of the contact, the other car gains `other` km/h."""

    def rows(k: int) -> list[dict[str, float]]:
        hit = k >= TICK
        v = 20.0 - braking * k * DT - hit * ego / KMH
        return [
            {"x": 50.0 + 20.0 * k * DT, "vx": v},
            {"x": 80.0 + 5.0 * k * DT, "vx": 5.0 + hit * other / KMH},
        ]

    table = actor_table(2)
    table.kind[1] = kind
    contacts = [touch() if contact is None else contact]
    return drive(30, rows, contacts=contacts, table=table)


def graded(log: RunLog) -> Contact:
    (contact,) = graded_contacts(prepare(log, straight_map()))
    return contact


def metrics(log: RunLog) -> Metrics:
    return run_metrics(log, straight_map())


def classes(m: Metrics) -> tuple[int | None, ...]:
    return m.contacts_light, m.contacts_medium, m.contacts_heavy, m.serious_contacts


@pytest.mark.parametrize(("ego", "other"), [(4.0, 11.0), (11.0, 4.0)])
def test_the_larger_change_of_speed_of_the_two_decides(ego: float, other: float) -> None:
    c = graded(struck(ego, other))
    assert c.delta_v is not None
    assert c.delta_v * KMH == pytest.approx(11.0, abs=0.01)
    assert (c.severity, c.graded_by) == (Severity.MEDIUM, Measure.DELTA_V)


@pytest.mark.parametrize(
    ("dv", "severity"),
    [
        (4.9, Severity.LIGHT),
        (5.1, Severity.MEDIUM),
        (19.9, Severity.MEDIUM),
        (20.1, Severity.HEAVY),
    ],
)
def test_classes_end_at_5_and_20_km_per_hour(dv: float, severity: Severity) -> None:
    log = struck(dv)
    assert graded(log).severity is severity
    m = metrics(log)
    expected = [int(severity is s) for s in Severity]
    assert classes(m) == (*expected, expected[1] + expected[2])
    assert m.max_delta_v_kmh == pytest.approx(dv, abs=0.01)
    assert (m.contacts_by_closing_speed, m.contacts_static, m.contacts) == (0, 0, 1)


def test_braking_is_no_impact() -> None:
    c = graded(struck(3.0, braking=9.0))  # 1.6 km/h of braking in the tick
    assert c.delta_v is not None
    assert c.delta_v * KMH == pytest.approx(3.0, abs=0.05)


def test_an_impact_of_the_tick_before_is_not_carried_on() -> None:
    log = struck(30.0, contact=touch(tick=TICK + 1))
    c = graded(log)
    assert c.delta_v == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("kind", [ActorKind.PEDESTRIAN, ActorKind.BICYCLE, ActorKind.MOTORCYCLE])
def test_people_and_two_wheels_are_never_in_the_lowest_class(kind: ActorKind) -> None:
    log = struck(0.1, 0.1, kind=kind)
    assert graded(log).severity is Severity.MEDIUM
    m = metrics(log)
    assert classes(m) == (0, 1, 0, 1)
    assert m.contacts_vulnerable == 1
    assert metrics(struck(0.1, 0.1)).contacts_vulnerable == 0


@pytest.mark.parametrize("v", [4.0, 7.0])
def test_without_a_delta_v_the_closing_speed_decides_and_a_column_says_so(v: float) -> None:
    log = struck(30.0, contact=touch(v / KMH))
    log.present[TICK - 1, 1] = False
    c = graded(log)
    assert (c.delta_v, c.graded_by) == (None, Measure.CLOSING_SPEED)
    assert c.severity is (Severity.LIGHT if v < 5.0 else Severity.MEDIUM)
    m = metrics(log)
    assert (m.contacts_by_closing_speed, m.max_delta_v_kmh) == (1, None)


def test_a_vehicle_that_is_put_elsewhere_has_no_delta_v() -> None:
    log = struck(3.0, 50.0)
    log.actors.x[TICK:, 1] += 40.0
    assert graded(log).graded_by is Measure.CLOSING_SPEED


def test_a_contact_in_the_first_tick_has_no_delta_v() -> None:
    assert graded(struck(contact=touch(tick=0))).graded_by is Measure.CLOSING_SPEED


@pytest.mark.parametrize(
    ("contact", "kind"), [(touch(actor=-1), ActorKind.CAR), (touch(), ActorKind.PROP)]
)
def test_barriers_and_cones_are_counted_apart(contact: ContactEvent, kind: ActorKind) -> None:
    m = metrics(struck(40.0, kind=kind, contact=contact))
    assert classes(m) == (0, 0, 0, 0)
    assert (m.contacts_static, m.contacts, m.max_delta_v_kmh) == (1, 1, None)


def test_every_contact_is_counted_also_those_that_start_no_recovery() -> None:
    log = struck(12.0)
    more = (touch(0.2, tick=20), touch(0.2, actor=-1, tick=22))
    m = metrics(dataclasses.replace(log, events=(*log.events, *more)))
    assert (m.contacts_light, m.contacts_medium, m.contacts_heavy) == (0, 1, 0)
    assert (m.contacts_repeated, m.contacts_static, m.contacts) == (1, 1, 3)
    assert m.interventions == m.fatal_collisions == 0
    assert m.serious_contacts_per_100_km == pytest.approx(100.0 / m.distance_km)


def twice(pause: int, put_back: bool = False) -> RunLog:
    """Touched at tick 10 and again, the second time with 30 km/h."""

    def rows(k: int) -> list[dict[str, float]]:
        v = 20.0 - (k >= TICK) * 3.0 / KMH - (k >= TICK + pause) * 30.0 / KMH
        return [{"x": 50.0, "vx": v}, {"x": 54.0}]

    moved = Relocation(TICK + 5, RelocationReason.COLLISION, 0.0, pose(1.0), pose(2.0))
    return drive(
        TICK + pause + 2,
        rows,
        contacts=[touch(), touch(tick=TICK + pause)],
        extra=lambda log, k: log.relocated(moved) if put_back and k == moved.tick else None,
    )


def test_touching_the_same_vehicle_again_is_one_contact_as_hard_as_its_hardest_touch() -> None:
    m = metrics(twice(pause=160))
    assert (m.contacts_light, m.contacts_heavy, m.contacts_repeated, m.contacts) == (0, 1, 1, 2)
    assert m.max_delta_v_kmh == pytest.approx(30.0, abs=0.01)


@pytest.mark.parametrize(("pause", "put_back"), [(161, False), (160, True)])
def test_after_8_s_or_being_put_back_it_is_another_contact(pause: int, put_back: bool) -> None:
    m = metrics(twice(pause, put_back))
    assert (m.contacts_light, m.contacts_heavy, m.contacts_repeated) == (1, 1, 0)
    assert m.serious_contacts == 1


def reset(
    phase: Supervision, reason: RelocationReason, begin: int = 12, contact: int | None = None
) -> RunLog:
    moved = Relocation(begin + 4, reason, 0.0, pose(1.0), pose(2.0))
    return drive(
        40,
        lambda k: [{"x": 50.0 + k, "vx": 20.0}],
        supervision=lambda k: phase if begin <= k < begin + 8 else FREE,
        contacts=[] if contact is None else [touch(actor=-1, tick=contact)],
        extra=lambda log, k: log.relocated(moved) if k == begin + 4 else None,
    )


def test_the_time_to_the_first_intervention_ends_where_the_supervisor_begins() -> None:
    m = metrics(reset(BRAKE, RelocationReason.COLLISION, contact=11))
    assert m.first_intervention_s == m.undisturbed_s == pytest.approx(12 * DT)
    assert m.interventions == 1
    m = metrics(reset(REALIGN, RelocationReason.WRONG_WAY))
    assert m.first_intervention_s == m.undisturbed_s == pytest.approx(12 * DT)


@pytest.mark.parametrize("reason", [RelocationReason.STUCK, RelocationReason.ROAD_END])
def test_another_reset_ends_the_time_without_an_intervention(reason: RelocationReason) -> None:
    m = metrics(reset(REALIGN, reason))
    assert (m.first_intervention_s, m.interventions) == (None, 0)
    assert m.undisturbed_s == pytest.approx(12 * DT)


def test_a_run_without_resets_is_undisturbed_to_its_end() -> None:
    m = metrics(struck())
    assert (m.first_intervention_s, m.undisturbed_s) == (None, pytest.approx(30 * DT))


def test_the_weather_that_saw_the_first_reset_has_the_intervention() -> None:
    log = reset(BRAKE, RelocationReason.COLLISION, contact=11)
    weather = (np.arange(len(log)) >= 6).astype(np.int64)
    log = dataclasses.replace(log, weather=weather, weathers=("clear-noon", "rain-noon"))
    found = weather_metrics(log, straight_map())
    clear, rain = found["clear-noon"], found["rain-noon"]
    assert (clear.first_intervention_s, clear.undisturbed_s) == (None, pytest.approx(6 * DT))
    assert rain.first_intervention_s == rain.undisturbed_s == pytest.approx(6 * DT)


def two_at_once(car_kmh: float, rail_kmh: float = 0.0, kind: ActorKind = ActorKind.CAR) -> RunLog:
    """A guardrail with the larger impulse at tick 10, a road user two ticks later, then a recovery.

    rail_kmh: what the ego loses at the guardrail; car_kmh: what the road user gains.
    """

    def rows(k: int) -> list[dict[str, float]]:
        return [
            {"x": 50.0, "vx": 20.0 - (k >= TICK) * rail_kmh / KMH},
            {"x": 54.0, "vx": (k >= TICK + 2) * car_kmh / KMH},
        ]

    rail = ContactEvent(TICK, -1, "guardrail", 9000.0, 1.0, 0.0, 0.0)
    table = actor_table(2)
    table.kind[1] = kind
    return drive(
        40,
        rows,
        contacts=[rail, touch(tick=TICK + 2)],
        table=table,
        supervision=lambda k: BRAKE if TICK + 3 <= k < TICK + 10 else FREE,
    )


@pytest.mark.req("T-4")
@pytest.mark.parametrize(
    ("log", "kind", "severity"),
    [
        (two_at_once(30.0), CrashKind.VEHICLE, Severity.HEAVY),
        (two_at_once(3.0, rail_kmh=30.0), CrashKind.STATIC, Severity.HEAVY),
        (two_at_once(1.0, 30.0, ActorKind.PEDESTRIAN), CrashKind.VEHICLE, Severity.MEDIUM),
    ],
    ids=["harder car", "harder guardrail", "a person"],
)
def test_a_card_shows_the_contact_that_decides_the_class_and_counts_stay(
    log: RunLog, kind: CrashKind, severity: Severity
) -> None:
    found = prepare(log, straight_map())
    (shown,), (counted,) = shown_crashes(found), find_crashes(found)
    assert (shown.kind, shown.contact and shown.contact.severity) == (kind, severity)
    others = [c for _, c in tell_story(found, shown).others]
    assert sorted([*others, shown.contact], key=lambda c: c.tick) == list(graded_contacts(found))
    assert counted.kind is CrashKind.STATIC, "the larger impulse is counted, as published"
    m = metrics(log)
    assert (m.interventions, m.collisions_static, m.collisions_vehicle) == (1, 1, 0)


@pytest.mark.req("T-4")
def test_without_a_supervisor_a_body_touched_twice_is_shown_by_its_harder_touch() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        gained = (k >= TICK) * 3.0 + (k >= TICK + 5) * 30.0  # km/h: a brush, then a crash
        return [{"x": 50.0, "vx": 20.0}, {"x": 54.0, "vx": gained / KMH}]

    rail = ContactEvent(TICK + 2, -1, "guardrail", 9000.0, 1.0, 0.0, 0.0)
    touches = [touch(tick=TICK + k) for k in (0, 5, 8)]
    log = drive(40, rows, contacts=[touches[0], rail, *touches[1:]], table=actor_table(2))
    found = contact_crashes(prepare(log, straight_map()))
    assert [(c.tick, c.kind) for c in found] == [
        (TICK + 2, CrashKind.STATIC),
        (TICK + 5, CrashKind.VEHICLE),
    ]
    assert found[1].contact is not None
    assert found[1].contact.severity is Severity.HEAVY
