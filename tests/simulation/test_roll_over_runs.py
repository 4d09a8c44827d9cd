"""Roll-over in a run: the world tells it once, the log keeps it, and a scenario's outcome says it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from skidpad.campaign.driving.run_setup import Stage, stage_of
from skidpad.campaign.runs.run import outcome_of
from skidpad.core.settings.parts import Settings
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.grip.scores import grip_metrics
from skidpad.recording.run.events import RolledOver, decode_events, encode_events
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support import makelog
from support.runs import adas_run


def test_the_world_tells_a_roll_over_once_and_a_new_place_ends_it() -> None:
    spec = adas_run(2, settings=Settings().with_values({"roll_over": True}), duration=5.0)
    setup = stage_of(spec).setup
    backend = EmbeddedBackend()
    ego = replace(setup.ego, type="truck", speed=20.0, collides=False)
    backend.reset(replace(setup, ego=ego, traffic=None), spec.seed)
    start, told = backend.truth().states.pose(0), []
    for _ in range(100):
        backend.step(VehicleCommand(throttle=0.5, steer=0.3))
        told += backend.truth().rolled
    assert told == [0]
    assert abs(float(backend.truth().states.roll[0])) == pytest.approx(np.pi / 2, abs=0.1)
    backend.relocate(start, 5.0)
    backend.step(VehicleCommand())
    assert backend.truth().rolled == ()
    assert abs(float(backend.truth().states.roll[0])) < 0.1
    backend.close()


def test_the_event_is_read_as_it_was_written() -> None:
    events = (RolledOver(7, 0), RolledOver(9, 3))
    assert decode_events(encode_events(events)) == events


@pytest.mark.parametrize(
    ("actor", "player", "was", "expected"),
    [
        (0, True, Outcome.COMPLETED, Outcome.ROLL_OVER),
        (0, True, Outcome.NOT_TRIGGERED, Outcome.ROLL_OVER),
        (0, True, Outcome.COLLISION, Outcome.COLLISION),
        (1, True, Outcome.COMPLETED, Outcome.COMPLETED),
        (0, False, Outcome.COMPLETED, Outcome.COMPLETED),
    ],
)
def test_the_outcome_of_a_scenario(
    actor: int, player: bool, was: Outcome, expected: Outcome
) -> None:
    log = replace(makelog.drive(3, lambda _k: [{}, {}]), events=(RolledOver(1, actor),))
    stage: Any = SimpleNamespace(player=object() if player else None, outcome=was)
    assert outcome_of(cast("Stage", stage), log) is expected


def test_a_roll_over_does_not_complete_a_route() -> None:
    log = makelog.drive(11, lambda k: [{"x": k, "vx": 20.0}, {"x": 50.0}])
    m = grip_metrics(log, Outcome.ROLL_OVER, triggered=True, route_length=40.0, ratio=1.0)
    assert (m.completion, m.route_completion) == (False, pytest.approx(25.0))
