"""Crash cards: the cause in one sentence, one timeline in order of time, no crash twice."""

from __future__ import annotations

import base64
import dataclasses
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Picture

from skidpad.core.states import ContactEvent, StackReport
from skidpad.core.vocabulary import ActorKind, DetectionStatus, Supervision, Tier
from skidpad.evidence.drive.collisions import Crash, CrashKind, Striker, find_crashes
from skidpad.evidence.drive.prepared import prepare
from skidpad.evidence.drive.severity import Contact
from skidpad.evidence.drive.story import Arrival, Moment, Sighting, Story
from skidpad.recording.campaign.ledger import Entry, Ledger
from skidpad.recording.campaign.matrix import MATRIX, MatrixEntry, Metrics, RunKey
from skidpad.recording.campaign.results import Timing
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import write_log
from skidpad.recording.run.motion import motion_hash
from skidpad.report.crashes.cards import contact_text, crash_card, facts, severity, tags, timeline
from skidpad.report.crashes.causes import write_cause
from skidpad.report.crashes.page import contact_cards, find_contacts, write_crashes
from skidpad.report.elements.page import Cards, Montage, Page, Section, render
from skidpad.report.matrix.crashes import crash_sections, found_crashes, montages, worst_of_each
from skidpad.report.matrix.data import load_matrix
from skidpad.roads.bundled import load_map
from support.makelog import drive

KMH = 3.6


def contact(
    delta_v: float | None = 30.0, kind: ActorKind | None = ActorKind.CAR, v: float = 40.0
) -> Contact:
    actor, other = (-1, "guardrail") if kind is None else (17, "traffic_17")
    return Contact(100, actor, other, kind, None if delta_v is None else delta_v / KMH, v / KMH)


def a_crash(**changes: object) -> Crash:
    """The ego at 90 km/h into traffic_17, which drives 50."""
    values = {
        "tick": 100, "t": 5.0, "kind": CrashKind.VEHICLE, "weather": "clear-noon",
        "other": "traffic_17", "actor": 17, "striker": Striker.EGO, "rear_ended": False, "sideways": False,
        "bend_exit": False, "follows": False, "v_ego": 90.0 / KMH, "v_other": 50.0 / KMH,
        "v_closing": 40.0 / KMH, "impulse": 9000.0, "contact": contact(), "x": 0.0, "y": 0.0,
        "lane_offset": 0.1, "bend_radius": None, "mu": 0.8, "brake_max": 0.0, "unseen": 0.0,
        "lead_since": 0.1,
    }  # fmt: skip
    return Crash(**(values | changes))  # type: ignore[arg-type]


def off_lane(kind: CrashKind = CrashKind.STATIC, **changes: object) -> Crash:
    """Into the guardrail at 65 km/h, nobody else near."""
    values = {
        "kind": kind, "other": "guardrail" if kind is CrashKind.STATIC else "", "actor": None,
        "striker": None, "v_other": None, "v_ego": 65.0 / KMH, "v_closing": 1.0 / KMH,
        "contact": contact(1.0, None, 1.0), "lane_offset": 1.9, "bend_radius": 84.0,
        "lead_since": None,
    }  # fmt: skip
    return a_crash(**(values | changes))


SEEN = Sighting(3.0, DetectionStatus.FUSION_DETECT, Tier.ACC_HOLD, 31.0, 30.0, "traffic_17", False)
PHANTOM = Sighting(0.2, DetectionStatus.RADAR_ACTIVE, Tier.HARD_STOP, 11.9, 64.8, "traffic_3", True)


def a_story(crash: Crash | None = None, **changes: object) -> Story:
    values = {
        "crash": crash or a_crash(), "arrival": None, "arrived": None, "first": None, "news": (),
        "worst": None, "braked": None, "slowed": None, "pushed_by": None, "pusher": "",
        "others": (), "put_back": None,
    }  # fmt: skip
    return Story(**(values | changes))  # type: ignore[arg-type]


CAME = Moment(0.1, 3.7)


@pytest.mark.parametrize(
    ("story", "sentence"),
    [
        (
            a_story(arrival=Arrival.CUT_IN, arrived=CAME, worst=PHANTOM),
            ("traffic_17 came into the lane of the ego 3.7 m ahead, 0.1 s before; the radar had "
            "reported 11.9 m, 0.2 s before, the true gap was 64.8 m to traffic_3; the ego did not "
            "brake and drove at 90 km/h."),
        ),
        (
            a_story(arrival=Arrival.UNCOVERED, arrived=Moment(2.0, 20.0), first=SEEN),
            ("The vehicle ahead left the lane 2.0 s before and uncovered traffic_17 20.0 m ahead; "
            "the ego did not brake and drove at 90 km/h."),
        ),
        (
            a_story(arrival=Arrival.EGO_CAME, arrived=Moment(2.0, 20.0)),
            ("The ego changed into the lane of traffic_17 20.0 m behind it, 2.0 s before; the stack "
            "never reported it; the ego did not brake and drove at 90 km/h."),
        ),
        (
            a_story(arrival=Arrival.EGO_PUT, arrived=Moment(7.0, 12.0), first=SEEN),
            ("The ego had been put on the lane 12.0 m behind traffic_17, 7.0 s before; it was first "
            "reported 3.0 s before, 30.0 m away; the ego did not brake and drove at 90 km/h."),
        ),
        (
            a_story(
                arrival=Arrival.DRIVEN_UP, arrived=Moment(9.0, 75.0),
                first=dataclasses.replace(SEEN, before=8.5), braked=Moment(2.0, 30.0, 100.0 / KMH),
            ),
            ("traffic_17 drove at 50 km/h ahead; the ego braked 2.0 s before, from 100 km/h, 30.0 m "
            "away; to match its speed by full braking on a friction of 0.80 takes 12 m of gap, less than "
            "that."),
        ),
        (
            a_story(
                a_crash(mu=0.2), arrival=Arrival.DRIVEN_UP, arrived=Moment(9.0, 75.0),
                first=dataclasses.replace(SEEN, before=8.5), braked=Moment(2.0, 30.0, 100.0 / KMH),
                slowed=Moment(4.0, 60.0, 110.0 / KMH),
            ),
            ("traffic_17 ahead slowed from 110 km/h to 50 km/h within 4.0 s; the ego braked 2.0 s "
            "before, from 100 km/h, 30.0 m away; to match its speed by full braking on a friction of 0.20 "
            "takes 49 m of gap, more than that."),
        ),
        (
            a_story(
                a_crash(mu=0.5, v_other=0.0), arrival=Arrival.DRIVEN_UP, arrived=Moment(9.0, 75.0),
                first=dataclasses.replace(SEEN, before=8.5), braked=Moment(2.0, 30.0, 20.0),
            ),
            ("traffic_17 stood ahead; the ego braked 2.0 s before, from 72 km/h, 30.0 m away; to stop by "
            "full braking on a friction of 0.50 takes 41 m, more than that."),
        ),
        (
            a_story(a_crash(v_other=0.0)),
            ("traffic_17 crossed the way of the ego and was never ahead in its lane; the stack never "
            "reported it; the ego did not brake and drove at 90 km/h."),
        ),
        (
            a_story(
                a_crash(striker=Striker.OTHER, rear_ended=True, v_ego=20.0 / KMH), worst=PHANTOM,
                braked=Moment(1.0, np.nan, 80.0 / KMH),
            ),
            ("traffic_17 drove into the ego from behind, 40 km/h faster, while it braked from 80 "
            "km/h; the radar had reported 11.9 m, 0.2 s before, the true gap was 64.8 m to "
            "traffic_3."),
        ),
        (
            a_story(a_crash(sideways=True, lane_offset=1.34), worst=PHANTOM),
            ("The ego at 90 km/h moved sideways into traffic_17 at 50 km/h beside it; the ego was 1.3 "
            "m left of the middle of its lane."),
        ),
        (
            a_story(a_crash(sideways=True, striker=Striker.OTHER)),
            "traffic_17 at 50 km/h moved sideways into the ego at 90 km/h beside it.",
        ),
        (
            a_story(a_crash(striker=Striker.OTHER, v_ego=0.0, v_closing=None)),
            "traffic_17 drove into the ego, while it stood.",
        ),
        (
            a_story(off_lane()),
            ("The ego drove at 65 km/h and hit the guardrail, 1.9 m left of the middle of its lane; "
            "the bend of 84 m takes 3.9 m/s² at that speed, less than the 7.8 m/s² that the tyres "
            "hold, so the bend alone does not explain it."),
        ),
        (
            a_story(
                off_lane(
                    v_ego=149.0 / KMH, v_closing=106.0 / KMH, contact=contact(163.0, None, 106.0),
                ),
                braked=Moment(0.05, np.nan, 149.0 / KMH),
            ),
            ("The ego drove at 149 km/h and hit the guardrail, 1.9 m left of the middle of its lane; "
            "it was stopped and thrown back, a change of velocity of 163 km/h; the bend of 84 m takes "
            "20.4 m/s² at that speed, more than the 7.8 m/s² that the tyres hold."),
        ),
        (
            a_story(
                off_lane(CrashKind.OFF_ROAD, mu=0.3, lane_offset=-4.0),
                pushed_by=Moment(1.2, np.nan), pusher="traffic_2",
            ),
            ("The ego drove at 65 km/h and left the road, 4.0 m right of the middle of its lane; the "
            "bend of 84 m takes 3.9 m/s² at that speed, more than the 2.9 m/s² that the tyres hold; "
            "it had touched traffic_2 1.2 s before."),
        ),
        (
            a_story(off_lane(CrashKind.ROLL_OVER, mu=0.3, lane_offset=0.0, contact=None)),
            ("The ego drove at 65 km/h and rolled over; the bend of 84 m takes 3.9 m/s² at that speed, "
            "more than the 2.9 m/s² that the tyres hold."),
        ),
        (
            a_story(off_lane(CrashKind.WRONG_WAY)),
            "The ego faced against the direction of its lane at 65 km/h.",
        ),
    ],
)  # fmt: skip
def test_the_cause_is_one_sentence_from_the_log(story: Story, sentence: str) -> None:
    assert write_cause(story) == sentence


def test_a_reported_distance_without_anything_ahead_is_said_so() -> None:
    worst = dataclasses.replace(PHANTOM, gap=None, to="")
    assert "the radar had reported 11.9 m, 0.2 s before, with nothing ahead in the lane" in (
        write_cause(a_story(arrival=Arrival.CUT_IN, arrived=CAME, worst=worst))
    )


def test_one_timeline_in_order_of_time_with_mismatches_marked() -> None:
    story = a_story(
        arrival=Arrival.CUT_IN, arrived=CAME, first=SEEN, news=(SEEN, PHANTOM), worst=PHANTOM,
        braked=Moment(0.5, 20.0, 25.0), slowed=Moment(4.0, 40.0, 30.0),
        others=((0.7, contact(12.0, None)),), put_back=2.5,
    )  # fmt: skip
    events = timeline(story)
    assert [(e.time, e.is_wrong) for e in events] == [
        ("-4.00 s", False),
        ("-3.00 s", False),
        ("-0.50 s", False),
        ("-0.20 s", True),
        ("-0.10 s", False),
        ("0.00 s", False),
        ("+0.70 s", False),
        ("+2.50 s", False),
    ]
    assert [e.text for e in events] == [
        "traffic_17 begins to slow, from 108 km/h, 40.0 m",
        (
            "cameras see a vehicle, measured 31.0 m, true gap 30.0 m, following, first report of "
            "traffic_17"
        ),
        "the ego begins to brake, from 90 km/h, 20.0 m",
        "radar alone, measured 11.9 m, true gap 64.8 m to traffic_3, hard stop",
        "traffic_17 is ahead in the lane, 3.7 m",
        "Ego into traffic_17, closing at 40 km/h",
        "contact with the guardrail, delta-v 12 km/h, 5 to 20 km/h",
        "the ego is put back on its lane",
    ]


@pytest.mark.parametrize(
    "kind", [CrashKind.STATIC, CrashKind.OFF_ROAD, CrashKind.WRONG_WAY, CrashKind.ROLL_OVER]
)
def test_what_stands_has_no_speed_and_nothing_is_unknown(kind: CrashKind) -> None:
    none = {} if kind is CrashKind.STATIC else {"contact": None, "v_closing": None}
    story = a_story(off_lane(kind, **none))
    said = [write_cause(story), *(e.text for e in timeline(story)), *tags(story)]
    assert "unknown" not in " ".join(said + [f"{n} {v}" for n, v in facts(story.crash)])
    assert "other" not in dict(facts(story.crash))


def test_a_standing_vehicle_has_its_speed() -> None:
    found = dict(facts(a_crash(v_other=0.0, v_closing=0.0)))
    assert (found["other"], found["closing"]) == ("0 km/h", "0 km/h")
    assert found["delta-v, larger of the two"] == "30 km/h"


def test_speeds_at_a_guardrail_say_what_they_are_and_agree() -> None:
    end = off_lane(v_ego=149.0 / KMH, v_closing=106.0 / KMH, contact=contact(163.0, None, 106.0))
    assert facts(end)[:3] == [
        ("ego", "149 km/h"),
        ("perpendicular to the guardrail", "106 km/h"),
        ("delta-v, thrown back", "163 km/h"),
    ]
    assert facts(off_lane())[:3] == [
        ("ego", "65 km/h"),
        ("perpendicular to the guardrail", "1 km/h"),
        ("delta-v", "1 km/h"),
    ]


def test_tags_name_the_class_and_what_it_is_graded_by() -> None:
    story = a_story(arrival=Arrival.CUT_IN, arrived=CAME)
    assert tags(story) == ["vehicle", "delta-v above 20 km/h", "cut-in"]
    person = contact(None, ActorKind.PEDESTRIAN, 3.0)
    assert tags(a_story(a_crash(contact=person))) == [
        "vehicle",
        "closing speed 5 to 20 km/h",
        "person or two wheels",
    ]
    assert contact_text(person) == "contact with traffic_17, closing speed 3 km/h, 5 to 20 km/h"


def test_a_person_comes_before_a_hard_crash_and_that_before_a_graze_at_speed() -> None:
    person = a_crash(contact=contact(3.0, ActorKind.BICYCLE))
    hard = a_crash(v_ego=5.0)
    graze = off_lane(v_ego=40.0)
    gone = off_lane(CrashKind.OFF_ROAD, contact=None, v_ego=50.0)
    assert sorted([gone, hard, graze, person], key=severity, reverse=True) == [
        person,
        hard,
        graze,
        gone,
    ]


def a_log(seed: float = 0.0) -> RunLog:
    """The ego runs into a car that stands."""

    def rows(k: int) -> list[dict[str, float]]:
        hit = k >= 40
        x = 50.0 + seed + (40 if hit else k)
        return [{"x": x, "vx": 0.0 if hit else 20.0}, {"x": 94.0 + seed}]

    log = drive(
        60,
        rows,
        report=lambda _k: StackReport(status=DetectionStatus.NO_TARGET, tier=Tier.CRUISE),
        supervision=lambda k: Supervision.BRAKE if k > 40 else Supervision.NONE,
        contacts=[ContactEvent(40, 1, "", 9000.0, 20.0, 0.0, 0.0)],
    )
    return dataclasses.replace(log, header=dataclasses.replace(log.header, map="figure8"))


def test_the_card_begins_with_the_cause(tmp_path: Path) -> None:
    log, road_map = a_log(), load_map("figure8")
    found = prepare(log, road_map)
    (crash,) = find_crashes(found)
    assert crash.contact is not None
    assert crash.contact.delta_v == pytest.approx(20.0)
    card = crash_card(crash, found, road_map, tmp_path / "run")
    assert card.cause.startswith("car 1 stood ahead; the stack never reported it; ")
    assert card.events[-1].text == card.title == "Ego into car 1, closing at 72 km/h"


def a_campaign(folder: Path, logs: dict[tuple[str, int], RunLog]) -> None:
    """A campaign of configuration 3 with these logs, by weather and seed."""
    rows = []
    with Ledger(folder, MatrixEntry, {"command": "adas"}) as ledger:
        for (weather, seed), log in logs.items():
            run = f"3_{weather}-{seed:03d}"
            digest = write_log(folder / "runs" / run, log)
            key = RunKey(
                config="3", weather=weather, precipitation_kind="clear", time_of_day="", seed=seed,
                profile="recommended", map="figure8", sensors="objects", grip="physical",
                range="physical", outcome="completed", log_hash=digest,
                motion_hash=motion_hash(log),
            )  # fmt: skip
            metrics = Metrics(fatal_collisions=1, max_impact_kmh=72.0, distance_km=1.0)
            ledger.append(
                Entry(run=run, key=key, metrics=metrics, timing=Timing(wall_s=1.0), fingerprint="f")
            )
            rows.append((key, metrics))
    MATRIX.write(folder, rows)


def seen_otherwise(log: RunLog) -> RunLog:
    log.report.hsv[:] = 1.0
    return log


def test_no_crash_stands_twice_where_drives_moved_alike(tmp_path: Path) -> None:
    logs = {
        ("clear-sunrise", 1): a_log(),
        ("clear-noon", 1): seen_otherwise(a_log()),
        ("clear-night", 1): seen_otherwise(a_log(seed=3.0)),
        ("clear-night", 2): a_log(),
    }
    a_campaign(tmp_path, logs)
    matrix = load_matrix(tmp_path)
    found = found_crashes(matrix)
    runs = {cell: sorted(item[3].name for item in items) for cell, items in found.items()}
    assert runs == {
        ("3", "clear-sunrise"): ["3_clear-sunrise-001"],
        ("3", "clear-night"): ["3_clear-night-001", "3_clear-night-002"],
    }
    blocks = [*worst_of_each(found), *crash_sections(matrix, found)]
    cards = [card for b in blocks if isinstance(b, Cards) for card in b.cards]
    assert len(cards) == len({card.subtitle for card in cards}) == 3
    assert cards[0].title.startswith("3 · + traffic-light assist, resume: Ego into car 1")


def test_all_crash_pictures_of_a_configuration_stand_side_by_side(tmp_path: Path) -> None:
    a_campaign(tmp_path, {("clear-noon", 1): a_log(), ("rain-noon", 2): a_log(seed=3.0)})
    for run in ("3_clear-noon-001", "3_rain-noon-002"):
        folder = tmp_path / "runs" / run / "snapshots"
        folder.mkdir()
        Picture.new("RGB", (800, 600), "grey").save(folder / "contact_0002.00s.png")
    matrix = load_matrix(tmp_path)
    (montage,) = montages(matrix, found_crashes(matrix))
    assert isinstance(montage, Montage)
    assert montage.title == "Crash pictures of 3 · + traffic-light assist, resume: 2 of 2 crashes"
    assert sorted(image.caption for image in montage.images) == [
        "Clear Sky - Noon, 2 s: Ego into car 1, closing at 72 km/h",
        "Heavy Rain - Noon, 2 s: Ego into car 1, closing at 72 km/h",
    ]
    data = base64.b64decode(montage.images[0].uri.partition(",")[2])
    with Picture.open(io.BytesIO(data)) as picture:
        assert (picture.format, picture.size) == ("WEBP", (240, 180))
    page = render(Page("Crashes", "", [Section("Every crash", [montage])]))
    assert page.count("<figcaption>") == 2


def test_a_played_crash_stands_once_too(tmp_path: Path) -> None:
    road = load_map("figure8")
    logs = {"a": a_log(), "b": seen_otherwise(a_log()), "c": a_log(seed=3.0)}
    found = [f for name, log in logs.items() for f in find_contacts(log, road, tmp_path / name)]
    assert len(found) == 3
    cards = contact_cards(found)
    assert sorted(card.subtitle[0] for card in cards.cards) == ["a", "c"]
    assert cards.title == "2 crashes"


def test_the_page_of_a_run_shows_the_cause(tmp_path: Path) -> None:
    write_log(tmp_path, a_log())
    page = write_crashes(tmp_path, load_map("figure8"))
    assert page is not None
    text = page.read_text(encoding="utf-8")
    assert '<p class="cause">car 1 stood ahead; the stack never reported it; ' in text
    assert '<ol class="events">' in text
