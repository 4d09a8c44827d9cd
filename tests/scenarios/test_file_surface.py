"""The surface of a scenario's road condition: felt from the begin or from an event on, and stored."""

from __future__ import annotations

import re

import numpy as np
import pytest
from msgspec import structs
from typer.testing import CliRunner

from skidpad.campaign.driving.course_file import check_scenario
from skidpad.campaign.driving.loop import Sink
from skidpad.campaign.driving.outdoors import NO_SURFACE, FileChanges
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.rerun import last_ticks
from skidpad.campaign.runs.run import OpenRun
from skidpad.campaign.runs.run import run as drive
from skidpad.campaign.runs.state_files import StateFiles, read_state
from skidpad.campaign.runs.stored import read_run
from skidpad.cli.main import app
from skidpad.core.courses import Scenario
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import FileError
from skidpad.core.simulator import BackendKind
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.recording.run.surfaces import read_laid_surfaces, read_run_surface, read_surfaces
from skidpad.scenarios.reading.environment import Environment
from support.cut_runs import go_on
from support.scenarios.files import at, event, story, time, write

ICE = SurfacePatch(name="ice", ice_mm=3.0, road=1)


def condition(properties: str) -> str:
    """An environment that says nothing but what lies on the road."""
    return f"""<GlobalAction><EnvironmentAction><Environment name="theirs">
<RoadCondition frictionScaleFactor="1">{properties}</RoadCondition>
</Environment></EnvironmentAction></GlobalAction>"""


def named(file: str) -> str:
    return condition(f'<Properties><File filepath="{file}"/></Properties>')


def write_ice(folder) -> None:
    text = "patches:\n  - {name: ice, ice_mm: 3, road: 1}\n"
    (folder / "ice.yaml").write_text(text, encoding="utf-8")


def played(folder, *words, **parts):
    init = at("ego", -3, 100) + at("other", -1, 120) + parts.pop("begin", "")
    file = write(folder, init=init, end=2.0, **parts)
    out = folder / f"out{len(words)}"
    done = CliRunner().invoke(
        app, ["play", str(file), "--out", str(out), "--actors", "physical", *words]
    )
    assert done.exit_code == 0, done.output
    return read_log(out), read_run(out), out


@pytest.mark.osc("RoadCondition")
def test_the_surface_that_a_road_condition_names_is_felt_and_stored(tmp_path):
    """As `--surface` with the same file; the run's description and its pages know the patches."""
    write_ice(tmp_path)
    log, run, out = played(tmp_path, begin=named("ice.yaml"))
    asked, beside, _ = played(tmp_path, "--surface", str(tmp_path / "ice.yaml"))
    assert run.surface == beside.surface == (ICE,)
    assert read_run_surface(out) == (ICE,)
    assert log.mu[5, 0].max() < 0.2
    assert np.array_equal(log.mu[:, :2], asked.mu[:, :2], equal_nan=True)


@pytest.mark.osc("EnvironmentAction")
def test_an_event_lays_a_surface_and_another_takes_it_away(tmp_path):
    """What `--surface` has laid stays; a road condition without properties changes nothing."""
    write_ice(tmp_path)
    wet = "patches:\n  - {name: wet, water_mm: 2, road: 1}\n"
    (tmp_path / "wet.yaml").write_text(wet, encoding="utf-8")
    events = (
        event("ice comes", named("ice.yaml"), time(0.5))
        + event("nothing new", condition(""), time(0.8))
        + event("ice goes", condition("<Properties/>"), time(1.2))
    )
    log, run, out = played(tmp_path, stories=story(events))
    laid = read_laid_surfaces(out)
    assert [(one.tick, one.surface) for one in laid] == [
        (pytest.approx(10, abs=2), (ICE,)),
        (pytest.approx(24, abs=2), ()),
    ]
    felt = log.mu[:, 0].max(axis=-1) < 0.2
    for tick in (laid[0].tick - 1, laid[0].tick + 1, laid[1].tick - 1, laid[1].tick + 1):
        there = [one.surface for one in read_surfaces(out) if one.tick <= tick][-1]
        assert (there == (ICE,)) == felt[np.searchsorted(log.tick, tick)]
    ego = log.mu[:, 0].max(axis=-1)
    assert run.surface == ()
    assert ego[(log.t > 0.1) & (log.t <= 0.5)].min() > 0.7
    assert ego[(log.t > 0.6) & (log.t <= 1.2)].max() < 0.2
    assert ego[log.t > 1.3].min() > 0.7
    wetter, _, _ = played(tmp_path, "--surface", str(tmp_path / "wet.yaml"), stories=story(events))
    over = wetter.mu[:, 0].max(axis=-1)[log.t > 1.3]
    assert (over < ego[log.t > 1.3] - 0.03).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("patches:\n  - {water_mm: 12, road: 1}\n", "water_mm must be between 0 and 10, got 12"),
        ("patches:\n  - {water_mm: 2, road: 9}\n", r"bad.yaml: patches\[0\]: .* has no road 9"),
        (None, r"bad\.yaml"),
    ],
)
def test_a_bad_surface_is_refused_with_its_line_and_range(tmp_path, text, said):
    if text is not None:
        (tmp_path / "bad.yaml").write_text(text, encoding="utf-8")
    later = event("change", named("bad.yaml"), time(1.0))
    file = write(tmp_path, init=at("ego", -3, 100) + at("other", -1, 120), stories=story(later))
    with pytest.raises(FileError, match=rf"line \d+, <File>: .*{said}"):
        check_scenario(Scenario(file=str(file))).playable()


def test_a_file_of_another_tool_is_noted_and_not_read(tmp_path):
    begin = named("friction.bin")
    file = write(tmp_path, init=at("ego", -3, 100) + at("other", -1, 120) + begin)
    found = check_scenario(Scenario(file=str(file)))
    assert found.playable().start.environment.surface == ()
    (note,) = [str(f) for f in found.findings if f.element == "File"]
    assert re.search(r"friction\.bin is not read: surfaces end in \.yaml, \.yml, \.crg", note)


def test_a_checkpoint_file_holds_what_events_have_laid(tmp_path):
    """Written while the ice lies there and after it has gone, the run goes on as one that was not cut."""
    write_ice(tmp_path)
    events = event("ice comes", named("ice.yaml"), time(0.5))
    events += event("ice goes", condition("<Properties/>"), time(1.2))
    _, spec, _ = played(tmp_path, stories=story(events))
    log = drive(spec).log
    run = OpenRun(spec)
    run.step()
    files = StateFiles(run)
    for tick in (16, 30):
        go_on(run, tick - run.tick)
        files.write(tmp_path / f"{tick}")
    go_on(run)
    assert log_hash(run.finish().log) == log_hash(log)
    for tick in (16, 30):
        other = OpenRun(spec)
        other.step()
        StateFiles(other).restore(read_state(tmp_path / f"{tick}", spec))
        go_on(other)
        rest = other.log.log.finish()
        assert int(rest.tick[0]) == tick + 1
        assert log_hash(rest) == log_hash(last_ticks(log, tick + 1))
        assert (rest.mu[0, 0].max() < 0.2) == (tick == 16)


def test_who_looks_on_is_told_what_lies_there_in_the_tick_in_which_it_is_felt(tmp_path):
    write_ice(tmp_path)
    events = event("ice comes", named("ice.yaml"), time(0.5))
    _, spec, _ = played(tmp_path, stories=story(events))

    class Onlooker(Sink):
        def follow_surface(self, laid):
            self.laid, self.there, self.felt = laid, [], []

        def see(self, moment):
            there = [one.surface for one in self.laid if one.tick <= moment.truth.tick]
            self.there.append(there[-1:] == [(ICE,)])
            self.felt.append(moment.truth.mu[0].max() < 0.2)

    onlooker = Onlooker()
    drive(spec, sinks=[onlooker])
    assert not onlooker.there[5]
    assert onlooker.there[-1]
    first = onlooker.there.index(True), onlooker.felt.index(True)
    assert abs(first[0] - first[1]) <= 1


def test_a_carla_server_says_that_it_lays_no_surface_of_an_event(tmp_path):
    write_ice(tmp_path)
    events = event("ice comes", named("ice.yaml"), time(0.5))
    _, spec, _ = played(tmp_path, stories=story(events))
    for kind in (BackendKind.EMBEDDED, BackendKind.CARLA):
        player = stage_of(spec).player
        backend = structs.replace(spec.backend, backend=kind)
        changes = FileChanges(player, structs.replace(spec, backend=backend))
        scene = player.scene
        scene.environments.append(Environment(surface=(ICE,)))
        assert changes.news() is not None
        assert changes.new_notices() == ([NO_SURFACE] if kind == BackendKind.CARLA else [])
