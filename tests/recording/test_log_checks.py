"""A log whose numbers nobody can compute with is refused when it is read, not where it is used."""

from __future__ import annotations

import polars as pl
import pytest

from skidpad.campaign.runs.run import run
from skidpad.core.errors import FileError
from skidpad.recording.files import read_parquet
from skidpad.recording.run.log_files import TICKS, read_log, write_log
from support import runs


@pytest.fixture(scope="module")
def log():
    return run(runs.adas_run(duration=0.5, vehicles=1)).log


def with_column(log, folder, column):
    """The log's folder with one column exchanged, without a checksum as the first versions wrote."""
    write_log(folder, log)
    table, about = read_parquet(folder / TICKS)
    about = {"skidpad": about["skidpad"]}
    table.with_columns(column).write_parquet(folder / TICKS, metadata=about)
    return folder


def first(name, value, kind):
    """A column whose first value is another."""
    here = pl.int_range(pl.len()) == 0
    return pl.when(here).then(pl.lit(value, kind)).otherwise(pl.col(name)).cast(kind).alias(name)


@pytest.mark.parametrize(
    ("name", "value", "kind", "said"),
    [
        ("ego_gear", None, pl.Int32, "what the ego says of itself"),
        ("ego_x", float("inf"), pl.Float64, "what the ego says of itself"),
        ("stack_status", 77, pl.Int32, "status of the stack"),
        ("stack_light_source", 77, pl.Int32, "light_source of the stack"),
        ("stack_tier", -1, pl.Int32, "tier of the stack"),
    ],
)
def test_a_number_that_means_nothing_is_named(log, tmp_path, name, value, kind, said):
    with pytest.raises(FileError, match=said):
        read_log(with_column(log, tmp_path, first(name, value, kind)))


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
@pytest.mark.parametrize("name", ["x", "yaw", "vx"])
def test_whoever_is_present_is_somewhere(log, tmp_path, name, value):
    width = len(log.table)
    nowhere = pl.Series(name, [[value] * width] * len(log), pl.Array(pl.Float32, width))
    with pytest.raises(FileError, match="whoever is present"):
        read_log(with_column(log, tmp_path, nowhere))


@pytest.mark.parametrize("name", ["x", "yaw_rate", "present", "mu"])
@pytest.mark.parametrize("kind", [pl.Boolean, pl.Float64])
def test_a_column_of_actors_in_another_type_is_refused(log, tmp_path, name, kind):
    width = len(log.table) * (4 if name == "mu" else 1)
    other = pl.col(name).cast(pl.Array(pl.Float64, width)).cast(pl.Array(kind, width))
    with pytest.raises(FileError, match=f"column {name} must hold .* per tick"):
        read_log(with_column(log, tmp_path, other))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("stack_radar_points", pl.Float64),  # which also holds what no whole number does: 1e308
        ("ego_gear", pl.Int64),
        ("stack_distance", pl.Float32),
        ("stack_v_target", pl.Boolean),
        ("requested_throttle", pl.String),
    ],
)
def test_a_column_of_numbers_in_another_type_is_refused(log, tmp_path, name, kind):
    with pytest.raises(FileError, match=f"column {name} must hold .*, not {kind}"):
        read_log(with_column(log, tmp_path, pl.col(name).cast(kind)))


@pytest.mark.parametrize("name", ["tick", "supervision", "weather"])
def test_what_counts_something_keeps_its_type(log, tmp_path, name):
    with pytest.raises(FileError, match=f"column {name} must hold whole numbers"):
        read_log(with_column(log, tmp_path, pl.col(name).cast(pl.Int32)))


def test_a_column_that_is_missing_is_named(log, tmp_path):
    folder = with_column(log, tmp_path, pl.col("tick"))
    table = pl.read_parquet(folder / TICKS)
    about = {"skidpad": read_parquet(folder / TICKS)[1]["skidpad"]}
    for name in ("mu", "stack_distance", "weather"):
        table.drop(name).write_parquet(folder / TICKS, metadata=about)
        with pytest.raises(FileError, match=f"column {name} must hold"):
            read_log(folder)


def test_what_may_be_absent_is_read(log, tmp_path):
    absent = pl.lit(None, pl.Float64).alias("stack_distance")
    assert len(read_log(with_column(log, tmp_path, absent))) == len(log)
