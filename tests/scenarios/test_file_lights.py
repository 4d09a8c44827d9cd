"""Traffic signals that a file sets: the road's lights show them, and the stack obeys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.vocabulary import LightState
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import LanePoint
from skidpad.scenarios.signals import read_signal_state
from support.scenarios.files import (
    at,
    by_value,
    event,
    init,
    speed,
    story,
    teleport,
    time,
    to,
    write,
)

TOWN = '<LogicFile filepath="town.xodr"/>'
LIGHT, BEFORE = 1001, 60.0  # signal of a crossing; m


def stop_line() -> LanePoint:
    map = load_map("town")
    row = int(np.flatnonzero(map.signals.id == LIGHT)[0])
    return map.at(int(map.signals.lane[row]), float(map.signals.s[row]))


def switch(name: str, state: str) -> str:
    return f"""<GlobalAction><InfrastructureAction><TrafficSignalAction><TrafficSignalStateAction
name="{name}" state="{state}"/></TrafficSignalAction></InfrastructureAction></GlobalAction>"""


def driven(folder: Path, *events: str, end: float) -> RunLog:
    """Our stack with its light assist, at 12 m/s towards the light."""
    begin = load_map("town").behind(stop_line(), BEFORE)
    assert begin is not None
    place = f'<WorldPosition x="{begin.x}" y="{begin.y}" z="0" h="{begin.heading}"/>'
    ego = init("ego", teleport(place), speed(to(12)))
    file = write(
        folder, road=TOWN, init=ego + at("other", -1, 5, 0), stories=story(*events), end=end
    )
    done = CliRunner().invoke(
        app, ["play", str(file), "--out", str(folder / "out"), "--stack", "3"]
    )
    assert done.exit_code == 0, done.output
    return read_log(folder / "out")


def past_the_line(log: RunLog) -> np.ndarray:
    """(T,) m of the ego beyond the stop line."""
    line = stop_line()
    dx, dy = log.actors.x[:, 0] - line.x, log.actors.y[:, 0] - line.y
    return np.asarray(dx * np.cos(line.heading) + dy * np.sin(line.heading))


@pytest.mark.osc("TrafficSignalStateAction")
@pytest.mark.parametrize(("name", "state"), [("1001", "red"), ("id=1001", "on;off;off")])
def test_the_stack_waits_at_a_light_that_the_file_turns_red(tmp_path, name, state):
    log = driven(tmp_path, event("red", switch(name, state), time(0.0)), end=25.0)
    beyond = past_the_line(log)
    assert beyond.max() < 0.5
    assert beyond[-1] > -15.0
    assert np.hypot(log.actors.vx[-1, 0], log.actors.vy[-1, 0]) < 0.3


@pytest.mark.osc("TrafficSignalStateAction")
def test_it_goes_when_the_file_turns_it_green_however_late_that_is(tmp_path):
    red = event("red", switch("1001", "red"), time(0.0))
    green = event("green", switch("1001", "green"), time(20.0))
    log = driven(tmp_path, red, green, end=32.0)
    beyond = past_the_line(log)
    assert beyond[: round(20.0 / 0.05)].max() < 0.5
    assert beyond[-1] > 5.0


@pytest.mark.osc("TrafficSignalCondition")
def test_a_condition_sees_the_roads_own_light(tmp_path):
    """Nobody sets it: within a cycle it has been red and green."""
    seen = '<TrafficSignalCondition name="{}" state="{}"/>'
    told = [
        event(colour, switch("77", "seen"), by_value(seen.format(LIGHT, colour)))
        for colour in ("red", "green", "blue")
    ]
    driven(tmp_path, *told, end=50.0)
    story_of = (tmp_path / "out" / "storyboard.csv").read_text(encoding="utf-8")
    begun = {c for c in ("red", "green", "blue") if f"manoeuvre::{c},startTransition" in story_of}
    assert begun == {"red", "green"}


@pytest.mark.parametrize(
    ("state", "seen"),
    [
        ("red", LightState.RED), ("GREEN", LightState.GREEN), ("off", LightState.OFF),
        ("on;off;off", LightState.RED), ("on;on;off", LightState.RED),
        ("off;flashing;off", LightState.YELLOW), ("off; off; on", LightState.GREEN),
        ("off;off;off", LightState.OFF), ("go", None), ("unknown", None), ("on;off", None), ("", None),
    ],
)  # fmt: skip
def test_a_state_is_a_colour_three_lamps_or_a_word(state, seen):
    assert read_signal_state(state) is seen
