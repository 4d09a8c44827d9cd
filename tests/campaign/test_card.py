"""Runs on a graphics card, here on numba's simulator: logs of the CPU, as the machine code is the CPU's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

import skidpad
from skidpad.campaign.driving.quick_kernel import drive_ticks
from skidpad.core.errors import ConfigError
from skidpad.core.kernels.batch import call_directly, find_leaves
from skidpad.core.kernels.jit import hold

DRIVE = """
import json, sys
import skidpad
from skidpad.campaign.runs.card import Stages, drive_on_card
from skidpad.campaign.runs.many import DEFAULTS
from skidpad.campaign.runs.run import describe
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


class Inner(NamedTuple):
    x: np.ndarray
    n: int


class Outer(NamedTuple):
    inner: Inner
    again: np.ndarray
    none: None
    share: float


def test_on_the_simulator_the_logs_are_those_of_the_cpu():
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    done = subprocess.run(
        [sys.executable, "-c", DRIVE],
        check=False,
        capture_output=True,
        text=True,
        env=environment,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["card"] == found["cpu"]
    assert found["ticks"] > 0.9 * found["all"]
    assert found["events"] > 2  # so that worlds came back and went there again


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


def test_calls_by_address_become_plain_calls():
    compiled = []
    call_directly(drive_ticks, lambda one: compiled.append(one) or one)
    names = {one.__name__ for one in compiled}
    assert {"drive_ticks", "step_world", "answer_tick"} <= names
    assert all("call" not in one.__code__.co_names for one in compiled)
