"""The kernels of a tick count no references: one that is counted there costs as much as a division."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.campaign.driving import quick_kernel
from skidpad.campaign.runs.run import run
from skidpad.core.kernels.jit import hold
from skidpad.recording.run import ticks
from skidpad.sensors.object_level import objects
from skidpad.simulation import recovery, standing
from skidpad.simulation.world import feel, step
from skidpad.stack import road, think
from skidpad.stack.perception import hsv, lights
from support.refcounts import counts_references
from support.runs import adas_run


@pytest.fixture(scope="module", autouse=True)
def drive() -> None:
    """Every kernel of the tick is called."""
    run(adas_run(4, duration=12.0))


@pytest.mark.parametrize(
    "compiled",
    [
        step.advance,
        feel.feel_motion,
        objects.sense,
        road.read_road,
        think.think,
        recovery.find_ego,
        ticks.copy_actors,
        lights.heed_light,
        quick_kernel.drive_ticks,
    ],
    ids=lambda compiled: compiled.py_func.__name__,
)
def test_a_kernel_of_the_tick_counts_nothing(compiled: object) -> None:
    assert not counts_references(compiled)


def test_kernels_in_which_arrays_are_made_count() -> None:
    """Else the test above could not fail."""
    hsv.keep_large(np.zeros(1, np.int32), np.zeros((2, 2), np.uint8))
    assert counts_references(hsv.keep_large)


def test_the_supervisors_kernel_counts_nothing() -> None:
    states = step.ActorStates.empty(3)
    assert not standing.has_actor_ahead(hold(states), 0.0, 0.0, 0.0, 0.0)
    assert not counts_references(standing.has_actor_ahead)


def test_the_kernel_that_asks_why_the_ego_stands_counts_nothing() -> None:
    run(
        adas_run(2, duration=12.0, vehicles=0)
    )  # its machine code is looked up with that of the others
    assert not counts_references(standing.has_reason)
