"""Recordings of channels: what goes in comes out, and damage costs only what it touches."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skidpad.core.channels import ChannelFrame, Context, Decision
from skidpad.core.errors import ConfigError, FileError
from skidpad.recording.channels import channels_pb2 as pb
from skidpad.recording.channels import codec
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.mcap_files import ChannelWriter, McapRecording
from support.channel_worlds import Eyes, Listed, World, drive, frame, traffic
from support.examples import examples

WORLD = World(objects=traffic(5))
EYES = (Eyes("left", 0.1), Eyes("right", 0.1, blind=(2,)))


def write(path, recording, channels=None):
    with ChannelWriter(path, channels or recording.channels) as writer:
        for channel, item in recording.rows:
            writer.add(item, channel)


def same(a, b):
    return all(np.array_equal(x, y, equal_nan=True) for x, y in zip(a, b, strict=True))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "drive.mcap"
    write(path, drive(WORLD, EYES, 20.0))
    return path


@pytest.mark.req("C-020", "C-025")
def test_a_recording_gives_back_every_number(tmp_path):
    listed = drive(WORLD, EYES, 2.0)
    write(tmp_path / "a.mcap", listed)
    read = list(McapRecording(tmp_path / "a.mcap").messages())
    assert len(read) == len(listed.rows)
    for message, (channel, item) in zip(read, listed.rows, strict=True):
        assert message.channel == channel
        assert same(message.item, item)


def test_decisions_context_and_the_order_of_channels_survive(tmp_path):
    with ChannelWriter(tmp_path / "a.mcap", ["zeta", "alpha"]) as writer:
        writer.add(Context(0.0, {"route": "town"}))
        for t in (0.0, 0.1):
            writer.add(frame(t, (0, 0, 0, 1, 0)), 1)
            writer.add(frame(t, (0, 0, 0, 1, 0)), 0)
        writer.add(Decision(0.1, "alpha", "preferred", (0.5, float("nan"))))
    recording = McapRecording(tmp_path / "a.mcap")
    assert recording.channels == ("zeta", "alpha")
    assert [c.driving for c in cycles(recording)] == [None, 1]
    assert Context(0.0, {"route": "town"}) in [m.item for m in recording.messages()]


def test_polygons_of_different_sizes_survive():
    a = frame(0.0, (0, 0, 0, 1, 0), [[1, 2, 0, 0, 0], [3, 4, 0, 0, 0]])
    size, polygons = codec.padded_polygons([np.ones((3, 2)), np.arange(10.0).reshape(5, 2)])
    a = a._replace(polygons=polygons, polygon_size=size)
    b = codec.frame_from_message(codec.message_from_frame(a))
    assert same(a, b)
    assert np.isnan(b.polygons[0, 3:]).all()


@pytest.mark.parametrize(
    "change",
    [
        {"ego": [1.0, 2.0]},
        {"objects": [1.0] * 7},
        {"predictions": [1.0]},
        {"polygon_size": [4]},
        {"polygon_size": [200] * 2, "polygons": [0.0] * 800},
        {"ids": [1]},
        {"plan": [1.0, 2.0]},
    ],
)
def test_arrays_that_do_not_fit_together_are_refused(change):
    message = codec.message_from_frame(frame(0.0, (0, 0, 0, 1, 0), np.zeros((2, 5))))
    for name, values in change.items():
        message.ClearField(name)
        getattr(message, name).extend(values)
    with pytest.raises(FileError):
        codec.frame_from_message(message)


def test_names_and_times_are_checked(tmp_path):
    with pytest.raises(ConfigError, match="different names"):
        ChannelWriter(tmp_path / "a.mcap", ["a", "a"])
    with ChannelWriter(tmp_path / "a.mcap", ["a"]) as writer, pytest.raises(ConfigError):
        writer.add(frame(-1.0, (0, 0, 0, 1, 0)), 0)


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"not mcap at all" * 9])
def test_files_without_channels_are_refused_in_one_sentence(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"x\.mcap: (is not|holds no)"):
        McapRecording(path)
    with pytest.raises(FileError, match="cannot be read"):
        McapRecording(tmp_path / "missing.mcap")


def test_a_truncated_recording_reads_up_to_the_cut(recording, tmp_path):
    whole = recording.read_bytes()
    n = len(list(McapRecording(recording).messages()))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(0.6 * len(whole))])
    reader = McapRecording(cut)
    read = list(reader.messages())
    assert reader.losses.cut
    assert 0.3 * n < len(read) < 0.7 * n
    assert reader.channels == ("left", "right")


def test_a_damaged_chunk_costs_only_itself(recording, tmp_path):
    damaged = bytearray(recording.read_bytes())
    middle = damaged.index(b"zstd", len(damaged) // 4) + 200  # in the data of a chunk
    damaged[middle : middle + 16] = b"\xff" * 16
    path = tmp_path / "damaged.mcap"
    path.write_bytes(bytes(damaged))
    reader = McapRecording(path)
    read = list(reader.messages())
    assert (reader.losses.chunks, reader.losses.cut) == (1, False)
    assert len(read) > 100


@settings(max_examples=examples(150))
@given(data=st.data())
def test_no_damage_makes_the_reader_raise_anything_but_its_own_error(
    recording, tmp_path_factory, data
):
    whole = bytearray(recording.read_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        whole[data.draw(st.integers(8, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "fuzzed.mcap"
    path.write_bytes(bytes(whole[: data.draw(st.integers(8, len(whole)))]))
    try:
        for cycle in cycles(McapRecording(path)):
            assert len(cycle.frames) >= 1
    except FileError:
        pass


@settings(max_examples=examples(200))
@given(st.binary(max_size=400))
def test_message_content_never_raises_anything_but_its_own_error(data):
    from google.protobuf.message import DecodeError

    for kind, read in (
        (pb.Channel, codec.frame_from_message),
        (pb.Truth, codec.truth_from_message),
    ):
        with contextlib.suppress(FileError, DecodeError):
            read(kind.FromString(data))


@pytest.mark.req("C-022")
def test_the_grid_takes_the_newest_message_not_older_than_150_ms():
    ego = (0, 0, 0, 1, 0)
    fast = [(0, frame(0.1 * k, ego)) for k in range(11)]
    slow = [(1, frame(t, ego)) for t in (0.0, 0.26, 0.58)]
    rows = sorted(fast + slow, key=lambda row: row[1].t)
    source = Listed(("fast", "slow"), rows)
    ages = [None if c.frames[1] is None else round(c.t - c.frames[1].t, 6) for c in cycles(source)]
    assert ages == [0.0, 0.1, None, 0.04, 0.14, None, 0.02, 0.12, None, None, None]
    assert source.losses.stale == {"slow": 5}


def test_a_vanished_channel_leaves_the_other_in_place():
    ego = (0, 0, 0, 1, 0)
    rows = [(i, frame(0.1 * k, ego)) for k in range(30) for i in (0, 1) if i == 0 or k < 10]
    seen = [c.frames[1] is not None for c in cycles(Listed(("a", "b"), rows))]
    assert sum(seen) == 11  # the last message is still fresh one cycle later
    assert len(seen) == 30


def test_time_running_backwards_and_leaping_ahead_is_dropped_and_counted():
    ego = (0, 0, 0, 1, 0)
    rows = [(0, frame(0.1 * k, ego)) for k in range(20)]
    rows.insert(10, (0, frame(0.2, ego)))
    rows.insert(15, (0, frame(1e9, ego)))
    source = Listed(("a",), rows)
    assert len(list(cycles(source))) == 20
    assert (source.losses.out_of_order, source.losses.jumps) == (1, 1)


def test_a_long_silence_is_left_out_but_counted_by_the_grid():
    ego = (0, 0, 0, 1, 0)
    times = [*np.arange(10) * 0.1, *(1e6 + np.arange(10) * 0.1)]
    grid = list(cycles(Listed(("a",), [(0, frame(t, ego)) for t in times])))
    assert grid[-1].k == round(1e7) + 8 or grid[-1].k == round(1e7) + 9
    assert len(grid) < 200


def test_ten_thousand_objects_are_read(tmp_path):
    big = frame(0.0, (0, 0, 0, 1, 0), np.random.default_rng(1).normal(size=(10_000, 5)))
    write(tmp_path / "big.mcap", Listed(("a",), [(0, big)]))
    (message,) = McapRecording(tmp_path / "big.mcap").messages()
    assert isinstance(message.item, ChannelFrame)
    assert same(message.item, big)


@pytest.mark.req("C-021")
def test_a_type_that_only_ends_like_ours_is_foreign(tmp_path, monkeypatch):
    listed = drive(WORLD, EYES, 1.0)
    path = tmp_path / "a.mcap"
    write(path, listed)
    records = McapRecording._records
    monkeypatch.setattr(
        McapRecording,
        "_records",
        lambda self, losses: (
            (topic, schema.replace("skidpad.Truth", "x.skidpad.Truth"), record)
            for topic, schema, record in records(self, losses)
        ),
    )
    recording = McapRecording(path, truth=False)
    assert all(message.channel is not None for message in recording.messages())
    assert recording.losses.foreign == sum(channel is None for channel, _ in listed.rows) > 0


@pytest.mark.parametrize(
    ("item", "channel"),
    [
        (frame(0.0, (0, 0, 0, 1, 0)), None),
        (frame(0.0, (0, 0, 0, 1, 0)), 2),
        (frame(0.0, (0, 0, 0, 1, 0)), -1),
        (Context(0.0, {"route": "town"}), 0),
        (Decision(0.1, "a", "preferred", (0.5,)), 1),
    ],
)
def test_frames_alone_have_a_channel(tmp_path, item, channel):
    with (
        ChannelWriter(tmp_path / "a.mcap", ["a", "b"]) as writer,
        pytest.raises(ConfigError, match=f"channel of a {type(item).__name__} must be in"),
    ):
        writer.add(item, channel)
