"""The parts of the cockpit without web and browser: feed, words, time, tabs, bridge, screen."""

import itertools
import multiprocessing

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from runs import adas_run
from skidpad.campaign.desk import Desk, Recorded
from skidpad.campaign.run import run
from skidpad.cockpit.bridge import Bridge
from skidpad.cockpit.feed import SLOT_BYTES, SLOTS, Feed
from skidpad.cockpit.marks import marks_of, project
from skidpad.cockpit.pictures import Encoder, views_of
from skidpad.cockpit.producer import Producer
from skidpad.cockpit.realtime import RealTime
from skidpad.cockpit.screen import Screen, Shown
from skidpad.cockpit.studio import View, cameras
from skidpad.cockpit.tabs import RELEASE_AFTER, DeadMan, Tabs
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
    encode,
    settled,
)
from skidpad.core.errors import ConfigError, InputError, SkidpadError
from skidpad.core.frames import RadarPoints
from skidpad.core.inputs import Crowd, Functions, Lamps, LampSwitch, Method, Pedals, Sky, Wheel
from skidpad.core.run import Function
from skidpad.core.setup import DT
from skidpad.core.states import StackReport
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.physics.presets import preset
from skidpad.recording.logfiles import log_hash
from skidpad.roads.bundled import load_map
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra


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
    assert [feed.put(b'{"n":%d}' % n, views) for n in range(5)] == [1, 2, 3, 4, 5]
    packet = other.take()
    assert (packet.number, packet.told) == (5, b'{"n":4}')
    assert packet.views.keys() == views.keys()
    assert all(np.array_equal(packet.views[k], views[k]) for k in views)
    assert feed.taken == 5
    other.close()
    other.close()


def test_a_picture_that_is_overtaken_while_it_is_read_is_read_anew(feed, monkeypatch):
    views = {"a": np.zeros((4, 4), dtype=np.uint8)}
    feed.put(b"1", views)
    slot, calls = feed._slot, itertools.count()

    def overtaken(number):
        data = slot(number)
        if next(calls) == 0:
            monkeypatch.setattr(feed, "_slot", slot)
            for k in range(SLOTS):
                feed.put(b"2", {"a": np.full((4, 4), 7 + k, dtype=np.uint8)})
        return data

    monkeypatch.setattr(feed, "_slot", overtaken)
    packet = feed.take()
    assert packet.number == 1 + SLOTS
    assert np.all(packet.views["a"] == 7 + SLOTS - 1)


def test_views_that_do_not_fit_are_refused(feed):
    with pytest.raises(ValueError, match="do not fit"):
        feed.put(b"1", {"a": np.zeros(SLOT_BYTES, dtype=np.uint8)})


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
    assert settled(given) == [
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
    time = RealTime(link, shown.append, wall, wall.wait)
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
    time = RealTime(link, (shown := []).append, (wall := Wall()), wall.wait)
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


# --- tabs and what they may say


class Deaf:
    """A producer that keeps what it is told."""

    def __init__(self):
        self.words = []
        self.result = None

    def say(self, word):
        self.words.append(word)


def bridge(**seat):
    made = Bridge(Deaf())
    made.told = {"seat": seat}
    for tab in ("a", "b"):
        made.tabs.come(tab)
    return made


def test_a_drive_without_a_page_goes_on_or_pauses():
    for pauses, said in ((False, []), (True, [Pause(True)])):
        made = Bridge(Deaf(), pauses)
        for tab in ("a", "b"):
            made.tabs.come(tab)
        made.leave("a")
        assert made.producer.words == []
        made.leave("b")
        assert made.producer.words == said


@given(st.lists(st.tuples(st.booleans(), st.sampled_from("abc"))))
def test_there_is_always_one_driver_among_the_open_tabs(moves):
    tabs, opened = Tabs(), []
    for come, tab in moves:
        (tabs.come if come else tabs.go)(tab)
        opened = [t for t in opened if t != tab or come] + [tab] * (come and tab not in opened)
        assert len(tabs) == len(opened)
        assert tabs.driver == (opened[0] if opened else None)


def test_a_tab_that_watches_says_nothing():
    b = bridge()
    for word, value in (("take", None), ("pedals", {"throttle": 1.0}), ("end", None), ("seek", 3)):
        assert b.say("b", word, value) == "another tab drives: this one watches"
        assert b.say("nobody", word, value) is not None
    assert b.producer.words == []
    b.say("a", "pedals", {"throttle": 1.0})
    b.leave("a")
    assert b.producer.words[-1] == Do(Pedals())  # released, as nobody holds them
    assert b.say("b", "take") is None


def test_words_that_mean_nothing_are_refused_in_one_sentence():
    b = bridge(sky=preset("clear-noon").values())
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
    b = bridge(manual=True, functions=["acc", "lca"], lamps="low", weather=noon.name,
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


@pytest.mark.req("A-274")
def test_pedals_are_released_when_nothing_is_heard_of_them():
    released, wall = [], Wall()
    man = DeadMan(lambda: released.append(wall.now), wall)
    man.check()
    for _ in range(5):
        man.heard(True)
        wall.now += RELEASE_AFTER - 0.01
        man.check()
    assert released == []
    wall.now += 0.02
    man.check()
    man.check()
    assert released == [wall.now]
    man.heard(True)
    man.heard(False)
    wall.now += 10.0
    man.check()
    assert len(released) == 1


def test_the_same_pedals_are_said_once():
    b = bridge()
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


# --- the producer


def fine(feed_name, pipe, about):
    link = Link(pipe)
    while not link.ended:
        link.drain(1.0)
    return f"ended {about['what']}"


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
