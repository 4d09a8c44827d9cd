"""A refusal is one line, whatever names a stranger chose for his fields."""

from __future__ import annotations

import json

import numpy as np
import pytest

from skidpad.core.errors import SkidpadError
from skidpad.core.settings.parts import Settings
from skidpad.core.text.told import LONGEST
from skidpad.fleet.alerting.keeping import parse_alert
from skidpad.fleet.batch import drive_of
from skidpad.live.outcome import LINK, read_outcome
from skidpad.recording.channels.monitored import SUMMARY, read_summary
from skidpad.recording.run.inputs import decode_inputs
from skidpad.roads.baked import load_baked

NAME = "a\nb"
SCENE = {"map": "town", "ego": {"x": 1.0, "y": 2.0, "heading": 0.5}, "v": 12.5}
ALERT = {"kind": "hazard", "text": "near", "scene": SCENE}


def refusal(read, *arguments):
    with pytest.raises(SkidpadError) as refused:
        read(*arguments)
    return str(refused.value)


def test_of_an_alert():
    said = refusal(parse_alert, json.dumps(ALERT | {NAME: 1}).encode())
    assert "unknown field" in said
    assert "\n" not in said


def test_of_what_a_person_did():
    said = refusal(decode_inputs, json.dumps({"tick": 1, NAME: 1}).encode())
    assert "unknown field" in said
    assert "\n" not in said


def test_of_a_setting_with_an_endless_word():
    said = refusal(Settings().with_values, {"lane_truth": "x" * 200_000 + "\ud800"})
    assert len(said) <= LONGEST
    assert "choose one of" in said
    said.encode()


def test_of_a_baked_map(tmp_path):
    np.savez(tmp_path / "a.npz", about=json.dumps({"format": NAME}))
    said = refusal(load_baked, tmp_path / "a.npz")
    assert "baked in format" in said
    assert "\n" not in said


def test_of_a_drive():
    said = refusal(
        drive_of, json.dumps({"seconds": 1.0, "cycles": 10, "context": {NAME: 1}}).encode()
    )
    assert "\n" not in said


@pytest.mark.parametrize("content", [b"\xff", b"[" * 5000, b"[]", b'{"cycles": "a"}'])
def test_of_what_a_monitor_left(tmp_path, content):
    (tmp_path / LINK).write_bytes(content)
    (tmp_path / SUMMARY).write_bytes(content if content != b'{"cycles": "a"}' else b"1")
    assert "\n" not in refusal(read_outcome, tmp_path)
    assert "\n" not in refusal(read_summary, tmp_path)
