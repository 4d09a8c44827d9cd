"""Recordings of channels and hazards as moments; two runs in step; the crash camera."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.cli.main import app
from skidpad.cockpit import channel_source
from skidpad.cockpit.again import drive_again, list_changes
from skidpad.cockpit.channel_source import ChannelSource
from skidpad.cockpit.companion import Companion
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.indicators import NEAR, every, least_of, measure_ahead
from skidpad.cockpit.opening import open_source
from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.replaying import Replayer
from skidpad.cockpit.source import index_at, timeline
from skidpad.cockpit.studio import CRASH, View, mount_in, watching
from skidpad.cockpit.words import Link
from skidpad.core.channels import Context, Decision, TruthFrame
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Crowd, Pedals, Timed, Wheel
from skidpad.core.setup import DT
from skidpad.core.vocabulary import ActorKind, HazardType, SemanticClass, class_of
from skidpad.evidence.bodies import Body
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.mcap_files import ChannelWriter
from skidpad.recording.hazards.records import HazardRecord, HazardWriter
from skidpad.roads.bundled import load_map
from skidpad.sensors.raster.view import camera_view
from support.channel_worlds import CAR, Eyes, World, drive, frame, traffic
from support.runs import adas_run, scenario_run

MOMENTS = 12


def lane(k, ahead=0.0):
    """A place on figure8 after k cycles at 20 m/s: x, y, heading, vx, vy, and its height."""
    map = load_map("figure8")
    place = map.ahead(map.at(0, 50.0), 1.0 + 2.0 * k + ahead)
    x, y, h = place.x, place.y, place.heading
    return (x, y, h, 20.0 * np.cos(h), 20.0 * np.sin(h)), place.z


def record(path, truth=True, map="figure8"):
    """A recording in which a car drives ahead, a pedestrian stands by, and the driver changes."""
    with ChannelWriter(path, ("lav", "tfuse")) as writer:
        about = {"map": map, "precipitation": "40", "sun_altitude_deg": "-10"}
        writer.add(Context(0.0, about))
        for k in range(MOMENTS):
            t = 0.1 * k
            ego, other, walker = lane(k)[0], lane(k, 25.0)[0], lane(0, 40.0)[0]
            writer.add(frame(t, ego, [other], ids=[5]), 0)
            writer.add(Decision(t, "lav" if k < 6 else "tfuse", "kept", (0.1, 0.2)))
            if truth:
                writer.add(
                    TruthFrame(
                        t,
                        np.array(ego),
                        CAR,
                        0.7,
                        np.array([other, (*walker[:3], 0.0, 0.0)]),
                        np.stack([CAR * 1.2, CAR * 0.2]),
                        np.array([4, 4]),
                        np.array([3, 8]),
                        np.array([int(SemanticClass.TRUCK), int(SemanticClass.PEDESTRIAN)]),
                        np.array([0.7, 0.7]),
                    )
                )
    return path


def test_a_recording_of_channels_is_shown_moment_by_moment(tmp_path):
    source = open_source(record(tmp_path / "a.mcap"))
    assert isinstance(source, ChannelSource)
    assert (source.ticks, source.step) == (MOMENTS, 2)
    assert [source.tick(k) for k in (0, 1, 11)] == [0, 2, 22]
    assert [index_at(source, t) for t in (-5, 0, 1, 2, 22, 99)] == [0, 0, 1, 1, 11, 11]
    assert source.table.names == ("ego", "actor 3", "actor 8")
    assert list(source.table.kind) == [ActorKind.CAR, ActorKind.TRUCK, ActorKind.PEDESTRIAN]
    assert source.table.length[1] == pytest.approx(1.2 * 4.5)
    for k in (3, 11, 0):
        moment = source.moment(k)
        states, (place, z) = moment.truth.states, lane(k)
        assert (states.x[0], states.y[0], states.yaw[0]) == pytest.approx(place[:3])
        assert states.z[0] == pytest.approx(z, abs=0.1)
        assert moment.frame.ego.speed == pytest.approx(20.0)
        assert states.present.all()
        # what the driving channel says: one object, 25 m along the lane
        gap = np.hypot(states.x[1] - states.x[0], states.y[1] - states.y[0])
        seen = moment.frame.radar
        if k < 6:
            assert seen.range == pytest.approx([gap - 2.0], abs=0.3)
        else:
            assert len(seen.range) == 0  # the other channel said nothing
    assert "lav drives" in source.moment(0).driver.mode
    assert source.marks == [(12, "notice", "tfuse drives (kept)")]
    weather = source.seat(0).outside.weather
    assert (weather.precipitation, weather.is_night) == (40.0, True)
    line = timeline(source)
    assert (line["first"], line["last"], line["step"]) == (0, 22, 2)
    assert line["speed"] == pytest.approx([72.0] * MOMENTS)
    # the truck ahead is as fast; the walker stands 40 m ahead and comes 2 m nearer every 0.1 s
    assert line["ttc"][-1] == pytest.approx((40.0 - 22.0 - 2.25 - 0.45) / 20.0, abs=0.1)
    # the walker is the nearer one at last, the truck (25 m, 1.2 * 4.5 m long) at first
    assert line["gap"][-1] == pytest.approx(40.0 - 22.0 - 2.25 - 0.45, abs=0.3)
    assert line["gap"][0] == pytest.approx(25.0 - 2.25 - 2.7, abs=0.3)
    assert line["grip"] == pytest.approx([0.7] * MOMENTS)


def test_what_a_monitor_found_stands_on_the_time_line(tmp_path):
    source = open_source(file := record(tmp_path / "a.b.mcap"))
    line = timeline(source)
    assert (line["violated"], line["hazards"]) == ([], [])
    out = tmp_path / "a.b.monitor"
    done = CliRunner().invoke(app, ["monitor", str(file), "--out", str(out)])
    assert done.exit_code == 0, done.output
    hazards(out)  # as its writer writes one from 0.5 to 1.0 s
    line = timeline(open_source(file))
    assert line["hazards"] == [(10, 20, "ego tailgated (h0001)")]
    assert (10, "hazard", "hazard: ego tailgated (h0001)") in line["events"]
    assert line["events"] == sorted(line["events"])
    # the rows of the table that are beyond their bounds, by the number of the cycle
    rows = pl.read_parquet(out / "indicators.parquet").to_dicts()
    counts = [sum(r["violated"] for r in rows if r["cycle"] == k) for k in range(MOMENTS)]
    assert max(counts) > 0
    assert line["violated"] == counts
    # a folder that is cut short is one sentence
    (out / "hazards.jsonl").write_text('{"id": "h0')
    with pytest.raises(FileError, match=r"hazards\.jsonl, line 1"):
        open_source(file)


def straight(x, y, v):
    """A car 4 m long and 2 m wide along x, over two moments 1 s apart."""
    still = np.zeros(2)
    return Body(
        x + v * np.array([0.0, 1.0]), still + y, still, still + v, still, still, still, 4.0, 2.0
    )


def test_the_time_line_shows_how_near_a_crash_it_was():
    ego = straight(0.0, 0.0, 20.0)
    others = [straight(44.0, 0.5, 0.0), straight(34.0, 3.0, 0.0), straight(-24.0, 0.0, 40.0)]
    present = np.ones((2, 4), dtype=np.bool_)
    # 40 m from bumper to bumper, then 20 m; nobody beside or behind counts
    ahead = measure_ahead([ego, *others], present)
    assert ahead.ttc == pytest.approx([2.0, 1.0])
    assert ahead.gap == pytest.approx([40.0, 20.0])
    present[1, 1] = False
    ahead = measure_ahead([ego, *others], present)
    assert ahead.ttc == pytest.approx([2.0, np.inf])
    assert ahead.gap == pytest.approx([40.0, np.inf])
    assert measure_ahead([ego], present[:, :1]).ttc == pytest.approx([np.inf, np.inf])
    # a short dip is shown, however long the run was
    long = np.full(3500, np.inf)
    long[1234] = 0.72
    shown = least_of(long, NEAR, every(len(long)))
    assert len(shown) == len(long[every(len(long))])
    assert [v for v in shown if v is not None] == [0.7]
    assert least_of(long[:0], NEAR, every(0)) == []


def test_without_the_truth_the_first_channel_is_shown(tmp_path):
    source = open_source(record(tmp_path / "a.mcap", truth=False))
    assert source.table.names == ("ego", "object 5")
    (place, _), states = lane(4, 25.0), source.moment(4).truth.states
    assert (states.x[1], states.y[1]) == pytest.approx(place[:2])


def test_a_film_of_a_recording_in_its_own_time(tmp_path):
    record(tmp_path / "a.mcap")
    words = ["replay", str(tmp_path / "a.mcap"), "--to", "0.5", "--film", str(tmp_path / "f.mp4")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    film = cv2.VideoCapture(str(tmp_path / "f.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 6
    assert film.get(cv2.CAP_PROP_FPS) == pytest.approx(10.0)
    assert film.read()[1].std() > 10.0
    film.release()


def test_what_cannot_be_replayed_is_one_sentence(tmp_path):
    with pytest.raises(FileError, match="map 'nowhere', which is not here"):
        open_source(record(tmp_path / "a.mcap", map="nowhere"))
    with pytest.raises(ConfigError, match="no folder of hazards"):
        open_source(tmp_path / "a.mcap", "h0001")
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:40])
    with pytest.raises(FileError, match=r"cut\.mcap"):
        open_source(tmp_path / "cut.mcap")


def hazards(folder, ids=("h0001",)):
    eyes = (Eyes("lav"), Eyes("tfuse", blind=(1,)))
    worlds = list(cycles(drive(World(objects=traffic(2)), eyes, 2.0)))
    with HazardWriter(folder) as writer:
        for id in ids:
            writer.write(
                HazardRecord(
                    id=id,
                    type=HazardType.EGO_TAILGATED,
                    profile="practical",
                    forms="corrected",
                    t_start=0.5,
                    t_end=1.0,
                    t_worst=0.7,
                    count=5,
                    extremes={},
                    channels=("lav", "tfuse"),
                    driving="tfuse",
                    involved=("lav",),
                    context={"precipitation": "100"},
                    worlds=tuple(c._replace(truth=None) for c in worlds),
                )
            )
    return folder, worlds


def test_a_hazard_is_replayed_as_the_driving_channel_saw_it(tmp_path):
    folder, worlds = hazards(tmp_path / "found")
    source = open_source(folder)
    assert isinstance(source, RecordedRun)
    k = index_at(source, round(1.0 / DT))
    states = source.moment(k).truth.states
    ego = worlds[10].frames[1].ego
    assert (states.x[0], states.y[0]) == pytest.approx(ego[:2], abs=1.5)
    assert len(source.table) == 1 + len(worlds[0].frames[1].objects)
    assert source.seat(0).outside.weather.precipitation == 100.0
    again = open_source(folder, "h0001")  # from what was played before
    assert again.ticks == source.ticks


def test_one_of_several_hazards_is_chosen(tmp_path):
    folder, _ = hazards(tmp_path / "found", ("h0001", "h0002"))
    with pytest.raises(ConfigError, match=r"choose one by --id; there are: h0001, h0002"):
        open_source(folder)
    with pytest.raises(ConfigError, match="there is no hazard 'h7'"):
        open_source(folder, "h7")


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """Two seconds on objects, and the same in which a person brakes."""
    folder = tmp_path_factory.mktemp("two")
    wanted = adas_run(3, "clear-noon", duration=2.0, seed=4, vehicles=2)
    for name, inputs in (("a", []), ("b", [Timed(5, Wheel(True)), Timed(5, Pedals(brake=1.0))])):
        drive_at_desk(wanted, Desk(Recorded(inputs), wanted), folder / name)
    return folder / "a", folder / "b"


@pytest.mark.req("A-275")
def test_two_runs_are_shown_side_by_side_in_step(two, tmp_path):
    source, other = open_source(two[0]), open_source(two[1])
    companion = Companion(other, source.tick(0))
    plane, said = companion(source.moment(30), View.FOLLOW)
    assert plane.shape == (600, 800)
    assert said["t"] == pytest.approx(source.tick(30) * DT)
    assert said["mode"].startswith("MANUAL")
    feed, link = Feed(), Link(None)
    replayer = Replayer(source, feed, link, lambda: 0.0, other)
    link.seek = source.tick(25)
    replayer.turn()
    replayer.show()
    packet = feed.take()
    assert packet.views["beside"].shape == packet.views["driver"].shape
    assert b'"beside":{"t":1.25' in packet.told
    beside, curves = json.loads(packet.told)["beside"], other.curves()
    drawn = beside["curves"]
    assert drawn["stride"] == 1
    assert (drawn["speed"], drawn["gap"]) == (curves.speed, curves.gap)
    assert (drawn["ttc"], drawn["grip"]) == (curves.ttc, curves.grip)
    assert drawn["speed"][-1] < source.curves().speed[-1] - 5.0  # the other one brakes
    feed.close()
    film = tmp_path / "f.mp4"
    words = ["replay", str(two[0]), "--beside", str(two[1]), "--to", "0.2", "--film", str(film)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    shown = cv2.VideoCapture(str(film))
    assert shown.get(cv2.CAP_PROP_FRAME_WIDTH) == 1600
    shown.release()


def test_a_person_drives_in_a_scenario_and_the_run_is_replayed(tmp_path):
    wanted = scenario_run("lead_slowdown", duration=2.0)
    inputs = [Timed(5, Wheel(True)), Timed(5, Pedals(brake=1.0)), Timed(30, Crowd(3))]
    with pytest.raises(ConfigError, match="only on roads with background traffic"):
        drive_at_desk(wanted, Desk(Recorded(inputs), wanted), tmp_path / "wrong")
    driven = drive_at_desk(wanted, Desk(Recorded(inputs[:2]), wanted), tmp_path / "run")
    source = open_source(tmp_path / "run")
    assert source.ticks == len(driven.log)
    assert source.moment(20).driver.mode.startswith("MANUAL")


@pytest.mark.req("A-275")
@pytest.mark.parametrize("yaw", [0.0, 2.0, -1.2])
def test_the_crash_camera_looks_at_the_crash_from_wherever_the_ego_is(yaw):
    place, ego = Pose(30.0, -8.0, 2.0, yaw=yaw), Pose(12.0, 5.0, 1.0, 0.02, -0.05, 0.7)
    camera = watching(place)
    view = camera_view(replace(CRASH, mount=mount_in(ego, camera)), ego)
    assert view.centre == pytest.approx([camera.x, camera.y, camera.z])
    x, y, z = view.rotation @ (np.array([place.x, place.y, place.z + 0.8]) - view.centre)
    assert z > 8.0
    assert (x / z, y / z) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_who_is_of_a_foreign_class_is_shown_as_a_car(tmp_path):
    assert [class_of(label) for label in (-1, 104, 2**31)] == 3 * [SemanticClass.CAR]
    others = [lane(0, 25.0)[0], lane(0, 40.0)[0]]
    with ChannelWriter(tmp_path / "a.mcap", ("lav",)) as writer:
        writer.add(Context(0.0, {"map": "figure8"}))
        for k in range(2):
            ego = lane(k)[0]
            writer.add(frame(0.1 * k, ego, others, ids=[5, 6], classes=[104, -1]), 0)
    table = open_source(tmp_path / "a.mcap")._table
    assert table.kind[1:].tolist() == 2 * [ActorKind.CAR]
    assert table.height[1:].tolist() == 2 * [channel_source.CAR_HEIGHT]


def test_a_run_is_driven_again_with_one_thing_changed_and_shown_beside_it(two, tmp_path):
    source = open_source(shutil.copytree(two[0], tmp_path / "run"))
    assert list(list_changes(source)) == ["wet", "ice", "braking", "envelope"]
    feed, link = Feed(), Link(None)
    replayer = Replayer(source, feed, link, lambda: 0.0)
    link.again, link.seek = "ice", source.tick(30)
    replayer.turn()
    replayer._drive_again(link.again)
    packet = feed.take()
    assert packet.views["beside"].shape == packet.views["driver"].shape
    assert b'"weather":"icy_30"' in packet.told
    other = open_source(tmp_path / "run" / "again" / "ice")
    assert (other.seed, other.ticks) == (source.seed, source.ticks)
    slower = other.moment(39).frame.ego.speed
    assert slower < 0.5 * source.moment(39).frame.ego.speed
    replayer._drive_again("dry")  # as it is
    assert "cannot be driven again 'dry'" in replayer.note
    feed.close()


def test_a_run_in_which_a_person_drove_is_not_driven_again(two):
    source = open_source(two[1])
    assert list_changes(source) == {}
    with pytest.raises(ConfigError, match="cannot be driven again"):
        drive_again(source, "ice")
