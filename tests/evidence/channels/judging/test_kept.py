"""What was found in a recording is kept beside it and read again only while it holds."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from channel_worlds import Eyes, World, drive
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.judging.evaluation import Evaluation
from skidpad.evidence.channels.judging.kept import code_hash, segment_bytes, segment_from
from skidpad.evidence.channels.judging.segments import judge
from skidpad.recording.cycles import cycles

MADE_BY = {"code": "a", "curve": "gap"}


@pytest.fixture(scope="module")
def segment():
    world = World((0, 0, 0, 15.0, 0), np.array([(-10.5, 0, 0, 15.7, 0), (60, 3.5, 0, 15, 0)]))
    eyes = (Eyes("a", 0.05), Eyes("b", 0.05, blind=(0,), ego_offset={3.0: (2.6, 0.0)}))
    source = drive(world, eyes, 6.0)
    context = {"seed": "7", "sun_altitude_deg": "-5", "stratum": "risky"}
    return judge("a.mcap", "route-1", source.channels, list(cycles(source)), curve=Signal.GAP,
                 context=context)  # fmt: skip


def test_a_segment_comes_back_as_it_was(segment):
    again = segment_from(segment_bytes(segment, MADE_BY), MADE_BY)
    for field in dataclasses.fields(segment):
        before, after = getattr(segment, field.name), getattr(again, field.name)
        if isinstance(before, np.ndarray):
            np.testing.assert_array_equal(before, after)
        else:
            assert before == after, field.name
    assert Evaluation([again]).as_dict() == Evaluation([segment]).as_dict()
    assert segment.truths["sim"]
    assert segment.mistakes
    assert again.points == segment.points


@pytest.mark.parametrize("changed", [{"code": "b"}, {"curve": ""}, {"more": "x"}])
def test_what_other_code_or_options_found_is_not_taken(segment, changed):
    assert segment_from(segment_bytes(segment, MADE_BY), MADE_BY | changed) is None


def test_a_damaged_file_is_not_taken(segment):
    data = segment_bytes(segment, MADE_BY)
    assert segment_from(data[:200], MADE_BY) is None
    assert segment_from(b"", MADE_BY) is None
    assert segment_from(data.replace(b"text.npy", b"tixt.npy"), MADE_BY) is None


def test_the_code_has_one_name_as_long_as_it_is_the_same():
    assert code_hash() == code_hash()
    assert len(code_hash()) == 64
