from __future__ import annotations

import contextlib
import dataclasses
import errno
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skidpad.core.errors import FileError, OutputError
from skidpad.core.states import ContactEvent, LaneInvasion, StackReport, VehicleCommand
from skidpad.core.vocabulary import (
    DetectionStatus,
    LightState,
    RelocationReason,
    Supervision,
    Tier,
)
from skidpad.recording.files import content_hash, write_atomically
from skidpad.recording.fingerprint import fingerprint
from skidpad.recording.run.events import (
    LightChange,
    Notice,
    NoticeSource,
    Relocation,
    decode_events,
)
from skidpad.recording.run.log import LogHeader, ReportSeries, RunLog
from skidpad.recording.run.log_files import (
    EVENTS,
    TICKS,
    driven_on,
    log_hash,
    read_log,
    tick_table,
    write_log,
)
from skidpad.recording.run.ticks import TickLog
from support.examples import examples
from support.makelog import actor_table, drive, frame, pose, world

CONTACT = ContactEvent(3, -1, "guardrail", 120.0, 2.5, 1.0, 2.0)
INVASION = LaneInvasion(5, "solid", 7)
MOVE = Relocation(6, RelocationReason.COLLISION, 8.0, pose(1.0), pose(2.0))


def some_log() -> RunLog:
    def extra(log: TickLog, k: int) -> None:
        if k == 6:
            log.relocated(MOVE)
            log.set_weather("rain-noon")
        if k == 7:
            log.notice(7, NoticeSource.STACK, "division by zero")

    return drive(
        9,
        lambda k: [{"x": k * 1.0, "vx": 20.0}, {"x": 30.0 + k, "y": 0.1, "vx": 19.0}],
        report=lambda k: (
            None
            if k == 0
            else StackReport(
                status=DetectionStatus.FUSION_DETECT, tier=Tier.ACC_HOLD, distance=29.5 - k
            )
        ),
        supervision=lambda k: Supervision.BRAKE if k == 4 else Supervision.NONE,
        contacts=[CONTACT],
        invasions=[INVASION],
        extra=extra,
    )


def assert_same(a: RunLog, b: RunLog) -> None:
    assert a.header == b.header
    assert a.events == b.events
    assert a.weathers == b.weathers
    for name in ("tick", "present", "mu", "supervision", "weather"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    for name in ("actors", "ego", "applied", "requested", "report"):
        np.testing.assert_array_equal(np.array(getattr(a, name)), np.array(getattr(b, name)))
    for field in dataclasses.fields(a.table):
        np.testing.assert_array_equal(getattr(a.table, field.name), getattr(b.table, field.name))


@pytest.mark.req("A-260")
def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    log = some_log()
    written = write_log(tmp_path / "run", log)
    again = read_log(tmp_path / "run")
    assert_same(log, again)
    assert written == log_hash(log) == log_hash(again)
    assert driven_on(tmp_path / "run") == fingerprint().short


def test_values_stand_where_the_field_names_say() -> None:
    log = some_log()
    assert np.isnan(log.report.distance[0])
    assert log.report.distance[3] == 26.5
    assert log.report.tier[3] == Tier.ACC_HOLD
    assert (log.requested.throttle[0], log.requested.brake[0], log.requested.steer[0]) == (
        0.1,
        0.2,
        0.3,
    )
    assert log.v_ego[5] == 20.0
    assert log.ego.speed[5] == 20.0
    assert log.actors.x[5, 1] == 35.0
    assert [log.weathers[w] for w in log.weather[[5, 6]]] == ["clear-noon", "rain-noon"]
    assert log.t[4] == pytest.approx(0.2)
    assert list(np.flatnonzero(log.supervision)) == [4]
    assert log.contacts == (CONTACT,)
    assert log.invasions == (INVASION,)
    assert log.relocations == (MOVE,)
    assert log.notices == (Notice(7, NoticeSource.STACK, "division by zero"),)


def test_the_log_has_a_column_for_every_field_of_the_report() -> None:
    assert ReportSeries._fields == tuple(f.name for f in dataclasses.fields(StackReport))


def test_absence_is_null_in_the_file_and_words_are_typed() -> None:
    table = tick_table(some_log())
    assert table["stack_distance"].null_count() == 1
    assert table["stack_roof"].null_count() == len(table)
    assert table["stack_detected"].dtype == pl.Boolean
    assert table["stack_tier"].dtype == pl.Int32


def test_lights_are_recorded_when_they_change() -> None:
    table = actor_table(1)
    log = TickLog(table, LogHeader(map="m", map_hash="h", dt=0.05))
    for tick, state in enumerate([LightState.RED, LightState.RED, LightState.GREEN]):
        truth = world(tick, [{}], table, lights={4: state})
        log.append(truth, frame(truth), VehicleCommand(), None)
    assert log.finish().lights == (
        LightChange(0, 4, LightState.RED),
        LightChange(2, 4, LightState.GREEN),
    )


def test_the_recorder_keeps_copies_because_frames_are_reused() -> None:
    table = actor_table(1)
    log = TickLog(table, LogHeader(map="m", map_hash="h", dt=0.05), capacity=1)
    truth = world(0, [{"x": 5.0}], table)
    log.append(truth, frame(truth), VehicleCommand(), None)
    truth.states.x[0] = np.nan
    truth.mu[:] = np.nan
    assert log.finish().actors.x[0, 0] == 5.0
    assert np.all(log.finish().mu == np.float32(0.9))


@settings(max_examples=examples(20))
@given(st.floats(-1e3, 1e3).filter(lambda v: abs(v) > 1e-3))
def test_hash_sees_any_change_of_a_value(change: float) -> None:
    log = some_log()
    before = log_hash(log)
    log.report.distance[2] += change
    assert log_hash(log) != before


def test_hash_sees_events_and_header() -> None:
    log = some_log()
    hashes = {
        log_hash(log),
        log_hash(dataclasses.replace(log, events=log.events[1:])),
        log_hash(
            dataclasses.replace(log, header=dataclasses.replace(log.header, map_hash="other"))
        ),
    }
    assert len(hashes) == 3


def test_hash_is_of_the_drive_and_not_of_its_labels() -> None:
    log = some_log()
    header = dataclasses.replace(log.header, about={"config": "4", "weather": "snow"})
    same = dataclasses.replace(log, header=header, weathers=("snow", "rain"))
    assert log_hash(same) == log_hash(log)


def test_hash_does_not_see_how_absence_or_zero_is_stored() -> None:
    def h(values: list[float | None]) -> str:
        return content_hash([pl.DataFrame({"a": pl.Series(values, dtype=pl.Float64)})])

    assert h([0.0, None, 1.0]) == h([-0.0, float("nan"), 1.0])
    assert h([0.0, None, 1.0]) != h([0.0, 0.0, 1.0])
    assert h([None]) != h([None, None])


def test_hash_tells_neighbouring_strings_apart() -> None:
    def h(values: list[str | None]) -> str:
        return content_hash([pl.DataFrame({"a": pl.Series(values, dtype=pl.String)})])

    assert len({h(["ab", "c"]), h(["a", "bc"]), h(["abc", ""]), h(["abc", None])}) == 4


def test_a_full_disk_is_one_sentence_and_the_old_file_stays(tmp_path: Path) -> None:
    path = tmp_path / "results.parquet"
    path.write_bytes(b"old")

    def fill(part: Path) -> None:
        part.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OutputError, match="disk is full"):
        write_atomically(path, fill)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["results.parquet"]


def test_files_that_are_no_logs_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no file"):
        read_log(tmp_path)
    (tmp_path / TICKS).write_bytes(b"PAR1 not really")
    with pytest.raises(FileError, match="not a readable Parquet"):
        read_log(tmp_path)
    pl.DataFrame({"a": [1]}).write_parquet(tmp_path / TICKS)
    with pytest.raises(FileError, match="not a tick log"):
        read_log(tmp_path)
    write_log(tmp_path, some_log())
    (tmp_path / EVENTS).unlink()
    with pytest.raises(FileError, match="events.jsonl"):
        read_log(tmp_path)


@given(st.binary(max_size=60))
def test_events_that_are_damaged_raise_file_error_only(text: bytes) -> None:
    with contextlib.suppress(FileError):
        assert isinstance(decode_events(text), tuple)
