"""A story that a kernel plays as a table goes as the same story in Python, tick by tick, to the bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenario_catalogue import SCENARIOS, file_name
from skidpad.campaign.cells.grip import template
from skidpad.campaign.driving.backends import make_backend
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.states import VehicleCommand
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.playing.player import Player
from skidpad.scenarios.playing.table import StoryTable
from skidpad.scenarios.shipped import FOLDER
from skidpad.scenarios.triggers import Edge
from support.oracle.cases import CASES
from support.oracle.reference import write_case
from support.scenarios.files import (
    at,
    by_entity,
    condition,
    event,
    private,
    speed,
    state,
    story,
    time,
    to,
    write,
)

LOOKS = 50  # ticks between two looks at all that is known of every actor
LONGEST = 500  # ticks
AHEAD = VehicleCommand(throttle=0.3, steer=0.001)
NO_TABLE = (
    "goes backwards", "put where the file says", "along a trajectory", "is towed", "on no lane or on a route",
    "with its place or axes", "condition: Reaches", "condition: Clearance", "condition: Angle",
    "change: ChangeOfSpeed", "change: GapKept", "change: DistanceKept", "change: Synchronized",
    "change: SmoothProfile", "change: Profiled",
)  # fmt: skip
GUIDE = ("v", "a", "pace", "offset", "offset_rate", "offset_bend", "adds_offset", "at_end", "base")
ACTOR = (
    "motion", "pose", "a", "acceleration", "travelled", "stood", "at_end", "present", "word", "seen",
)  # fmt: skip


def play_both(file, mode=ActorMode.PHYSICAL, ego=None, ticks=LONGEST, command=AHEAD):
    """Plays a file both ways in one world; returns the player with tables, and how many ticks it played."""
    spec = template(course=Scenario(file=str(file), actors=mode))
    stage = stage_of(spec)
    compiled = stage.player.scenario
    modes = {**dict.fromkeys(compiled.entities, mode), compiled.ego: ego}
    table, python = (
        Player(compiled, modes=modes, duration=40.0, tables=tables) for tables in (True, False)
    )
    backend = make_backend(spec.backend)
    backend.reset(replace(stage.setup, specs=()), 1)
    for tick in range(ticks):
        truth = backend.truth()
        words = python.step(truth)
        assert list(table.step(truth)) == list(words), tick
        assert table.scene.t == python.scene.t
        assert (table.ended, table.hit) == (python.ended, python.hit)
        assert table.scene.story == python.scene.story, tick
        if python.ended or (tick + 1) % LOOKS == 0:
            assert states_of(table) == states_of(python), tick
        if python.ended:
            break
        backend.step(command, words)
    assert python.by_table == 0
    assert table.played.staging == python.played.staging
    return table, tick + 1


def states_of(player):
    """Returns all that changes about a player and its actors."""
    actors = player.actors.values()
    return (
        player.way_back, player.scene.moves, player.scene.notices,
        [[getattr(a, name) for name in ACTOR] for a in actors],
        [[getattr(a.guide, name) for name in GUIDE] for a in actors],
    )  # fmt: skip


@pytest.mark.parametrize("ego", [None, ActorMode.PHYSICAL])
@pytest.mark.parametrize("version", OscVersion)
@pytest.mark.parametrize("name", [s.name for s in SCENARIOS])
def test_a_shipped_scenario_is_played_as_in_python(name, version, ego):
    player, ticks = play_both(FOLDER / file_name(name, version), ego=ego)
    assert player.reason == ""
    assert player.by_table > 0.7 * ticks > 30  # with a look every so many ticks
    assert player.played.table.by_table == player.by_table
    assert len(player.scene.story) > 8


def test_a_planted_fault_of_one_bit_is_found(monkeypatch):
    """Else the tests of this file could not fail."""
    play = StoryTable.play

    def play_wrong(table, truth):
        words = play(table, truth)
        x = table.rows.actors["x"]
        x[-1] = np.nextafter(x[-1], np.inf)
        return words

    monkeypatch.setattr(StoryTable, "play", play_wrong)
    with pytest.raises(AssertionError):
        play_both(FOLDER / file_name("lead_slowdown", OscVersion.V1_2), ticks=LOOKS)


@pytest.mark.parametrize("name", sorted(CASES)[::5])
def test_a_file_of_the_oracle_is_played_as_in_python(tmp_path, name):
    play_case(name, tmp_path)


@pytest.mark.parametrize("name", sorted(set(CASES) - set(sorted(CASES)[::5])))
def test_each_other_file_of_the_oracle_is_played_as_in_python(tmp_path, name):
    play_case(name, tmp_path)


def play_case(name, folder):
    """Plays a file of the oracle both ways, mostly by tables unless it has what none can hold."""
    player, ticks = play_both(write_case(name, folder), ego=ActorMode.PHYSICAL, ticks=240)
    if player.reason:
        assert player.reason.endswith(NO_TABLE)
    else:
        assert player.by_table > 0.5 * ticks


def test_edges_delays_and_collisions_are_waited_for(tmp_path):
    """The other car brakes after 2 s, goes on 1.5 s after it stands; the ego does not brake and hits it."""
    stands = by_entity('<SpeedCondition value="0.05" rule="lessThan"/>', "other")
    hit = by_entity('<CollisionCondition><EntityRef entityRef="other"/></CollisionCondition>')
    late = event("late", private(speed(to(3), "linear", 1)), "{}").replace(
        condition("{}"), condition(stands, "rising", 1.5)
    )
    file = write(
        tmp_path,
        init=at("ego", -1, 30, 8) + at("other", -1, 75, 8),
        stories=story(
            event("stop", private(speed(to(0), "cubic", 2)), time(2)),
            late,
            event("hit", private(speed(to(1), "linear", 1)), hit),
        ),
        end=14.0,
    )
    player, ticks = play_both(file, ego=ActorMode.PHYSICAL)
    what = [h.path[-1] for h in player.scene.story if h.what == "startTransition"]
    assert [name for name in what if name in ("stop", "late", "hit")] == ["stop", "late", "hit"]
    assert player.reason == ""
    assert 0.5 * ticks < player.by_table < ticks


@pytest.mark.parametrize(
    ("body", "edge"),
    [
        (time(1), "rising"),
        (time(1, "lessThan"), "falling"),
        (state("event", "first", "endTransition"), "none"),
    ],
)
def test_a_pulse_comes_out_of_its_delay_as_short_as_it_went_in(tmp_path, body, edge):
    first = event("first", private(speed(to(9))), time(1))
    late = event("late", private(speed(to(3), "linear", 1)), "{}").replace(
        condition("{}"), condition(body, edge, 0.8)
    )
    file = write(
        tmp_path,
        init=at("ego", -1, 30, 8) + at("other", -1, 75, 8),
        stories=story(first, late),
        end=6.0,
    )
    player, ticks = play_both(file, ego=ActorMode.PHYSICAL)
    said = [h.t for h in player.scene.story if h.path[-1:] == ("late",) and "condition" in h.what]
    assert len(said) == 2
    assert said[1] - said[0] == pytest.approx(player.scene.dt)
    assert player.reason == ""
    assert 0.5 * ticks < player.by_table < ticks


@pytest.mark.parametrize("delay", [0.0, 0.8])
@pytest.mark.parametrize("edge", Edge)
@pytest.mark.parametrize(
    "body",
    [
        state("event", "first", "startTransition"),
        state("event", "first", "endTransition"),
        time(1, "equalTo"),
    ],
    ids=["start", "end", "moment"],
)
def test_what_holds_for_one_tick_ends_in_time(tmp_path, body, edge, delay):
    """Its event waits for another condition, too, so that it is looked at until the end."""
    waits = condition(body, edge.value, delay) + condition(time(99))
    late = event("late", private(speed(to(3))), "{}").replace(
        condition("{}"), waits.replace("</ConditionGroup><ConditionGroup>", "")
    )
    file = write(
        tmp_path,
        init=at("ego", -1, 30, 8) + at("other", -1, 75, 8),
        stories=story(event("first", private(speed(to(9), "linear", 0.5)), time(1)), late),
        end=3.0,
    )
    player, ticks = play_both(file, ego=ActorMode.PHYSICAL)
    said = [h for h in player.scene.story if h.path[-1:] == ("late",) and "condition" in h.what]
    assert [h.what for h in said] == ["condition c holds", "condition c ends"]
    held = 2 if edge is Edge.BOTH else 1
    assert said[1].t - said[0].t == pytest.approx(held * player.scene.dt)
    assert player.reason == ""
    assert 0.5 * ticks < player.by_table < ticks


def test_a_way_back_counts_while_a_table_plays(tmp_path):
    """The file asks the ego to go backwards, and it does, before anybody has looked at the actors."""
    asked = story(event("back", private(speed(to(-2))), time(9)), actor="ego")
    start = at("ego", -1, 50, 0) + at("other", -1, 120, 8)
    file = write(tmp_path, init=start, stories=asked, end=10.0)
    back = VehicleCommand(throttle=0.6, reverse=True)
    player, ticks = play_both(file, ticks=LOOKS - 1, command=back)
    assert player.by_table > 0.8 * ticks
    assert player.way_back > 1.0
    assert not player.played.staging.unreversed


def test_what_no_table_can_hold_is_named(tmp_path):
    player, _ = play_both(FOLDER / "lead_slowdown.xosc", mode=ActorMode.IDEAL, ticks=80)
    assert player.by_table == 0
    assert player.played.table.reason == "lead is put where the file says"
