"""One stack drives several runs together: each is the drive that it would be alone."""

from __future__ import annotations

import numpy as np
import pytest

import skidpad
from skidpad.core.errors import ConfigError
from skidpad.core.states import VehicleCommand
from skidpad.recording.run.log_files import log_hash

ROAD = {"sensors": "objects", "duration": 2.0}


class Alone:
    """Goes with the pedal that its settings say, and steers a little by the tick."""

    def __init__(self, specs, map, settings):
        self.pedal = settings["pedal"]

    def tick(self, frame):
        return VehicleCommand(throttle=self.pedal, steer=0.01 * (frame.tick % 3) - 0.01)


class Together:
    """Asks an `Alone` for each run; notes how many frames came in each call."""

    def __init__(self, fail_at=None, forget=None):
        self.runs, self.calls, self.fail_at, self.forget = {}, [], fail_at, forget

    def begin(self, run, specs, map, settings):
        if settings["pedal"] is None:
            raise ValueError("no pedal")
        self.runs[run] = Alone(specs, map, settings)

    def tick(self, frames):
        self.calls.append(sorted(frames))
        if len(self.calls) == self.fail_at:
            raise RuntimeError("the network is gone")
        return {k: self.runs[k].tick(f) for k, f in frames.items() if k != self.forget}


def one(stack, seed, pedal, **more):
    return {"stack": stack, "seed": seed, "stack_settings": {"pedal": pedal}, **ROAD, **more}


def test_runs_of_one_stack_are_driven_as_each_is_alone():
    vector = Together()
    asked = [(1, 0.3, {}), (2, 0.8, {"weather": "icy_30"}), (1, 0.3, {"duration": 1.0})]
    runs = [one(vector, seed, pedal, **more) for seed, pedal, more in asked]
    runs.insert(1, one(Alone, 2, 0.8, weather="icy_30"))
    first, own, second, short = skidpad.drive_many(runs)
    assert [len(run.log) for run in (first, own, second, short)] == [40, 40, 40, 20]
    assert vector.calls == [[0, 2, 3]] * 20 + [[0, 2]] * 20
    for column, alone in zip(second.log.actors, own.log.actors, strict=True):
        np.testing.assert_array_equal(column, alone)
    assert second.outcome is own.outcome
    apart = skidpad.drive_many([one(Together(), 2, 0.8, weather="icy_30")], judge=lambda r: r.log)
    assert log_hash(apart[0]) == log_hash(second.log)


def test_what_the_stack_does_wrong_is_the_outcome_of_its_runs():
    failing = Together(fail_at=11)
    for run in skidpad.drive_many([one(failing, seed, 0.3) for seed in (1, 2)]):
        assert run.outcome.value == "agent_error"
        assert len(run.log) == 10
        assert "the network is gone" in run.error
    forgetful = Together(forget=1)
    good, bad = skidpad.drive_many([one(forgetful, seed, 0.3) for seed in (1, 2)])
    assert (good.outcome.value, bad.outcome.value) == ("completed", "agent_error")
    assert "tick(frames) gave no command for run 1" in bad.error
    bad, good = skidpad.drive_many([one(Together(), 1, pedal) for pedal in (None, 0.3)])
    assert (good.outcome.value, bad.outcome.value) == ("completed", "agent_error")
    assert "no pedal" in bad.error


def test_it_drives_in_one_process():
    with pytest.raises(ConfigError, match="drives several runs together needs workers=1"):
        skidpad.drive_many([one(Together(), 1, 0.3)], workers=2)
