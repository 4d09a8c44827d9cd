"""The text record of hazards: decode(encode(x)) = x in its resolution, its size, its damage."""

from __future__ import annotations

import contextlib
import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from skidpad.core.channels import Cycle
from skidpad.core.errors import FileError
from skidpad.core.vocabulary import HazardType
from skidpad.fleet.batch import hazards_of
from skidpad.fleet.words import Limits, Refused
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.hazards.records import (
    HazardRecord,
    HazardWriter,
    InvolvedObject,
    decode_record,
    encode_record,
    read_hazards,
    read_index,
)
from skidpad.recording.hazards.text import HEADER
from support.channel_worlds import Eyes, World, drive, frame, traffic
from support.examples import examples


def record(worlds, channels=("a", "b"), **more):
    return HazardRecord(
        **{
            "id": "h0001", "type": HazardType.EGO_TAILGATED, "profile": "practical",
            "forms": "corrected", "t_start": 5.0, "t_end": 6.0, "t_worst": 5.5, "count": 11,
            "extremes": {"gap": 0.4}, "channels": channels, "driving": "a", "involved": ("b",),
            "objects": (InvolvedObject("b", 3, 1.0, 2.0), InvolvedObject("a", None, 0.0, 0.0)),
            "flags": ("assumed",), "context": {"route": "Ring ü\n1"}, "worlds": tuple(worlds),
        }
        | more
    )  # fmt: skip


def worlds_of(n_objects, seconds=11.0, noise=0.1, channels=2):
    eyes = tuple(Eyes(f"c{i}", noise, blind=(i,)) for i in range(channels))
    world = World((2e5, -3e5, 0.3, 9.0, 3.0), traffic(n_objects) + np.array([2e5, -3e5, 0, 0, 0]))
    return [c._replace(truth=None) for c in cycles(drive(world, eyes, seconds))]


def close(a: Cycle, b: Cycle, paths: bool):
    assert b.t == pytest.approx(a.t, abs=6e-4)
    for one, two in zip(a.frames, b.frames, strict=True):
        assert (one is None) == (two is None)
        if one is None:
            continue
        assert two.t == pytest.approx(one.t, abs=2e-3)
        assert two.ego == pytest.approx(one.ego, abs=5.1e-3, nan_ok=True)
        assert two.objects == pytest.approx(one.objects, abs=5.1e-3, nan_ok=True)
        assert np.array_equal(one.ids, two.ids)
        assert np.array_equal(one.classes, two.classes)
        assert two.polygons == pytest.approx(one.polygons, abs=0.056, nan_ok=True)
        if paths:
            assert two.plan == pytest.approx(one.plan, abs=5.1e-3, nan_ok=True)
            if len(one.objects) == 0:
                continue
            assert two.predictions == pytest.approx(one.predictions, abs=5.1e-3, nan_ok=True)


@pytest.mark.req("C-150", "C-156", "C-158")
def test_a_record_comes_back_in_its_resolution():
    worlds = worlds_of(6)
    again = decode_record(encode_record(record(worlds)))
    original = record(worlds)
    for name in HazardRecord.__struct_fields__:
        if name != "worlds":
            assert getattr(again, name) == getattr(original, name), name
    for k, (a, b) in enumerate(zip(worlds, again.worlds, strict=True)):
        close(a, b, paths=k % 5 == 0)
    assert len(again.worlds[1].frames[0].plan) == 0  # plans come each 0.5 s
    assert encode_record(decode_record(encode_record(again))) == encode_record(again)


@pytest.mark.req("C-150")
@pytest.mark.parametrize(("objects", "limit"), [(5, 50_000), (20, 200_000)])
def test_the_size_of_a_record(objects, limit):
    text = encode_record(record(worlds_of(objects, 11.0)))
    assert len(text) <= limit


number = st.one_of(st.floats(-1e6, 1e6), st.just(float("nan")))


@st.composite
def strange_frames(draw, t):
    n = draw(st.integers(0, 4))
    f = frame(t, (0, 0, 0, 1, 0), np.zeros((n, 5)))
    size = np.array([draw(st.integers(0, 5)) for _ in range(n)], dtype=np.int64)
    polygons = np.full((n, int(size.max(initial=0)), 2), np.nan)
    for row, k in zip(polygons, size, strict=True):
        row[:k] = np.array([draw(number) for _ in range(2 * k)]).reshape(k, 2)
    named = draw(st.booleans())
    return f._replace(
        ego=np.array([draw(number) for _ in range(5)]),
        objects=np.array([draw(number) for _ in range(5 * n)]).reshape(n, 5),
        polygons=polygons,
        polygon_size=size,
        ids=np.array(draw(st.permutations(range(n))) if named else [-1] * n, dtype=np.int64),
    )


@given(st.data())
@settings(
    max_examples=examples(60),
    suppress_health_check=[HealthCheck.too_slow],
    report_multiple_bugs=False,
)
def test_any_frames_come_back(data):
    times = [0.0, 0.1, 0.3, 1.0]
    worlds = [
        Cycle(k, t, tuple(data.draw(st.one_of(st.none(), strange_frames(t))) for _ in range(2)))
        for k, t in enumerate(times)
    ]
    again = decode_record(encode_record(record(worlds)))
    for k, (a, b) in enumerate(zip(worlds, again.worlds, strict=True)):
        close(a, b, paths=k == 0)


@pytest.mark.parametrize("n", range(2))
def test_the_writer_makes_text_and_index_that_agree(tmp_path, n):
    with HazardWriter(tmp_path) as writer:
        for i in range(n):
            writer.write(record(worlds_of(2, 1.0), id=f"h{i}"))
    assert [r.id for r in read_hazards(tmp_path)] == [f"h{i}" for i in range(n)]
    text = (tmp_path / "hazards.txt").read_bytes()
    for row in read_index(tmp_path):
        piece = text[row["offset"] : row["offset"] + row["bytes"]].decode()
        assert decode_record(piece).id == row["id"]
        assert row["context"] == {"route": "Ring ü\n1"}


def test_a_record_cut_off_at_the_end_is_left_out_and_a_damaged_one_named(tmp_path):
    with HazardWriter(tmp_path) as writer:
        for i in range(2):
            writer.write(record(worlds_of(2, 1.0), id=f"h{i}"))
    path = tmp_path / "hazards.txt"
    text = path.read_text()
    path.write_text(text[:-200])
    assert [r.id for r in read_hazards(tmp_path)] == ["h0"]
    path.write_text(text.replace("\nF 0 ", "\nF 7 ", 1))
    with pytest.raises(FileError, match=r"hazards\.txt: line \d+ of the record: channel 7"):
        list(read_hazards(tmp_path))
    with pytest.raises(FileError, match="cannot be read"):
        list(read_hazards(tmp_path / "nowhere"))


TEXT = encode_record(record(worlds_of(2, 1.0)))


@pytest.mark.parametrize("t", ["Infinity", "NaN", "1e30", "-1.0"])
def test_times_that_no_clock_shows_are_refused(t):
    with pytest.raises(FileError, match="t_start must be between 0 and 1e\\+11 s"):
        decode_record(re.sub(r'"t_start": [^,]*', f'"t_start": {t}', TEXT))


@given(st.data())
@settings(max_examples=examples(300))
def test_no_damage_makes_the_text_reader_raise_anything_but_its_own_error(data):
    text = list(TEXT)
    for _ in range(data.draw(st.integers(1, 5))):
        place = data.draw(st.integers(0, len(text) - 1))
        text[place] = data.draw(st.sampled_from(list('0123456789 -~\nWFELTSOQZH{}[]",.x')))
    with contextlib.suppress(FileError):
        decode_record("".join(text))


@pytest.mark.parametrize("key", ["objects", "flags"])
def test_a_head_without_its_objects_or_flags_is_refused(key):
    text = re.sub(rf'"{key}": \[[^]]*\], ', "", encode_record(record([])), count=1)
    assert f'"{key}"' not in text
    with pytest.raises(FileError, match=key):
        decode_record(text)
    with pytest.raises(Refused, match=key):
        hazards_of(f"{HEADER}\n{text}".encode(), Limits())


def test_numbers_of_numpy_come_back():
    objects = (InvolvedObject("b", np.int64(3), np.float32(1.5), np.float64(2.0)),)
    made = record([], objects=objects, count=np.int64(11))
    assert decode_record(encode_record(made)).objects == (InvolvedObject("b", 3, 1.5, 2.0),)
