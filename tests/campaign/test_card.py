"""Runs on a graphics card, here on numba's simulator: logs of the CPU, as the machine code is the CPU's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from numba import typeof
from numba.core import types

import skidpad
from skidpad.campaign.driving.quick_kernel import drive_ticks
from skidpad.campaign.runs.drive import describe
from skidpad.campaign.runs.many import DEFAULTS
from skidpad.campaign.runs.run import OpenRun
from skidpad.core.errors import ConfigError
from skidpad.core.kernels.batch import call_directly, find_leaves
from skidpad.core.kernels.jit import hold

DRIVE = """
import json, sys
import skidpad
from skidpad.campaign.runs.card import Stages, drive_on_card
from skidpad.campaign.runs.many import DEFAULTS
from skidpad.campaign.runs.drive import describe
from skidpad.recording.run.log_files import log_hash

runs = [
    {"stack": stack, "seed": seed, "duration": 10.0, "vehicles": 4, "sensors": "objects"}
    for stack, seed in ((2, 1), (4, 2))
]
stages = Stages()
card = drive_on_card([describe(**{**DEFAULTS, **one}) for one in runs], stages=stages)
again = skidpad.drive_many(runs, device="cpu")
print(json.dumps({
    "card": [log_hash(run.log) for run in card], "cpu": [log_hash(run.log) for run in again],
    "ticks": stages.ticks, "all": sum(len(run.log) for run in card), "events": stages.events,
}))
"""


BY_ONE = """
import json
import skidpad
from skidpad.campaign.runs import card
from skidpad.campaign.runs.many import DEFAULTS
from skidpad.campaign.runs.drive import describe
from skidpad.recording.run.log_files import log_hash
from skidpad.simulation.recovery import Supervisor

card.ROWS = 1  # each tick is the last one of a launch, and each event in the first one of the next
places, note = [], Supervisor.pass_ticks

def pass_ticks(self, ticks, place, standing):
    places.append((ticks, *place))
    note(self, ticks, place, standing)

Supervisor.pass_ticks = pass_ticks
found = {}
for name, way in (
    ("arrived", {"duration": 40.0, "route_km": 0.05}), ("under way", {"duration": 6.0}),
):
    one = {"stack": 4, "seed": 2, "vehicles": 4, "sensors": "objects", **way}
    (run,) = card.drive_on_card([describe(**{**DEFAULTS, **one})])
    told, places[:] = list(places), []
    again = skidpad.drive(**one)
    found[name] = {
        "card": log_hash(run.log), "cpu": log_hash(again.log), "ticks": len(run.log),
        "quick": run.quick_ticks, "places": [told, list(places)],
    }
    places.clear()
print(json.dumps(found))
"""


class Inner(NamedTuple):
    x: np.ndarray
    n: int


class Outer(NamedTuple):
    inner: Inner
    again: np.ndarray
    none: None
    share: float


def simulate(text):
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    done = subprocess.run(
        [sys.executable, "-c", text],
        check=False,
        capture_output=True,
        text=True,
        env=environment,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])


def test_on_the_simulator_the_logs_are_those_of_the_cpu():
    found = simulate(DRIVE)
    assert found["card"] == found["cpu"]
    assert found["ticks"] > 0.9 * found["all"]
    assert found["events"] > 2  # so that worlds came back and went there again


def test_ends_of_ways_and_events_at_the_border_of_launches_are_those_of_the_cpu():
    for name, run in simulate(BY_ONE).items():
        assert run["card"] == run["cpu"]
        assert run["quick"] > 0.5 * run["ticks"]
        assert (run["ticks"] < 800) == (name == "arrived") or name == "under way"
        on_card, on_cpu = run["places"]
        assert on_card == on_cpu
        assert all(lane >= 0 for _, lane, _, _ in on_card)


def test_no_runs_on_a_card_with_workers_are_no_results(monkeypatch):
    monkeypatch.setattr("skidpad.core.kernels.card.require_card", lambda: None)
    assert skidpad.drive_many([], device="cuda", workers=2) == []


def test_classes_of_stacks_are_not_sent_to_workers_on_a_card(monkeypatch):
    sent = []

    def note(jobs, workers):
        sent.extend(job.argument for job in jobs)
        return []

    monkeypatch.setattr("skidpad.core.kernels.card.require_card", lambda: None)
    monkeypatch.setattr("skidpad.campaign.runs.many.run_jobs", note)
    one = {"stack": 2, "sensors": "objects", "duration": 1.0}
    with pytest.raises(KeyError):
        skidpad.drive_many([one, one], device="cuda", workers=2)
    assert [kind for part in sent for _, kind in part] == [None, None]


def test_where_a_run_raises_all_are_closed(monkeypatch):
    from skidpad.campaign.runs.card import drive_on_card

    opened = []

    class Opened(OpenRun):
        def __init__(self, spec, kind):
            if len(opened) == 2:
                raise RuntimeError("the third")
            super().__init__(spec, kind)
            opened.append(self)

    monkeypatch.setattr("skidpad.campaign.runs.card.OpenRun", Opened)
    one = {"stack": 2, "sensors": "objects", "duration": 1.0}
    with pytest.raises(RuntimeError, match="the third"):
        drive_on_card([describe(**{**DEFAULTS, **one})] * 3)
    assert [run.over for run in opened] == [True, True]


def test_without_a_card_a_sentence_says_so(monkeypatch):
    monkeypatch.setattr("numba.cuda.is_available", lambda: False)
    one = {"stack": 2, "sensors": "objects", "duration": 1.0}
    with pytest.raises(ConfigError, match="needs an NVIDIA card and its driver"):
        skidpad.drive_many([one], device="cuda")


def test_an_array_that_stands_twice_in_a_value_is_one_leaf():
    x = np.arange(3.0)
    leaves = find_leaves(Outer(Inner(x, 7), x, None, 0.5))
    assert leaves.paths == ("inner.x",)
    assert leaves.source.endswith("(a0, i[0]), a0, None, f[1])")
    assert find_leaves(hold(Inner(x, 7))).source.startswith("Inside(")


def test_an_array_with_gaps_is_refused():
    with pytest.raises(ValueError, match="inner.x must be C-contiguous, got strides"):
        find_leaves(Outer(Inner(np.arange(6.0)[::2], 7), np.arange(3.0), None, 0.5))


def test_numbers_of_numpy_are_floats_where_they_are():
    leaves = find_leaves((np.float32(0.5), np.float64(0.25), 3))
    assert leaves.source == "(f[0], f[1], i[2],)"
    floats, ints = leaves.number_arrays()
    assert (floats.tolist(), ints.tolist()) == ([0.5, 0.25, 0.0], [0, 0, 3])


class Key(NamedTuple):
    key: np.uint64
    n: int


def test_an_unsigned_number_that_is_held_stays_unsigned():
    # as a signed one its shifts keep the sign, and random numbers of a card are not those of a CPU
    key = np.uint64(2**63 + 5)
    leaves = find_leaves(hold((Key(key, 7), hold(Key(key, 8)))))
    assert leaves.source.count("Key(uint64(i[") == 2
    assert leaves.number_arrays()[1].astype(np.uint64).tolist() == [key, 7, key, 8]


def count_unsigned(typed):
    if isinstance(typed, types.StructRef):
        return sum(count_unsigned(kind) for _, kind in typed._fields)
    if isinstance(typed, types.BaseTuple):
        return sum(count_unsigned(kind) for kind in typed.types)
    return int(typed == types.uint64)


def test_all_unsigned_numbers_of_a_run_stay_unsigned():
    run = OpenRun(*describe(**{**DEFAULTS, "stack": 4, "sensors": "objects", "duration": 5.0}))
    call = None
    while call is None:  # the first tick is driven by itself
        call = next(run.ask(50), None)
    run.close()
    assert count_unsigned(typeof(call.joined)) >= 1  # the radar's
    assert find_leaves(call.joined).source.count("uint64(") == count_unsigned(typeof(call.joined))


def test_calls_by_address_become_plain_calls():
    compiled = []
    call_directly(drive_ticks, lambda one: compiled.append(one) or one)
    names = {one.__name__ for one in compiled}
    assert {"drive_ticks", "step_world", "answer_tick"} <= names
    assert all("call" not in one.__code__.co_names for one in compiled)
