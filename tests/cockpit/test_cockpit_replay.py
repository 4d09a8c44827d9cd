"""A stored run as moments again, as films, and the sentences for folders that are none."""

import json
import re
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.driving.loop import Sink
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.campaign.workers.pool import local
from skidpad.cli.main import app
from skidpad.cockpit import crash_film
from skidpad.cockpit import source as source_module
from skidpad.cockpit.crash_film import draw_crash
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.film import stretch_of, write_film
from skidpad.cockpit.pictures import colours
from skidpad.cockpit.plots import FOOT, ROW
from skidpad.cockpit.replay import RecordedRun, report_of
from skidpad.cockpit.replaying import Replayer
from skidpad.cockpit.source import opening_tick
from skidpad.cockpit.studio import Studio, View, plane
from skidpad.cockpit.watching import lines, standing
from skidpad.cockpit.words import Link
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.inputs import (
    Beam,
    Functions,
    Lamps,
    LampSwitch,
    Method,
    Pedals,
    Sky,
    Timed,
    Wheel,
)
from skidpad.core.run import Function
from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.physics.presets import preset
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.run.events import encode_events
from skidpad.recording.run.log_files import EVENTS, TICKS
from support.runs import adas_run

INPUTS = [
    Timed(10, Functions((Function.ACC,))),
    Timed(30, Wheel(True)),
    Timed(31, Pedals(steer=0.2, method=Method.GAMEPAD)),
    Timed(50, Sky(preset("clear-night"), GripModel.PHYSICAL, RangeModel.NONE)),
    Timed(55, Lamps(LampSwitch.HIGH)),
    Timed(70, Wheel(False)),
]


class Kept(Sink):
    """The moments of a drive, copied."""

    def __init__(self):
        self.moments = []

    def see(self, moment):
        t = moment.truth
        self.moments.append(
            (t.tick, t.states.copy(), dict(t.lights), t.contacts, moment.report, moment.driver.mode)
        )


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    folder, kept = tmp_path_factory.mktemp("driven") / "run", Kept()
    wanted = adas_run(3, "rain-noon", duration=5.0, seed=4)
    drive_at_desk(wanted, Desk(Recorded(INPUTS), wanted), folder, (kept,))
    return folder, kept.moments


def test_a_car_on_a_bridge_is_in_nobodys_way_on_the_time_line(driven):
    recording = RecordedRun(driven[0])
    log = recording.log
    at = {name: getattr(log.actors, name).copy() for name in ("x", "y", "z", "yaw", "vx", "vy")}
    for name in ("x", "y", "z", "yaw"):
        at[name][:, 1] = at[name][:, 0]
    at["x"][:, 1] += 12.0 * np.cos(at["yaw"][:, 0])
    at["y"][:, 1] += 12.0 * np.sin(at["yaw"][:, 0])
    at["vx"][:, 1] = at["vy"][:, 1] = 0.0
    recording.log = replace(log, actors=log.actors._replace(**at))
    assert any(v is not None for v in recording.curves().ttc)
    at["z"][:, 1:] += 40.0  # more than a road climbs to whoever is that near
    assert all(v is None for v in recording.curves().ttc)


@pytest.mark.parametrize("tick", [-5, 2000])
def test_a_crash_that_no_moment_shows_is_looked_for_in_the_nearest_one(driven, tick):
    recording = RecordedRun(driven[0])
    beyond = ContactEvent(tick, 1, "", impulse=1e3, v_closing=2.0, x=0.0, y=0.0)
    recording.log = replace(recording.log, events=(beyond,))
    at = 0 if tick < 0 else -1
    assert recording.crash(40).x == recording.log.actors.x[at, 0]


def test_moments_are_those_that_were_driven(driven):
    folder, moments = driven
    recording = RecordedRun(folder)
    assert recording.ticks == len(moments) == 100
    for k in (0, 31, 71, 99, 40):  # in any order
        tick, states, lights, contacts, report, mode = moments[k]
        moment = recording.moment(k)
        truth = moment.truth
        assert (truth.tick, truth.lights, truth.contacts) == (tick, lights, contacts)
        for name in ("x", "y", "z", "yaw", "vx", "vy"):
            theirs, ours = getattr(states, name), getattr(truth.states, name)
            assert np.allclose(theirs, ours, rtol=1e-6, atol=1e-4), name
        assert moment.report == report == report_of(recording.log, k)
        assert moment.driver.mode == mode


def test_the_desk_stands_as_it_stood(driven):
    recording = RecordedRun(driven[0])
    seats = {k: recording.seat(k) for k in (0, 9, 10, 29, 30, 49, 50, 54, 55, 69, 70)}
    assert [k for k, s in seats.items() if s.manual] == [30, 49, 50, 54, 55, 69]
    assert seats[9].functions != seats[10].functions == (Function.ACC,)
    assert [seats[k].outside.weather.name for k in (49, 50)] == ["rain-noon", "clear-night"]
    assert [seats[k].outside.beam for k in (54, 55)] == [None, Beam.HIGH]
    assert seats[30].method == "keyboard"
    assert seats[49].method == "gamepad"


@pytest.mark.req("A-275")
def test_pictures_are_drawn_again_from_the_poses(driven):
    folder, moments = driven
    recording = RecordedRun(folder)
    studio = Studio(recording.map, recording.table, recording.seat(20).outside, 4)
    tick, states, lights, *_ = moments[20]
    logged = recording.moment(20).truth
    logged = replace(logged, tick=tick, commands=np.zeros_like(logged.commands))  # nobody brakes
    driven_then = replace(logged, states=states, lights=lights)
    for view in (View.SEMANTIC, View.TOP, View.FOLLOW):
        live = plane(studio.look(driven_then)[view.value]).copy()
        again = plane(studio.look(logged)[view.value])
        # the bodies' pitch is told from what is logged, their roll is not there
        if view is View.SEMANTIC:
            assert np.mean(live == again) > 0.99
        else:
            assert np.abs(colours(live).astype(float) - colours(again)).mean() < 4.0, view


def test_time_goes_where_it_is_told_to(driven):
    recording, feed, link = RecordedRun(driven[0]), Feed(), Link(None)
    now = [0.0]
    replayer = Replayer(recording, feed, link, lambda: now[0])
    where = []

    def turn(seconds=0.0):
        now[0] += seconds
        replayer.turn()
        where.append(replayer.k)

    turn(1.001)
    link.paused = True
    turn(1.0)
    link.steps = 3
    turn()
    link.seek = 70
    turn(1.0)
    link.seek = -5
    turn()
    link.paused, link.rate = False, 0.5
    turn()
    turn(1.001)
    link.rate = 4.0
    turn()
    turn(100.0)
    feed.close()
    assert where == [20, 20, 23, 70, 0, 0, 10, 10, 99]


def test_a_replay_begins_before_the_crash_at_the_highest_speed(driven, monkeypatch):
    monkeypatch.setattr("skidpad.cockpit.source.BEFORE", 1.0)
    recording = RecordedRun(driven[0])
    recording.marks = [(40, "notice", "dusk")]
    assert opening_tick(recording) == 0
    speed = recording.log.v_ego
    slow, fast = sorted((30, 90), key=lambda tick: speed[tick - 1])
    recording.marks += [(slow, "crash", "contact"), (fast, "crash", "contact")]
    assert opening_tick(recording) == fast - 20
    recording.marks = [(10, "crash", "contact")]
    assert opening_tick(recording) == 0


@pytest.mark.req("A-275")
def test_a_stretch_becomes_a_film(driven, tmp_path):
    recording = RecordedRun(driven[0])
    words = ["replay", str(driven[0]), "--from", "1", "--to", "1.5", "--film"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "a" / "film.mp4"), "--view", "driver"])
    assert done.exit_code == 0, done.output
    film = cv2.VideoCapture(str(tmp_path / "a" / "film.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 11
    assert film.read()[1].std() > 10.0
    film.release()
    path = write_film(recording, stretch_of(recording, 2.0, 2.4), View.FOLLOW, tmp_path / "f.webp")
    with Image.open(path) as animation:
        assert animation.n_frames == 5
    with pytest.raises(ConfigError, match=r"ends in \.mp4 or \.webp"):
        write_film(recording, range(3), View.TOP, tmp_path / "film.avi")
    for begin, end in ((3, 2), (-1, 2), (50, 60)):
        with pytest.raises(ConfigError, match="--from"):
            stretch_of(recording, begin, end)


def test_the_film_of_the_worst_crash_begins_before_it(driven, tmp_path, monkeypatch):
    run = tmp_path / "run"
    shutil.copytree(driven[0], run)
    crash = ContactEvent(95, 1, "", impulse=1e3, v_closing=2.0, x=0.0, y=0.0)
    (run / EVENTS).write_bytes(encode_events((crash,)))
    monkeypatch.setattr(source_module, "BEFORE", 0.5)
    for length, pictures in ((8.0, 8), (0.4, 5)):  # of every second of the ticks 85 to 99, or 93
        monkeypatch.setattr(crash_film, "LENGTH", length)
        draw_crash(run, tmp_path / "film.webp")
        with Image.open(tmp_path / "film.webp") as film:
            assert film.n_frames == pictures
            assert film.size == (480, 360 + round(0.6 * (3 * ROW + FOOT)))  # plots are under it
    with pytest.raises(FileError, match="not the folder of a run"):
        draw_crash(tmp_path, tmp_path / "none.webp")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["film.webp", "run"]


def sheet(driven, path, *words):
    """The tiles of a written sheet, (rows, columns, 480, 640, 3)."""
    done = CliRunner().invoke(app, ["replay", str(driven[0]), "--picture", str(path), *words])
    assert done.exit_code == 0, done.output
    picture = cv2.imread(str(path))
    rows, columns = picture.shape[0] // 480, picture.shape[1] // 640
    return picture.reshape(rows, 480, columns, 640, 3).swapaxes(1, 2)


def test_a_moment_becomes_a_sheet_of_its_views_in_every_weather(driven, tmp_path):
    six = sheet(driven, tmp_path / "six.png", "--at", "1", "--view", "driver", "--weather", "all")
    assert six.shape[:2] == (2, 3)
    noon, night = six[0, 1], six[0, 2]
    assert noon[:200].mean() > 2.0 * night[:200].mean(), "the sky of a night is darker"
    three = sheet(driven, tmp_path / "a" / "three.png", "--view", "left,driver,right", "--at", "1")
    assert three.shape[:2] == (1, 3)
    assert min(tile.std() for tile in three[0]) > 10.0
    wet = sheet(driven, tmp_path / "b.png", "--at", "1", "--view", "driver,semantic", "--drops",
                "--weather", "rain-noon")  # fmt: skip
    assert wet.shape[:2] == (2, 2)
    assert wet[0, 0][:440].tolist() != wet[0, 1][:440].tolist(), "drops are seen"
    assert wet[1, 0][:440].tolist() == wet[1, 1][:440].tolist(), "classes have no lens"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--picture", "a.gif"], r"a picture's file ends in \.png, \.jpg, \.webp, got a\.gif"),
        (["--drops"], "--weather and --drops are of a picture"),
        (["--picture", "a.png", "--view", "driver,roof"], "--view"),
        (["--picture", "a.png", "--weather", "hail"], "hail"),
    ],
)
def test_a_wrong_sheet_is_one_sentence(driven, words, sentence):
    done = CliRunner().invoke(app, ["replay", str(driven[0]), *words])
    with pytest.raises(ConfigError, match=sentence):
        raise done.exception


def test_folders_that_hold_no_run_are_one_sentence(driven, tmp_path):
    def refused(folder):
        with pytest.raises(FileError) as caught:
            RecordedRun(folder)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert "is not the folder of a run" in refused(tmp_path)
    assert "is not the folder of a run" in refused(tmp_path / "nothing")
    for file in (TICKS, EVENTS, "config.yaml"):
        cut = tmp_path / file
        shutil.copytree(driven[0], cut)
        text = (cut / file).read_bytes()
        end = text.index(b"settings:") + 4 if file == "config.yaml" else len(text) // 2
        (cut / file).write_bytes(text[:end])
        assert str(cut) in refused(cut)
    other = shutil.copytree(driven[0], tmp_path / "setting")
    described = (other / "config.yaml").read_text(encoding="utf-8")
    assert "cruise: steady" in described
    (other / "config.yaml").write_text(described.replace("cruise: steady", "cruise: stea"))
    assert f"{other / 'config.yaml'}: unknown cruise 'stea'" in refused(other)


def test_commands_refuse_in_one_sentence(driven, tmp_path):
    wrong = {
        ("replay", str(tmp_path)): "is not the folder of a run",
        ("watch", str(tmp_path)): "is not the folder of a campaign",
        ("watch", str(tmp_path / "nothing")): "is not the folder of a campaign",
        ("drive", "--out", str(driven[0])): "exists already",
        ("drive", "--weather", "frogs"): "unknown weather",
        ("drive", "--configs", "1,2"): "one driver at a time",
        ("drive", "--map", "nowhere", "--out", str(tmp_path / "x")): "unknown map 'nowhere'",
        ("drive", "--scenario", "nothing.xosc", "--out", str(tmp_path / "x")): "nothing.xosc",
        ("drive", "--page-port", "70000"): "--page-port must be between",
        ("drive", "--rate", "1000", "--out", str(tmp_path / "x")): "rate must be between",
    }
    for words, told in wrong.items():
        done = CliRunner().invoke(app, [*words, "--no-browser"])
        assert done.exit_code != 0
        assert told in str(done.exception), words


def test_a_drive_by_hand_is_scored_and_compared(driven):
    run = str(driven[0])
    scored = CliRunner().invoke(app, ["show", run])
    assert scored.exit_code == 0, scored.output
    compared = CliRunner().invoke(app, ["compare", run, run])
    assert compared.exit_code == 0, compared.output
    rows = {line.split()[0]: line.split()[1:] for line in compared.output.splitlines()}
    before, after, change = rows["mean_speed_kmh"]
    assert before == after
    assert float(before) > 0.0
    assert float(change) == 0.0
    judged = CliRunner().invoke(app, ["compare", run, run, "--fail-if", "collisions_vehicle > 0"])
    assert "judges campaigns" in str(judged.exception)


def test_the_worst_crash_of_a_campaign_is_a_roll_over_or_the_one_at_the_highest_speed(tmp_path):
    def write_line(k, crashes, impact, **more):
        metrics = {"fatal_collisions": crashes, "max_impact_kmh": impact, **more}
        line = {"run": f"2_clear-noon-00{k}", "key": {"outcome": "completed"}, "metrics": metrics}
        return json.dumps(line) + "\n"

    lines_of = [
        write_line(1, 0, None),
        write_line(2, 1, 55.0),
        write_line(3, 1, 20.0),
        write_line(4, 1, None),
    ]
    (tmp_path / "ledger.jsonl").write_text("".join(lines_of))
    assert standing(tmp_path).worst_crash == "2_clear-noon-002"
    # a car on its side is worse than any contact
    rolled = write_line(5, 1, None, roll_overs=1)
    ended = write_line(6, 0, None).replace("completed", "roll_over")
    for name, roll_over in (("2_clear-noon-005", rolled), ("2_clear-noon-006", ended)):
        (tmp_path / "ledger.jsonl").write_text(roll_over + "".join(lines_of))
        assert standing(tmp_path).worst_crash == name
    # where no speed is known it is the newest one
    (tmp_path / "ledger.jsonl").write_text(write_line(2, 1, None) + write_line(3, 1, None))
    assert standing(tmp_path).worst_crash == "2_clear-noon-003"


def test_how_a_campaign_stands(tmp_path):
    cells = [adas_run(2, "clear-noon", duration=1.0, seed=s, vehicles=2) for s in (1, 2)]
    Campaign(RECIPE, cells).run(tmp_path, local(1))
    now = standing(tmp_path)
    assert (now.done, now.planned, now.outcomes) == (2, 2, {"completed": 2})
    assert lines(now) == [
        "adas: 2 of 2 runs done",
        "2 completed",
        "2_clear-noon: 2 of 2 without a crash, 95 % 0.16 to 1.00",
        "worst crash: none",
    ]
    done = CliRunner().invoke(app, ["watch", str(tmp_path), "--once"])
    assert done.output.splitlines() == lines(now)
    ledger = tmp_path / "ledger.jsonl"
    text = ledger.read_text()
    first = re.sub(',"sum":"[0-9a-f]+"', "", text.splitlines()[0])  # as older versions wrote
    first = first.replace('"fatal_collisions":0', '"fatal_collisions":1')
    ledger.write_text(text + re.sub("-00[12]", "-003", first) + "\n" + '{"torn')
    now = standing(tmp_path)
    assert (now.done, now.worst_crash) == (3, "2_clear-noon-003")
    assert lines(now)[-1] == "worst crash: 2_clear-noon-003"  # its folder is not there
    run = tmp_path / RUNS / "2_clear-noon-003"
    run.mkdir()
    assert lines(standing(tmp_path))[-1] == (
        f"worst crash: 2_clear-noon-003  (skidpad replay {run} begins before its fastest crash)"
    )
    spaced = tmp_path.rename(tmp_path.parent / "two words")
    once = CliRunner().invoke(app, ["watch", str(spaced), "--once"]).output
    assert f"skidpad replay '{spaced / RUNS / run.name}' begins" in once
    spaced.rename(tmp_path)
    assert (tmp_path / RUNS).is_dir()
