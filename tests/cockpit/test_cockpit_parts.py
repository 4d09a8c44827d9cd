"""The parts of the cockpit without web and browser: feed, words, time, tabs, bridge, screen."""

import itertools
import multiprocessing
import os
import signal
from dataclasses import replace

import cv2
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from skidpad.campaign.driving.loop import Sink
from skidpad.campaign.runs.run import run
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.cli.main import app
from skidpad.cli.options import carla_backend
from skidpad.cockpit import producer as producer_module
from skidpad.cockpit import serving
from skidpad.cockpit.bridge import ASLEEP_AFTER, RELEASE_AFTER, Bridge, DeadMan, Tabs
from skidpad.cockpit.driving import CockpitPacer
from skidpad.cockpit.feed import SLOT_BYTES, SLOTS, Feed
from skidpad.cockpit.hud import TIERS
from skidpad.cockpit.marks import marks_of, project
from skidpad.cockpit.pictures import LIGHTS, Encoder, colours, views_of
from skidpad.cockpit.producer import Producer
from skidpad.cockpit.screen import Screen, Shown
from skidpad.cockpit.studio import View, cameras
from skidpad.cockpit.words import (
    Do,
    End,
    Link,
    Live,
    Pace,
    Pause,
    Seek,
    Show,
    Step,
    drop_void_inputs,
    encode,
)
from skidpad.core.errors import ConfigError, InputError, SkidpadError
from skidpad.core.frames import RadarPoints
from skidpad.core.inputs import Crowd, Functions, Lamps, LampSwitch, Method, Pedals, Sky, Wheel
from skidpad.core.run import Function, run_from_plain
from skidpad.core.setup import DT
from skidpad.core.specs import Modality
from skidpad.core.states import StackReport
from skidpad.core.vocabulary import GripModel, RangeModel, SemanticClass, Tier
from skidpad.physics.presets import preset
from skidpad.recording.run.log_files import log_hash
from skidpad.roads.bundled import load_map
from skidpad.sensors.finish.extras import ALL_EXTRAS, NO_EXTRAS, Extra
from skidpad.sensors.suite import PixelSuite
from skidpad.simulation import pacing
from support.cockpit.producers import Recorder, bridge
from support.runs import adas_run

PICTURES = os.environ.get("SKIDPAD_PICTURES")  # a folder for pictures, to be looked at


@pytest.fixture
def feed():
    made = Feed()
    yield made
    made.close()


# --- feed


def test_the_newest_picture_comes_out_as_it_went_in(feed):
    assert feed.take() is None
    other = Feed(feed.name)
    views = {
        "a": np.arange(6, dtype=np.uint32).reshape(2, 3),
        "b": np.arange(5, dtype=np.uint8).reshape(1, 5),
        "c": np.arange(8, dtype=np.uint32).reshape(4, 2)[::2],
    }
    assert [feed.write_picture(b'{"n":%d}' % n, views) for n in range(5)] == [1, 2, 3, 4, 5]
    packet = other.take()
    assert (packet.number, packet.told) == (5, b'{"n":4}')
    assert packet.views.keys() == views.keys()
    assert all(np.array_equal(packet.views[k], views[k]) for k in views)
    assert feed.last_read == 5
    other.close()
    other.close()


def test_a_picture_that_is_overtaken_while_it_is_read_is_read_anew(feed, monkeypatch):
    views = {"a": np.zeros((4, 4), dtype=np.uint8)}
    feed.write_picture(b"1", views)
    slot, calls = feed._slot, itertools.count()

    def overtaken(number):
        data = slot(number)
        if next(calls) == 0:
            monkeypatch.setattr(feed, "_slot", slot)
            for k in range(SLOTS):
                feed.write_picture(b"2", {"a": np.full((4, 4), 7 + k, dtype=np.uint8)})
        return data

    monkeypatch.setattr(feed, "_slot", overtaken)
    packet = feed.take()
    assert packet.number == 1 + SLOTS
    assert np.all(packet.views["a"] == 7 + SLOTS - 1)


def test_views_that_do_not_fit_are_refused(feed):
    with pytest.raises(ValueError, match="do not fit"):
        feed.write_picture(b"1", {"a": np.zeros(SLOT_BYTES, dtype=np.uint8)})


# --- words


def test_words_go_through_a_pipe_and_a_broken_pipe_ends_it():
    ours, theirs = multiprocessing.Pipe()
    link = Link(theirs)
    assert not link.drain()
    words = [Pace(2.0), Pause(True), Step(3), Seek(7), Show(View.TOP, (View.DEPTH,))]
    for word in [*words, Do(Wheel(True))]:
        ours.send_bytes(encode(word))
    assert link.drain()
    assert (link.rate, link.paused, link.steps, link.seek) == (2.0, True, 3, 7)
    assert (link.main, link.hidden) == (View.TOP, {View.DEPTH})
    live = Live(link)
    assert live.at(0) == [Lamps(LampSwitch.AUTO), Wheel(True)]
    assert live.at(1) == []
    ours.send_bytes(encode(End()))
    link.drain()
    assert link.ended
    again = Link(theirs)
    ours.close()
    again.drain()
    assert again.ended
    assert not again.drain()
    theirs.close()


def test_of_many_words_of_a_kind_in_a_tick_the_last_one_counts():
    night = Sky(preset("clear-night"), GripModel.PHYSICAL, RangeModel.NONE)
    given = [
        Pedals(0.1), Wheel(True), night, Lamps(LampSwitch.LOW), Pedals(0.2), Wheel(False),
        Lamps(LampSwitch.HIGH), Wheel(True), Functions(()), Functions((Function.ACC,)),
    ]  # fmt: skip
    assert drop_void_inputs(given) == [
        Wheel(True), night, Pedals(0.2), Wheel(False), Lamps(LampSwitch.HIGH), Wheel(True),
        Functions((Function.ACC,)),
    ]  # fmt: skip


# --- time


class Wall:
    def __init__(self, per_tick=0.0):
        self.now, self.waits = 0.0, []

    def __call__(self):
        return self.now

    def wait(self, seconds):
        self.waits.append(seconds)
        self.now += seconds


def paced(link, took, wall=None):
    """Real time over ticks that take so long each; returns the wall and what was waited."""
    wall, shown = Wall() if wall is None else wall, []
    time = CockpitPacer(link, shown.append, wall, wall.wait)
    time.begin(None)
    try:
        for seconds in took:
            wall.now += seconds
            time.see("moment")
    finally:
        time.end()
    return time, wall, shown


@pytest.mark.req("A-262")
@pytest.mark.parametrize(("rate", "seconds"), [(1.0, 2.0), (4.0, 0.5), (0.5, 4.0)])
def test_forty_ticks_take_as_long_as_the_rate_says(rate, seconds):
    link = Link(None)
    link.rate = rate
    time, wall, _ = paced(link, [0.005] * 40)
    assert wall.now == pytest.approx(seconds)
    assert time.rtf == pytest.approx(rate, rel=0.15)


def test_as_fast_as_it_can_waits_for_nothing():
    link = Link(None)
    link.rate = 0.0
    _, wall, _ = paced(link, [0.001] * 40)
    assert wall.waits == []


def test_a_late_tick_does_not_make_the_next_ones_hurry():
    _, wall, _ = paced(Link(None), [0.01] * 5 + [1.0] + [0.01] * 20)
    assert wall.now == pytest.approx(5 * DT + 1.0 + 20 * DT, abs=DT)


def test_a_pause_shows_the_moment_and_goes_on_by_steps():
    ours, theirs = multiprocessing.Pipe()
    link = Link(theirs)
    for word in (Pause(True), Show(View.TOP), Step(2)):
        ours.send_bytes(encode(word))
    link.drain()
    time = CockpitPacer(link, (shown := []).append, (wall := Wall()), wall.wait)
    time.see("first")
    time.see("second")
    assert shown == ["first", "second"]
    assert link.steps == 0
    ours.send_bytes(encode(Pause(False)))
    time.see("third")
    assert not link.paused
    assert shown == ["first", "second"]
    ours.close()
    theirs.close()


@pytest.fixture
def drive_asked(monkeypatch, tmp_path):
    """A function that invokes `skidpad drive` and returns what would be driven: job and plain data."""
    kept = []
    monkeypatch.setattr(serving, "serve", lambda producer, *_: kept.append(producer) or "ended")
    monkeypatch.setattr(producer_module, "Producer", lambda job, about: (job, about))

    def ask(*words):
        done = CliRunner().invoke(app, ["drive", *words, "--out", str(tmp_path / "run")])
        assert done.exit_code == 0, done.exception
        return kept.pop()

    return ask


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_drive_begins_in_rain_behind_a_lead(drive_asked, seed):
    _, about = drive_asked("--duration", "4", "--sensors", "objects", "--seed", str(seed))
    spec = run_from_plain(about["spec"], "the drive")
    assert spec.weather.precipitation > 0.0
    log = run(spec).log
    for second in (2, 3):
        k = 20 * second
        x, y, yaw = (getattr(log.actors, name)[k] for name in ("x", "y", "yaw"))
        dx, dy, c, s = x - x[0], y - y[0], np.cos(yaw[0]), np.sin(yaw[0])
        ahead, left = c * dx + s * dy, c * dy - s * dx
        lead = (ahead > 20.0) & (ahead < 60.0) & (abs(left) < 1.0)
        assert (np.hypot(log.actors.vx[k], log.actors.vy[k])[lead] > 1.0).any()


def test_a_drive_on_a_carla_server_keeps_the_traffic_that_it_can_have(drive_asked, monkeypatch):
    monkeypatch.setattr(carla_backend, "check_backend", lambda choice: choice)
    for words, traffic in (((), "fixed"), (("--traffic", "random"), "random")):
        _, about = drive_asked("--backend", "carla", *words)
        assert about["spec"]["course"]["traffic"] == traffic
    with pytest.raises(AssertionError, match="embedded simulator alone"):
        drive_asked("--backend", "carla", "--traffic", "pack")


@pytest.mark.req("A-267", "A-268")
@pytest.mark.parametrize(
    ("words", "own"),
    [((), True), (("--no-gc-in-pause",), False), (("--without", "gc-in-pause"), False)],
)
def test_a_drive_collects_garbage_in_its_pauses_unless_it_is_told_not_to(
    feed, monkeypatch, drive_asked, words, own
):
    asked = ["--sensors", "objects", "--vehicles", "0", "--duration", "0.5", "--rate", "0"]
    job, about = drive_asked(*asked, *words)
    disabled = []
    monkeypatch.setattr(pacing.gc, "disable", lambda: disabled.append(True))
    ours, theirs = multiprocessing.Pipe()
    assert job(feed.name, theirs, about).startswith("completed after 10 ticks")
    assert bool(disabled) is own
    ours.close()
    theirs.close()


# --- tabs and what they may say


def test_a_drive_without_a_page_goes_on_or_pauses():
    for pauses, said in ((False, []), (True, [Pause(True)])):
        made = Bridge(Recorder(), pauses)
        for tab in ("a", "b"):
            made.tabs.note_tab(tab)
        made.leave("a")
        assert made.producer.words == []
        made.leave("b")
        assert made.producer.words == said


def test_a_tab_that_sleeps_lets_go_of_the_wheel_and_comes_last_when_it_wakes():
    made = Bridge(Recorder(), pauses=True, clock=(wall := Wall()))
    for tab in ("a", "b"):
        made.tabs.note_tab(tab)
    made.say("a", "pedals", {"throttle": 1.0})
    made.producer.words.clear()
    wall.now += ASLEEP_AFTER - 0.1
    made.tabs.note_tab("b")
    made.check()
    assert made.may("a")
    wall.now += 0.2
    made.check()
    assert made.may("b")
    assert made.say("b", "take") is None
    assert made.producer.words == [Do(Pedals()), Do(Wheel(True))]
    made.tabs.note_tab("a")
    assert made.may("b")
    assert len(made.tabs) == 2
    # when all of them sleep, the drive stands, once
    made.producer.words.clear()
    for _ in range(3):
        wall.now += ASLEEP_AFTER + 0.1
        made.check()
    assert made.producer.words == [Pause(True)]
    made.tabs.note_tab("b")
    assert made.may("b")


@given(st.lists(st.tuples(st.booleans(), st.sampled_from("abc"))))
def test_there_is_always_one_driver_among_the_open_tabs(moves):
    tabs, opened = Tabs(), []
    for come, tab in moves:
        (tabs.note_tab if come else tabs.go)(tab)
        opened = [t for t in opened if t != tab or come] + [tab] * (come and tab not in opened)
        assert len(tabs) == len(opened)
        assert tabs.driver == (opened[0] if opened else None)


def test_a_tab_that_watches_says_nothing():
    b = bridge("a", "b")
    for word, value in (("take", None), ("pedals", {"throttle": 1.0}), ("end", None), ("seek", 3)):
        assert b.say("b", word, value) == "another tab drives: this one watches"
        assert b.say("nobody", word, value) is not None
    assert b.producer.words == []
    b.say("a", "pedals", {"throttle": 1.0})
    b.leave("a")
    assert b.producer.words[-1] == Do(Pedals())  # released, as nobody holds them
    assert b.say("b", "take") is None


def test_words_that_mean_nothing_are_refused_in_one_sentence():
    b = bridge("a", "b", sky=preset("clear-noon").values())
    wrong = [
        ("fly", None), ("rate", "fast"), ("rate", 1e9), ("seek", None), ("toggle", "wings"),
        ("weather", "frogs"), ("pedals", {"throttle": 7}), ("pedals", {"clutch": 1}), ("pedals", 3),
        ("sky", {"precipitation": 400}), ("main", "inside"), ("lamps", "blue"), ("grip", 1),
    ]  # fmt: skip
    for word, value in wrong:
        told = b.say("a", word, value)
        assert told is not None
        assert told.startswith(f"{word}: ")
        assert "\n" not in told
    assert b.producer.words == []


@pytest.mark.req("A-271", "A-273")
def test_what_the_words_of_a_tab_mean():
    noon = preset("clear-noon")
    b = bridge("a", "b", manual=True, functions=["acc", "lca"], lamps="low", weather=noon.name,
               sky=noon.values(), grip="none", range="physical")  # fmt: skip
    said = {
        ("take", None): Do(Wheel(False)),
        ("toggle", "acc"): Do(Functions((Function.LCA,))),
        ("toggle", "tla"): Do(Functions((Function.ACC, Function.LCA, Function.TLA))),
        ("lamps", None): Do(Lamps(LampSwitch.HIGH)),
        ("pause", None): Pause(True),
        ("crowd", 7.0): Do(Crowd(7)),
        ("main", None): Show(View.FOLLOW),
        ("hide", "depth"): Show(View.FOLLOW, (View.DEPTH,)),
        ("hide", "semantic"): Show(View.FOLLOW, (View.DEPTH, View.SEMANTIC)),
        ("weather", None): Do(Sky(preset("clear-night"), GripModel.NONE, RangeModel.PHYSICAL)),
        ("pedals", ("throttle", 0.5)): Do(Pedals(0.5)),
    }
    for (word, value), meant in said.items():
        value = dict([value]) if isinstance(value, tuple) else value
        assert b.say("a", word, value) is None
        assert b.producer.words[-1] == meant
    assert b.say("a", "hide", "depth") is None
    assert b.producer.words[-1] == Show(View.FOLLOW, (View.SEMANTIC,))
    assert b.say("a", "extra", "clouds") is None
    without = tuple(sorted(ALL_EXTRAS - {Extra.CLOUDS}))
    assert b.producer.words[-1] == Show(View.FOLLOW, (View.SEMANTIC,), without)
    assert b.say("a", "extra") is None  # all that are left, and all again
    assert b.producer.words[-1] == Show(View.FOLLOW, (View.SEMANTIC,), ())
    assert b.say("a", "extra") is None
    assert b.producer.words[-1] == Show(View.FOLLOW, (View.SEMANTIC,), tuple(sorted(ALL_EXTRAS)))
    assert "is not a valid Extra" in b.say("a", "extra", "frogs")
    b.say("a", "sky", {"ice_thickness": 30.0})
    b.say("a", "sky", {"fog_density": 20.0})
    sky = b.producer.words[-1].input
    assert (sky.weather.ice_thickness, sky.weather.fog_density) == (30.0, 20.0)
    assert sky.weather.name == "clear-night-custom"


@pytest.mark.req("A-273")
def test_the_time_of_day_goes_round_in_any_weather():
    def hours(name, **changes):
        weather = replace(preset(name), **changes)
        b = bridge("a", "b", weather=name, sky=weather.values(), grip="none", range="physical")
        skies = []
        for _ in range(4):
            assert b.say("a", "hour") is None
            skies.append(b.producer.words[-1].input.weather)
        for sky in skies:  # nothing else changes
            assert replace(sky, sun_altitude_deg=0.0).values() == (
                replace(weather, sun_altitude_deg=0.0).values()
            )
        return [(sky.name, sky.sun_altitude_deg) for sky in skies]

    clear = [("clear-night", -30.0), ("clear-sunrise", 15.0), ("clear-noon", 75.0)]
    assert hours("clear-noon") == [*clear, clear[0]]
    assert hours("rain-night")[0] == ("rain-sunrise", 15.0)
    snow = hours("snow", sun_altitude_deg=-1.0)
    assert [name for name, _ in snow] == ["snow-custom", "snow", "snow-custom", "snow-custom"]
    assert [sun for _, sun in snow] == [15.0, 75.0, -30.0, 15.0]


@pytest.mark.req("A-274")
def test_pedals_are_released_when_nothing_is_heard_of_them():
    released, wall = [], Wall()
    man = DeadMan(lambda: released.append(wall.now), wall)
    man.check()
    for _ in range(5):
        man.note_pedals(True)
        wall.now += RELEASE_AFTER - 0.01
        man.check()
    assert released == []
    wall.now += 0.02
    man.check()
    man.check()
    assert released == [wall.now]
    man.note_pedals(True)
    man.note_pedals(False)
    wall.now += 10.0
    man.check()
    assert len(released) == 1


def test_the_same_pedals_are_said_once():
    b = bridge("a", "b")
    for _ in range(3):
        b.say("a", "pedals", {"brake": 0.5, "method": "gamepad"})
    assert b.producer.words == [Do(Pedals(brake=0.5, method=Method.GAMEPAD))]


# --- the screen


def shown_drive(feed, link, take, **changes):
    """Three seconds on objects with a screen that is read every time or never."""
    wanted = adas_run(4, "rain-night", duration=3.0, seed=2, **changes)
    desk = Desk(Recorded([]), wanted)
    map = load_map("figure8")
    screen = Screen(feed, link, map, lambda: Shown(desk.outside, {"kind": "drive", "seat": {}}), 2)
    packets = []
    see = screen.see

    def seen(moment):
        screen._at = 0.0  # no limit of pictures per second
        see(moment)
        if take:
            packets.append(feed.take())

    screen.see = seen
    return screen, packets, run(wanted, desk=desk, sinks=(screen,)).log, wanted


@pytest.mark.req("A-271", "A-272")
def test_a_screen_shows_every_view_and_changes_nothing(feed):
    screen, packets, log, wanted = shown_drive(feed, Link(None), take=True)
    assert (screen.shown, screen.dropped) == (60, 0)
    assert log_hash(log) == log_hash(run(wanted).log)
    told = msgspec.json.decode(packets[-1].told)
    assert told["tick"] == 59
    assert told["stack"]["mode"].startswith("CRUISE")
    assert {"status", "distance", "time_gap", "radar_limit"} <= told["stack"].keys()
    assert told["motion"]["speed_kmh"] == pytest.approx(3.6 * log.ego.speed[-1], abs=0.06)
    assert told["motion"]["mu"] == pytest.approx(log.mu[-1, 0].tolist(), abs=0.006)
    assert len(told["radar"]) > 5
    views = views_of(packets[-1], told)
    assert views.keys() == {"driver", "left", "rear", "right", "top", "depth", "semantic"}
    assert views["driver"].shape == (600, 800, 3)
    for name, picture in views.items():
        assert picture.std() > 3.0, name
    length = int.from_bytes(Encoder().message(packets[-1])[:4], "little")
    head = msgspec.json.decode(Encoder().message(packets[-1])[4 : 4 + length])
    assert sum(size for _, size in head["views"]) > 10_000


def test_a_page_that_takes_nothing_holds_nothing_back(feed):
    screen, _, log, wanted = shown_drive(feed, Link(None), take=False)
    assert screen.shown == 1
    assert log_hash(log) == log_hash(run(wanted).log)


def test_hidden_views_are_not_drawn(feed):
    link = Link(None)
    link.main, link.hidden = View.FOLLOW, {View.DEPTH, View.SEMANTIC, View.TOP}
    _, packets, _, _ = shown_drive(feed, link, take=True)
    assert packets[-1].views.keys() == {"follow", "left", "rear", "right"}


def test_marks_stand_where_things_are_seen():
    camera = next(c for c in cameras() if c.id == "driver")
    # a point straight ahead of the camera is in the middle; left of it is left; higher is higher
    middle, left, high = project(
        camera, np.array([[50.0, 0.35, 1.3], [50.0, 5.35, 1.3], [50.0, 0.35, 6.3]])
    )
    assert middle[:2] == pytest.approx([400.0, 300.0])
    assert left[0] == pytest.approx(400.0 - 400.0 * 5.0 / 49.95)
    assert high[1] == pytest.approx(300.0 - 400.0 * 5.0 / 49.95)
    one = np.array([30.0], dtype=np.float32)
    none = np.zeros(1, dtype=np.float32)
    radar = RadarPoints(one, none, none, np.array([-5.0], dtype=np.float32))
    marks = marks_of(camera, radar, StackReport(distance=30.0))
    ((u, v, closing),) = marks.points
    assert closing
    assert u == pytest.approx(404, abs=2)  # the radar is in the middle, the driver left of it
    left, top, right, bottom = marks.lead
    assert left < u < right
    assert top < v < bottom
    assert marks_of(camera, RadarPoints.none(), StackReport()).lead is None


class AtLight(Sink):
    """Shows one moment: the first one in which the stack reports a light within 50 m."""

    def __init__(self, screen):
        self.screen, self.moment = screen, None

    def begin(self, table):
        self.table = table
        self.screen.begin(table)

    def see(self, moment):
        near = moment.report.light_distance
        if self.moment is None and near is not None and near < 50.0:
            self.moment = moment
            self.states, self.lights = moment.truth.states.copy(), dict(moment.truth.lights)
            self.screen.show(moment)
            self.wrong = [self.mark(near + 9.0), self.mark(None)]

    def mark(self, distance):
        """What is drawn if the stack says so of the distance."""
        report = replace(self.moment.report, light_distance=distance)
        camera = self.screen.cameras["driver"]
        return self.screen.light.mark(camera, replace(self.moment, report=report))


@pytest.mark.req("A-272")
def test_the_light_that_the_stack_reports_is_framed_where_it_is_seen(feed):
    wanted = adas_run(4, duration=34.0, seed=2, vehicles=0)
    desk, map, link = Desk(Recorded([]), wanted), load_map("figure8"), Link(None)
    link.extras = NO_EXTRAS
    screen = Screen(feed, link, map, lambda: Shown(desk.outside, {"kind": "drive", "seat": {}}))
    run(wanted, desk=desk, sinks=(at := AtLight(screen),))
    packet = feed.take()
    told = msgspec.json.decode(packet.told)
    *_, (frames, state, label), _ = told["marks"]["driver"]
    assert label == f"red {at.moment.report.light_distance:.0f} m"
    assert state == "red"
    # by another route: where a camera for classes in the same place sees a traffic light
    camera = replace(screen.cameras["driver"], id="classes", modality=Modality.SEMANTIC)
    suite = PixelSuite(map, at.table, (camera,), wanted.weather)
    seen = suite.observe(0, at.states, at.lights).images["classes"].labels
    rows, columns = np.nonzero(seen == SemanticClass.TRAFFIC_LIGHT)
    ((left, top, right, bottom),) = frames
    within = (columns >= left) & (columns <= right) & (rows >= top) & (rows <= bottom)
    assert within.sum() > 8
    assert within.mean() > 0.9
    assert (right - left) * (bottom - top) < 60 * within.sum()
    # and it is painted in its colour
    plain = colours(packet.views["driver"])
    drawn = views_of(packet, told)["driver"]
    assert tuple(drawn[(top + bottom) // 2, left]) == LIGHTS["red"]
    assert tuple(plain[(top + bottom) // 2, left]) != LIGHTS["red"]
    # what is said of no light, or of another one, draws nothing
    assert at.wrong == [None, None]
    if PICTURES:
        cv2.imwrite(f"{PICTURES}/light.png", drawn)


# --- the producer


def test_the_page_is_told_every_tier_by_its_value():
    assert len(TIERS) == len(Tier) == max(Tier) + 1
    assert TIERS[Tier.NONE] == "No action"
    assert TIERS[Tier.ACC_HOLD] == "ACC hold"
    assert TIERS[Tier.BEND] == "Bend"


def fine(feed_name, pipe, about):
    link = Link(pipe)
    while not link.ended:
        link.drain(1.0)
    return f"ended {about['what']}"


def signalled(feed_name, pipe, about):
    for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(os.getpid(), one)
    return fine(feed_name, pipe, about)


def broken(feed_name, pipe, about):
    raise SkidpadError("no such thing")


def refused(feed_name, pipe, about):
    raise ConfigError("not so many")


def lost(feed_name, pipe, about):
    raise SystemExit(3)


def test_a_producer_works_until_it_is_told_to_end():
    producer = Producer(fine, {"what": "well"})
    producer.start()
    assert producer.result is None
    producer.stop()
    producer.stop()
    assert producer.outcome() == "ended well"
    producer.say(End())  # too late, and no harm


def test_what_closes_a_terminal_does_not_end_the_simulator_before_it_has_written():
    producer = Producer(signalled, {"what": "well"})
    producer.start()
    producer.stop()
    assert producer.outcome() == "ended well"


@pytest.mark.parametrize(
    ("job", "told"),
    [(broken, "no such thing"), (refused, "not so many"), (lost, "without a word")],
)
def test_a_producer_that_fails_says_why(job, told):
    producer = Producer(job, {})
    producer.start()
    while not producer.wait(60.0):
        pass
    producer.stop()
    with pytest.raises(SkidpadError, match=told) as caught:
        producer.outcome()
    assert isinstance(caught.value, InputError) == (job is refused)
