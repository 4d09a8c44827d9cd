"""The quick way gives the very ticks of the stepper, and takes nearly all of them where a run qualifies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from msgspec import structs

from skidpad.campaign.cells.grip import Cross, cross, template
from skidpad.campaign.driving import quick
from skidpad.campaign.driving.loop import Arrival, Moment, Sink, Timer, Unsupervised
from skidpad.campaign.driving.quick_kernel import drive_ticks
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.run import OpenRun, Run
from skidpad.core.courses import Roads
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.inputs import Outside
from skidpad.core.run import Function, RunSpec
from skidpad.core.setup import ActorCommand
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import Govern, Outcome, RelocationReason, SensorLevel, TrafficStart
from skidpad.envelope.govern_kernel import find_limits, keep_inside
from skidpad.physics.presets import all_presets, find_weather
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import log_hash
from skidpad.recording.run.ticks import copy_actors
from skidpad.scenarios.playing.table_kernel import play_tick
from skidpad.scenarios.shipped import NAMES
from skidpad.sensors.object_level.objects import sense
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.recovery import RecoverySettings, Supervisor, find_ego
from skidpad.simulation.standing import has_reason
from skidpad.simulation.world.feel import feel_motion
from skidpad.simulation.world.step import advance
from skidpad.stack.perception.lights import heed_light
from skidpad.stack.road import read_road
from skidpad.stack.think import think
from support.runs import adas_run, scenario_run
from support.scenarios.files import at, event, private, story, time, write

MAPS = ("figure8", "town", "motorway")
PROFILES = ("recommended", "thesis_text", "thesis_listing", "preliminary")
SHARE = 0.95  # of the ticks in which the stack drives


def draw_run(k: int) -> RunSpec:
    """A run that has a quick way: configuration, map, traffic, weather and profile by number."""
    rng = np.random.default_rng(k)
    presets = all_presets()
    names = sorted(set(presets) - {"snow"})
    return adas_run(
        k % 5,
        presets[names[int(rng.integers(len(names)))]],
        profile=PROFILES[k % 4],
        course=Roads(
            map=MAPS[int(rng.integers(3))],
            vehicles=int(rng.integers(41)),
            traffic=list(TrafficStart)[int(rng.integers(3))],
            allow_fewer=True,
        ),
        seed=int(rng.integers(1, 1000)),
        duration=float(rng.uniform(15.0, 45.0)),
    )


def drive_stepwise(spec: RunSpec) -> Run:
    opened = OpenRun(spec)
    while opened.step() is not None:
        pass
    opened.close()
    return opened.finish()


def drive_quickly(
    spec: RunSpec, most: int = 100_000, sinks: Sequence[Sink] = ()
) -> tuple[Run, OpenRun]:
    opened = OpenRun(spec, sinks=sinks)
    while opened.drive(most):
        pass
    opened.close()
    return opened.finish(), opened


def columns_of(log: RunLog) -> dict[str, Any]:
    """Every array of a log by name, floats as bits."""
    found: dict[str, Any] = {"tick": log.tick, "supervision": log.supervision, "mu": log.mu}
    for part in ("actors", "ego", "applied", "requested", "report"):
        series = getattr(log, part)
        found |= {f"{part}.{name}": getattr(series, name) for name in series._fields}
    return found | {"present": log.present, "weather": log.weather}


def first_difference(one: RunLog, other: RunLog) -> str:
    """Where two logs part ways; empty when they are equal bit by bit."""
    differing = {}
    for name, a in columns_of(one).items():
        b = columns_of(other)[name]
        if len(a) != len(b):
            return f"{len(a)} and {len(b)} ticks"
        bits = [np.ascontiguousarray(c).view(np.uint8).reshape(len(c), -1) for c in (a, b)]
        ticks = np.flatnonzero((bits[0] != bits[1]).any(axis=1))
        if len(ticks):
            differing[name] = int(ticks[0])
    if not differing:
        return "" if one.events == other.events else "the events"
    first = min(differing.values())
    return f"tick {first}: {', '.join(n for n, tick in differing.items() if tick == first)}"


def draw_surface(k: int) -> RunSpec:
    """The same on ice, water and a grip of 0.3 around the start and further on."""
    patches = [
        SurfacePatch(circle=(40.0 * i, 0.0, 60.0), **kind)
        for i, kind in enumerate(({"ice_mm": 1.0}, {"water_mm": 2.0}, {"friction": 0.3}))
    ]
    return structs.replace(draw_run(k), surface=tuple(patches))


def draw_settings(k: int, **values: Any) -> RunSpec:
    """The same with single settings."""
    spec = draw_run(k)
    return structs.replace(spec, settings=spec.settings.with_values(values))


def draw_route(k: int) -> RunSpec:
    """The same on a way that ends before its time is over, or not."""
    spec = draw_run(k)
    assert isinstance(spec.course, Roads)
    way = float(np.random.default_rng(k).uniform(0.1, 0.6))
    return structs.replace(spec, course=structs.replace(spec.course, route_km=way))


def draw_wind(k: int) -> RunSpec:
    return draw_settings(k, wind=True, wind_speed=18.0, wind_gusts=0.2)


def draw_roll_over(k: int) -> RunSpec:
    return draw_settings(k, roll_over=True)


OTHERS = (draw_surface, draw_wind, draw_roll_over, draw_route)


def compare(numbers: range, draw: Callable[[int], RunSpec] = draw_run) -> None:
    """Drives runs both ways; says the first tick that differs and the share that was compiled."""
    quick = driven = events = 0
    for k in numbers:
        spec = draw(k)
        one, (other, opened) = drive_stepwise(spec), drive_quickly(spec)
        assert opened.quick is not None, opened.why_not_quick
        assert not first_difference(one.log, other.log), f"run {k}"
        assert one.outcome == other.outcome
        quick += opened.quick_ticks
        driven += int((one.log.supervision == 0).sum())
        events += len(one.log.events)
    share = quick / driven
    print(
        f"{len(numbers)} runs, {events} events, {driven} ticks of the stack, {share:.1%} compiled"
    )
    assert events > len(numbers)
    assert share > SHARE


def test_both_ways_give_the_same_bits() -> None:
    compare(range(8))


def test_both_ways_give_the_same_bits_in_many_runs() -> None:
    compare(range(8, 68))


QUICK_WORDS = [word for word in Govern if word not in (Govern.NONE, Govern.FULL)]


@pytest.mark.parametrize("word", QUICK_WORDS)
def test_a_governed_stack_gives_the_same_bits(word: Govern) -> None:
    """Also what the envelope says in each tick."""
    k = QUICK_WORDS.index(word)
    weather = find_weather(("icy_100", "rain-noon", "snow")[k % 3])
    course = Roads(map=MAPS[k % 3], traffic=TrafficStart.PACK)
    spec = adas_run(
        3, weather, course=course, govern=word, seed=900_001 + k, duration=40.0,
        settings={"grip": "physical"},
    )  # fmt: skip
    one, (other, opened) = drive_stepwise(spec), drive_quickly(spec)
    assert opened.quick is not None, opened.why_not_quick
    assert not first_difference(one.log, other.log)
    assert one.readings is not None
    assert other.readings is not None
    assert one.readings.table.equals(other.readings.table)
    assert opened.quick_ticks > 0.8 * len(one.log.tick)


@pytest.mark.parametrize("draw", OTHERS)
def test_surfaces_wind_and_ends_of_routes_give_the_same_bits(
    draw: Callable[[int], RunSpec],
) -> None:
    compare(range(4), draw)


@pytest.mark.parametrize("draw", OTHERS)
def test_surfaces_wind_and_ends_of_routes_give_the_same_bits_in_many_runs(
    draw: Callable[[int], RunSpec],
) -> None:
    compare(range(4, 24), draw)


def test_a_way_ends_in_the_same_tick() -> None:
    spec = adas_run(4, course=Roads(route_km=0.3), duration=60.0)
    one, (other, opened) = drive_stepwise(spec), drive_quickly(spec)
    assert 100 < len(one.log) < 1000
    assert opened.quick_ticks > SHARE * len(one.log)
    assert not first_difference(one.log, other.log)


@pytest.mark.parametrize("scenario", NAMES)
@pytest.mark.parametrize("weather", ["icy_30", "rain-night"])
def test_scripted_runs_give_the_same_bits(scenario: str, weather: str) -> None:
    (cell,) = cross(
        template(), Cross(scenarios=(scenario,), weather=(find_weather(weather),)), range(1)
    )[:1]
    one, (other, opened) = drive_stepwise(cell), drive_quickly(cell)
    assert not first_difference(one.log, other.log)
    assert one.outcome == other.outcome
    assert one.played == other.played
    assert opened.quick is not None
    assert opened.quick_ticks > SHARE * len(one.log)


@pytest.mark.parametrize("scenario", ["lead_slowdown", "ghost_cut_in"])  # without a contact
def test_a_story_in_a_table_needs_no_call_per_tick(scenario: str, monkeypatch: Any) -> None:
    asked: list[int] = []

    def count(joined: Any, story: Any, begun: bool, tick: int, n: int, *others: Any) -> Any:
        asked.append(n)
        return drive_ticks(joined, story, begun, tick, n, *others)

    monkeypatch.setattr(quick, "drive_ticks", count)
    run, opened = drive_quickly(scenario_run(scenario))
    assert opened.quick_ticks > SHARE * len(run.log)
    assert len(asked) < 0.15 * opened.quick_ticks


def test_a_script_that_changes_what_is_seen_and_felt_gives_the_same_bits(tmp_path: Path) -> None:
    hidden = private('<VisibilityAction graphics="true" sensors="{}" traffic="true"/>')
    rain = """<GlobalAction><EnvironmentAction><Environment name="theirs"><Weather>
<Precipitation precipitationType="rain" precipitationIntensity="30"/></Weather>
<RoadCondition frictionScaleFactor="0.4"/></Environment></EnvironmentAction></GlobalAction>"""
    events = (
        event("hide", hidden.format("false"), time(1.0)),
        event("show", hidden.format("true"), time(2.0)),
        event("rain", rain, time(3.0)),
    )
    file = write(
        tmp_path, stories=story(*events, actor="other"), end=6.0, minor=3,
        init=at("ego", -1, 100, 15) + at("other", -1, 160, 12),
    )  # fmt: skip
    spec = scenario_run(file)
    one, (other, opened) = drive_stepwise(spec), drive_quickly(spec)
    assert not first_difference(one.log, other.log)
    assert one.log.weathers == other.log.weathers
    assert opened.quick is not None
    # a second of it something is hidden; after the rain has begun it goes on as before
    assert 0.75 * len(one.log) < opened.quick_ticks < 0.85 * len(one.log)


def test_lamps_that_flash_are_told_in_the_same_ticks(tmp_path: Path, monkeypatch: Any) -> None:
    flash = private("""<AppearanceAction><LightStateAction><LightType>
<VehicleLight vehicleLightType="brakeLights"/></LightType>
<LightState mode="flashing"/></LightStateAction></AppearanceAction>""")
    file = write(
        tmp_path, stories=story(event("flash", flash, time(1.0)), actor="other"), end=6.0, minor=3,
        init=at("ego", -1, 100, 15) + at("other", -1, 160, 12),
    )  # fmt: skip
    told: list[list[int]] = []
    change = EmbeddedBackend.change

    def note(backend: EmbeddedBackend, outside: Outside) -> None:
        told[-1].append(backend.world.tick)
        change(backend, outside)

    monkeypatch.setattr(EmbeddedBackend, "change", note)
    for drive in (drive_stepwise, drive_quickly):
        told.append([])
        drive(scenario_run(file))
    assert told[0] == told[1]
    assert len(told[0]) > 5


@pytest.mark.parametrize("number", [0, 4])
def test_an_ego_that_is_stuck_is_moved_in_the_same_tick(number: int) -> None:
    """Stuck is one below 5 m/s for a second without a reason."""
    spec = adas_run(number, duration=60.0)
    logs = []
    for quickly in (False, True):
        stage = stage_of(spec)
        settings = RecoverySettings(stuck_speed=5.0, stuck_time=1.0, release_speed=2.0)
        supervisor = Supervisor(stage.map, settings, stage.setup.dt)
        opened = OpenRun(spec, stage=replace(stage, supervisor=supervisor))
        while opened.drive(100) if quickly else opened.step() is not None:
            pass
        opened.close()
        logs.append(opened.finish().log)
    assert RelocationReason.STUCK in {moved.reason for moved in logs[0].relocations}
    assert not first_difference(*logs)


def test_a_run_may_be_cut_anywhere() -> None:
    spec = adas_run(4, duration=12.0)
    whole, opened = drive_quickly(spec)
    pieces, _ = drive_quickly(spec, most=7)
    assert opened.quick is not None
    assert opened.quick_ticks > 0.9 * len(whole.log)
    assert not first_difference(whole.log, pieces.log)


@pytest.mark.parametrize("scripted", [False, True])
def test_a_branch_is_the_same_both_ways(scripted: bool) -> None:
    """The radar has the seed of the branch; back at the checkpoint the run has its own again."""
    spec = scenario_run("lead_slowdown") if scripted else adas_run(4)
    hashes = []
    for quickly in (False, True):
        opened = OpenRun(structs.replace(spec, duration=6.0))

        def drive(ticks: int, opened: OpenRun = opened, quickly: bool = quickly) -> None:
            while ticks > 0:
                ticks -= opened.drive(ticks) if quickly else opened.step() is not None

        drive(40)
        saved = opened.save()
        for name in ("elsewhere", ""):
            opened.restore(saved, name)
            drive(50)
            hashes.append(log_hash(opened.finish().log))
        assert (opened.quick_ticks > 70) is quickly
        opened.close()
    assert hashes[0] != hashes[1]
    assert hashes[:2] == hashes[2:]


def lay_ice(opened: OpenRun) -> None:
    spec = opened.spec
    outside = Outside(
        weather=spec.weather, grip=spec.grip, range_model=spec.settings.sensors.range,
        patches=(SurfacePatch(ice_mm=3.0, circle=(0.0, 0.0, 1000.0)),),
    )  # fmt: skip
    opened.backend.change(outside)


def slow_in_bends(opened: OpenRun) -> None:
    assert opened.driver is not None
    stack: Any = opened.driver.stack.stack
    stack.switch(stack.functions | {Function.BEND})


@pytest.mark.parametrize(("change", "reason"), [(lay_ice, ""), (slow_in_bends, "bends")])
def test_what_is_changed_between_two_calls_counts(change: Any, reason: str) -> None:
    logs = []
    for quickly in (False, True):
        opened = OpenRun(adas_run(4, duration=5.0))
        for _ in range(30):
            opened.step()
        change(opened)
        while opened.drive(100) if quickly else opened.step() is not None:
            pass
        opened.close()
        run = opened.finish()
        logs.append(run.log)
        assert (run.quick_ticks == 0) is (not quickly or bool(reason))
        assert not quickly or reason in run.why_not_quick
    assert not first_difference(*logs)


class Arrivals(Arrival):
    """A script of another class."""

    def __init__(self) -> None:
        self.ended = False

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        del truth
        return ()


def test_the_first_of_two_reasons_stays() -> None:
    opened = OpenRun(adas_run(4, duration=1.0))
    opened.step()
    slow_in_bends(opened)
    opened.drive(100)
    assert opened.stepper is not None
    opened.stepper.script = Timer(10, Arrivals())
    opened.drive(100)
    opened.close()
    run = opened.finish()
    assert run.quick_ticks == 0
    assert "bends" in run.why_not_quick


@pytest.mark.parametrize("spec", [adas_run(4), scenario_run("front_accident")])
def test_the_end_of_a_run_is_no_reason(spec: RunSpec) -> None:
    opened = OpenRun(structs.replace(spec, duration=0.5))
    opened.step()
    assert opened.stepper is not None
    while not opened.stepper.script.ended:
        opened.step()
    assert not opened.drive(100)
    opened.close()
    assert opened.finish().why_not_quick == "it was driven tick by tick"


def test_the_supervisor_notes_where_an_ego_first_comes_to_a_lane() -> None:
    opened = OpenRun(adas_run(4, duration=5.0))
    for _ in range(30):
        opened.step()
    supervisor = opened.stage.supervisor
    assert isinstance(supervisor, Supervisor)
    supervisor.first = None  # as if there was no lane before
    ticks = opened.drive(10) + opened.drive(10)
    opened.close()
    assert supervisor.first is not None
    assert opened.quick_ticks == ticks - 1 > 0


def test_the_stepper_knows_the_truth_of_the_last_tick() -> None:
    opened = OpenRun(adas_run(4, duration=5.0))
    opened.drive(10)
    opened.drive(10)
    assert opened.quick_ticks > 0
    assert opened.stepper is not None
    assert opened.stepper.truth.tick == opened.tick
    opened.close()


def test_addresses_are_of_the_types_that_the_kernel_calls() -> None:
    """Compiled anew, the kernel asks for no machine code but that whose addresses it is given."""
    for word in (Govern.NONE, Govern.ENVELOPE):
        drive_quickly(adas_run(4, duration=3.0, govern=word))
    drive_quickly(scenario_run("lead_slowdown"))
    called = (
        advance, feel_motion, sense, read_road, think, find_ego, has_reason, heed_light, copy_actors,
        find_limits, keep_inside, play_tick,
    )  # fmt: skip
    known: list[Any] = [set(one.overloads) for one in called]  # type: ignore[attr-defined]
    kernel: Any = drive_ticks
    fresh = numba.njit(nogil=True, error_model="numpy")(kernel.py_func)
    for signature in kernel.signatures:
        fresh.compile(signature)
    assert known == [set(one.overloads) for one in called]  # type: ignore[attr-defined]
    assert all(known)


def test_a_fault_of_one_bit_is_found() -> None:
    """Else the tests above could not fail."""
    spec = adas_run(2, duration=5.0)
    one, (other, _) = drive_stepwise(spec), drive_quickly(spec)
    other.log.report.distance.view(np.int64)[57] ^= 1
    assert first_difference(one.log, other.log) == "tick 57: report.distance"


class Looker(Sink):
    """Looks at each tick."""

    def __init__(self) -> None:
        self.seen: list[int] = []

    def see(self, moment: Moment) -> None:
        self.seen.append(moment.truth.tick)


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        (structs.replace(adas_run(2), sensors=SensorLevel.PIXELS), "pixels"),
        (adas_run(2, govern=Govern.FULL), "envelope"),
        (scenario_run("front_accident", sensors=SensorLevel.PIXELS), "pixels"),
    ],
)
def test_a_run_that_has_no_quick_way_says_why(spec: RunSpec, reason: str) -> None:
    opened = OpenRun(structs.replace(spec, duration=2.0))
    opened.step()
    opened.close()
    assert opened.quick is None
    assert reason in opened.why_not_quick


def test_a_sink_that_sees_all_sees_all() -> None:
    looker = Looker()
    run, opened = drive_quickly(adas_run(2, duration=2.0), sinks=(looker,))
    assert opened.why_not_quick == "Looker is shown each tick"
    assert looker.seen == run.log.tick.tolist()


def test_a_stack_with_steps_of_another_length_is_driven_tick_by_tick() -> None:
    opened = OpenRun(adas_run(4, duration=2.0))
    opened.step()
    assert opened.driver is not None
    stack: Any = opened.driver.stack.stack
    stack.config = replace(stack.config, dt=0.02)
    while opened.drive(100):
        pass
    opened.close()
    run = opened.finish()
    assert run.quick_ticks == 0
    assert run.why_not_quick == "the steps of its stack have another length"


def test_a_supervisor_of_another_class_is_asked_in_each_tick() -> None:
    class Watchful(Unsupervised):
        pass

    spec = adas_run(4, duration=1.0)
    opened = OpenRun(spec, stage=replace(stage_of(spec), supervisor=Watchful()))
    opened.step()
    opened.close()
    assert opened.quick is None
    assert "another supervisor" in opened.why_not_quick


@pytest.mark.parametrize("govern", [Govern.NONE, Govern.ENVELOPE])
def test_a_command_out_of_range_ends_the_run_as_it_does_stepwise(govern: Govern) -> None:
    found = []
    for quickly in (False, True):
        opened = OpenRun(adas_run(2, duration=5.0, govern=govern))
        for _ in range(20):
            opened.step()
        assert opened.driver is not None
        outer: Any = opened.driver.stack.stack
        stack: Any = outer if govern is Govern.NONE else outer.inner
        stack.memory["steady_integral"] = np.nan  # from which the next brake follows
        while opened.drive(100) if quickly else opened.step() is not None:
            pass
        opened.close()
        found.append(opened.finish())
    one, other = found
    assert one.outcome == other.outcome == Outcome.AGENT_ERROR
    assert one.error.splitlines()[-1] == other.error.splitlines()[-1]
    assert not first_difference(one.log, other.log)
    if one.readings is not None:
        assert other.readings is not None
        assert one.readings.table.equals(other.readings.table)
