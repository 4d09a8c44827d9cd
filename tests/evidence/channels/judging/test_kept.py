"""What was found in a recording is kept beside it and read again only while it holds."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.judging import kept
from skidpad.evidence.channels.judging.evaluation import Evaluation
from skidpad.evidence.channels.judging.kept import segment_bytes, segment_from
from skidpad.evidence.channels.judging.segments import Segment, judge
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive

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


def test_the_code_has_one_hash_as_long_as_code_and_rules_are_the_same(tmp_path, monkeypatch):
    """A copy elsewhere has the same hash; another byte, name or file of rules has another."""

    def hash_of(name: str, **texts: str) -> str:
        folder = tmp_path / name
        folder.mkdir()
        for stem, text in texts.items():
            folder.joinpath(stem.replace("__", ".")).write_text(text)
        monkeypatch.setattr(kept, "FOLDER", folder)
        return kept.code_hash.__wrapped__()

    first = hash_of("first", a__py="x = 1\n", rules__yaml="limit: 3\n")
    assert hash_of("copy", rules__yaml="limit: 3\n", a__py="x = 1\n", notes__md="z") == first
    others = [
        hash_of("code", a__py="x = 2\n", rules__yaml="limit: 3\n"),
        hash_of("rules", a__py="x = 1\n", rules__yaml="limit: 4\n"),
        hash_of("name", b__py="x = 1\n", rules__yaml="limit: 3\n"),
        hash_of("more", a__py="x = 1\n", rules__yaml="limit: 3\n", b__py=""),
    ]
    assert len({first, *others}) == 5


@pytest.mark.req("C-233")
def test_shares_of_a_module_are_against_its_maximum_on_the_route():
    """By hand: 10 ms is the greatest of the route, so 8 ms of the other drive is not within 90 %."""

    def timed(name, route, total, comfort):
        times = np.column_stack([total, comfort, comfort, comfort])
        return Segment(name, route, 1.0, {"practical": ()}, {}, {}, 0, {}, (), times=times)

    rows = Evaluation(
        [
            timed("a", "coast", [20.0, 26.0, 12.0, 24.0], [10.0, 9.5, 4.0, 3.0]),
            timed("b", "coast", [20.0, 20.0, 20.0, 20.0], [8.0, 8.0, 4.0, 9.0]),
            timed("c", "town", [1.0, 1.0, 1.0, 1.0], [8.0, 8.0, 4.0, 2.0]),
        ]
    ).segment_table()
    assert rows["comfort_within_90_pct"].to_list() == [50.0, 25.0, 50.0]
    assert rows["comfort_under_50_pct"].to_list() == [50.0, 25.0, 25.0]
    assert rows["comfort_breaches_pct"].to_list() == [0.0, 0.0, 0.0]
    assert rows["total_breaches_pct"].to_list() == [25.0, 0.0, 0.0]
    assert rows["total_within_90_pct"].to_list() == [25.0, 0.0, 0.0]
