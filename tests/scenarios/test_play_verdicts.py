"""Verdicts of `skidpad play`: passed, failed, void, not judged, error; by which criterion; the page."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.staging import read_staging
from support.scenarios.files import (
    at,
    by_entity,
    by_value,
    condition,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    trajectory,
    vehicle,
    write,
)

BLIND = ("--stack", "support.scenarios.blind:Blind", "--actors", "ideal")
NO_HIT = ("--expect", "no-collision")
LANE_Y = -1.75  # of lane -1 of the straight road
RIDE = ("--stack", "ideal", "--actors", "ideal")
PEDESTRIAN = """<ScenarioObject name="walker"><Pedestrian name="p" mass="80" model="p"
pedestrianCategory="pedestrian"><BoundingBox><Center x="0" y="0" z="0.9"/><Dimensions width="0.6"
length="0.6" height="1.8"/></BoundingBox><Properties/></Pedestrian></ScenarioObject>"""


def play(*words: object):
    return CliRunner().invoke(app, ["play", *map(str, words)])


def verdict_of(out: Path) -> dict[str, str]:
    with (out / "results.csv").open(encoding="utf-8", newline="") as stream:
        return next(iter(csv.DictReader(stream)))


def lead(folder: Path, gap: float = 60.0, begin: str = time(1), **parts: object) -> Path:
    """The ego at 15 m/s, one ahead at 10 m/s in the same lane that stops when it `begin`s to."""
    stop = event("stops", private(speed(to(0), "linear", 5, "rate")), begin)
    values = {"init": at("ego", -1, 100, 15) + at("other", -1, 100 + gap, 10), "end": 3.0}
    return write(folder, stories=story(stop), **values | parts)


def crossing(folder: Path, begin: float) -> Path:
    """A walker 100 m ahead of the ego crosses its lane with 2 m/s from `begin` s on.

    The ego comes with 10 m/s: it is there after 10 s. The walker starts 6 m beside its line.
    """
    place = '<WorldPosition x="{}" y="{}" z="0" h="1.5707963"/>'
    points = "".join(
        f'<Vertex time="{t}"><Position>{place.format(200, LANE_Y + y)}</Position></Vertex>'
        for t, y in ((0, -6), (6, 6))
    )
    walk = f"""<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t"
closed="false"><Shape><Polyline>{points}</Polyline></Shape></Trajectory></TrajectoryRef>
<TimeReference><Timing domainAbsoluteRelative="relative" scale="1" offset="0"/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>"""
    begins = at("ego", -1, 100, 10) + init(
        "walker", teleport(place.format(200, LANE_Y - 6)), speed(to(0))
    )
    return write(
        folder, entities=vehicle("ego") + PEDESTRIAN, init=begins, end=12.0,
        stories=story(event("walks", private(walk), time(begin)), actor="walker"),
    )  # fmt: skip


def test_a_pedestrian_who_has_crossed_before_the_car_comes_makes_the_run_void(tmp_path):
    """As Euro NCAP's CPNA was played before synchronisation was mended: nobody is there to brake for."""
    done = play(crossing(tmp_path, 0.5), "--out", tmp_path / "out", *RIDE, *NO_HIT)
    assert done.exit_code == 1, done.output
    found = verdict_of(tmp_path / "out")
    assert found["verdict"] == "void"
    assert "walker crossed the ego's way" in found["reasons"]
    assert "before the ego came" in found["reasons"]
    assert "The run is void: it proves nothing." in done.output


def test_the_same_pedestrian_in_time_is_hit_and_the_run_fails(tmp_path):
    done = play(crossing(tmp_path, 6.8), "--out", tmp_path / "out", *RIDE, *NO_HIT)
    assert done.exit_code == 1, done.output
    found = verdict_of(tmp_path / "out")
    assert found["verdict"] == "failed"
    assert found["reasons"] == "the ego had 1 contact (no-collision)"
    assert float(found["ego_at_contact_kmh"]) == pytest.approx(36.0, abs=2.0)


def test_an_event_of_a_partner_that_never_begins_makes_the_run_void(tmp_path):
    far = by_entity('<TimeHeadwayCondition entityRef="other" value="0.1" freespace="true" '
                    'rule="lessThan"/>')  # fmt: skip
    done = play(lead(tmp_path, 30.0, begin=far, end=1.0), "--out", tmp_path / "out", *BLIND)
    assert done.exit_code == 1, done.output
    found = verdict_of(tmp_path / "out")
    assert (found["verdict"], found["reasons"]) == ("void", "event 'stops' of other never began")
    staging = read_staging(tmp_path / "out")
    assert staging.partners == ("other",)


BRAKES = '<ParameterDeclaration name="brakes" parameterType="boolean" value="false"/>'
CHOSEN = by_value('<ParameterCondition parameterRef="brakes" value="true" rule="equalTo"/>')
CHOOSE = """<GlobalAction><ParameterAction parameterRef="brakes"><SetAction value="true"/>
</ParameterAction></GlobalAction>"""


def variants(folder: Path, *more: str, delay: int = 1) -> Path:
    """As Euro NCAP's CCR: one ahead, which brakes in the act of one variant only, after a delay."""
    stop = event("stops", private(speed(to(0), "linear", 5, "rate")), time(delay))
    return write(
        folder,
        parameters=BRAKES,
        init=at("ego", -1, 100, 15) + at("other", -1, 145, 10),
        stories=story(stop, start=CHOSEN) + "".join(more),
        end=3.0,
    )


@pytest.mark.parametrize(
    ("words", "delay", "verdict", "code"),
    [
        ((), 1, "passed", 0),
        (("--param", "brakes=true"), 1, "passed", 0),
        (("--param", "brakes=true"), 60, "void", 1),
    ],
)
def test_a_variant_that_the_parameters_do_not_choose_is_not_staged(
    tmp_path, words, delay, verdict, code
):
    file = variants(tmp_path, delay=delay)
    done = play(file, "--out", tmp_path / "out", *BLIND, *words)
    assert done.exit_code == code, done.output
    found = verdict_of(tmp_path / "out")
    assert found["verdict"] == verdict
    never = "event 'stops' of other never began"
    assert found["reasons"] == (never if verdict == "void" else "")
    assert read_staging(tmp_path / "out").partners == (("other",) if words else ())


def test_a_variant_that_an_event_may_choose_is_staged(tmp_path):
    choose = story(event("chooses", CHOOSE, time(60)), actor="ego", name="later")
    done = play(variants(tmp_path, choose), "--out", tmp_path / "out", *BLIND)
    assert done.exit_code == 1, done.output
    assert verdict_of(tmp_path / "out")["verdict"] == "void"


def test_a_variant_without_events_is_void_where_its_partner_never_comes_near(tmp_path):
    file = variants(tmp_path)
    file.write_text(file.read_text("utf-8").replace('s="145"', 's="600"'), "utf-8")
    done = play(file, "--out", tmp_path / "out", *BLIND)
    assert done.exit_code == 1, done.output
    assert verdict_of(tmp_path / "out")["verdict"] == "void"


@pytest.mark.parametrize(("driver", "verdict"), [(BLIND, "void"), (("--stack", "ideal"), "passed")])
def test_a_file_that_lets_the_ego_reverse_is_void_where_it_did_not(tmp_path, driver, verdict):
    """As in Euro NCAP's CPRA: a car reverses to somebody behind it, and no stack of ours does that."""
    begins = init("ego", teleport(on_lane(-3, 150)), speed(to(-1.1))) + at("other", -3, 135, 0)
    file = write(tmp_path, init=begins, end=4.0)
    done = play(file, "--out", tmp_path / "out", *driver, *NO_HIT)
    found = verdict_of(tmp_path / "out")
    assert found["verdict"] == verdict, done.output
    assert ("never went backwards" in found["reasons"]) == (verdict == "void")


@pytest.mark.parametrize(("driver", "verdict"), [(BLIND, "void"), (("--stack", "ideal"), "failed")])
def test_a_file_that_lets_the_ego_turn_off_is_void_where_it_went_another_way(
    tmp_path, driver, verdict
):
    """As in Euro NCAP's CCFtap: the ego turns across the way of an oncoming car."""
    way = trajectory((100.0, -1.75), (125.0, -1.75), (125.0, 40.0))
    begins = init("ego", teleport(on_lane(-1, 100)), speed(to(8)), way) + at("other", 1, 160, 8)
    file = write(tmp_path, init=begins, end=6.0)
    done = play(file, "--out", tmp_path / "out", *driver, *NO_HIT)
    found = verdict_of(tmp_path / "out")
    assert found["verdict"] == verdict, done.output
    assert ("turn off" in found["reasons"]) == (verdict == "void")


def test_an_event_that_waits_for_a_collision_is_no_part_of_the_interaction(tmp_path):
    hit = by_entity('<CollisionCondition><EntityRef entityRef="other"/></CollisionCondition>')
    done = play(lead(tmp_path, 30.0, begin=hit, end=1.0), "--out", tmp_path / "out", *BLIND)
    assert done.exit_code == 0, done.output
    assert verdict_of(tmp_path / "out")["verdict"] == "passed"


def test_the_users_rule_wins_over_the_files_and_the_files_over_no_contact(tmp_path):
    criterion = '<ParameterCondition parameterRef="{}" value="{}" rule="lessThan"/>'
    stop = condition(time(3.0)) + "".join(
        condition(by_value(criterion.format(*words))).replace('name="c"', f'name="criteria_{name}"')
        for name, *words in (
            ("DrivenDistanceTest", "distance_success", 100), ("RunningStopTest", "", ""),
        )
    )  # fmt: skip
    file = lead(tmp_path, stop=stop)
    done = play(file, "--out", tmp_path / "of_file", *BLIND)
    found = verdict_of(tmp_path / "of_file")
    assert (done.exit_code, found["verdict"]) == (1, "failed"), done.output
    assert re.search(r"the ego drove 4\d\.\d m, 100 m are asked for", found["reasons"])
    assert found["criterion"] == (
        "of the file: DrivenDistanceTest; RunningStopTest cannot be judged here"
    )
    done = play(file, "--out", tmp_path / "of_user", *BLIND, "--expect", "no-collision")
    found = verdict_of(tmp_path / "of_user")
    assert (done.exit_code, found["verdict"]) == (0, "passed"), done.output
    assert found["criterion"] == "--expect no-collision"


def test_a_file_that_drives_its_own_ego_is_not_judged_without_a_rule(tmp_path):
    junit = tmp_path / "junit.xml"
    done = play(lead(tmp_path), "--out", tmp_path / "out", *RIDE, "--junit", junit)
    assert done.exit_code == 0, done.output
    assert verdict_of(tmp_path / "out")["verdict"] == "not judged"
    (case,) = etree.parse(str(junit)).getroot()
    assert [child.tag for child in case] == ["skipped"]


def test_the_terminal_shows_a_table_of_80_columns_the_answer_and_the_next_command(tmp_path):
    done = play(lead(tmp_path), "--out", tmp_path / "out", *BLIND)
    lines = done.stdout.splitlines()
    table = lines[: lines.index("")]
    assert max(map(len, table)) <= 80
    assert table[0].split() == ["scenario", "weather", "verdict", "gap", "TTC", "decel", "hit"]
    assert [line.partition(":")[0] for line in lines[-3:]] == ["page", "table", "Next"]


def test_a_name_that_is_too_long_keeps_its_ends():
    from skidpad.cli.scenarios.played_table import _pad_text

    assert _pad_text("a" * 20 + "b" * 20, 12) == "aaaaa..bbbbb"
    assert _pad_text("short", 8) == "short   "


def test_the_page_has_curves_events_and_a_replay_of_a_run_without_a_crash(tmp_path):
    done = play(lead(tmp_path), "--out", tmp_path / "out", *BLIND)
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for words in ("speed of the ego", "speed of other", "TTC with other", "event stops"):
        assert words in page, words
    replay = re.search(r'<script type="application/json">(.*?)</script>', page)
    assert replay is not None
    frames = re.search(r'"frames":\[(.*?)\]\]', replay[1])
    assert frames is not None
    assert frames[1].count("[") == 31, "3 s in steps of 0.1 s"
    assert "Criterion: no contact of the ego." in page
