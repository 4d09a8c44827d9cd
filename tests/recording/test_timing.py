"""Tables of times that somebody changed are refused in a sentence, as tables of results are."""

import polars as pl
import pytest

from skidpad.core.errors import FileError
from skidpad.evidence.channels.timing import TIMES
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.channels.monitored import read_timing, write_timing
from skidpad.recording.files import write_parquet

CYCLES = pl.DataFrame({name: [0, 1, 2] for name in TIMES}, schema=TIMES)


def test_times_of_cycles_are_read(tmp_path):
    assert read_timing(tmp_path, TIMES) is None  # not measured
    write_timing(tmp_path, CYCLES)
    assert read_timing(tmp_path, TIMES).equals(CYCLES)
    write_timing(tmp_path, CYCLES.clear())
    assert read_timing(tmp_path, TIMES) is None


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (CYCLES.drop("risk"), "has no column 'risk'"),
        (CYCLES.with_columns(total=pl.lit("long")), "column 'total' holds String"),
        (CYCLES.with_columns(total=pl.lit(float("nan"))), "column 'total' holds what is not"),
        (CYCLES.with_columns(objects=pl.lit(-1, pl.Int64)), "column 'objects' holds what is not"),
        (CYCLES.with_columns(objects=pl.lit(None)), "column 'objects' holds what is not"),
        (CYCLES.reverse(), "out of order"),
    ],
)
def test_others_are_refused(tmp_path, changed, said):
    write_timing(tmp_path, changed)
    with pytest.raises(FileError, match=said):
        read_timing(tmp_path, TIMES)


def test_times_of_runs_are_numbers(tmp_path):
    folder = CampaignFolder(tmp_path, object)
    write_parquet(tmp_path / "timing.parquet", pl.DataFrame({"seed": [1], "wall_s": ["long"]}))
    with pytest.raises(FileError, match="column 'wall_s' holds String"):
        _ = folder.timing
    write_parquet(tmp_path / "timing.parquet", pl.DataFrame({"seed": [1], "wall_s": [2.0]}))
    assert folder.timing["wall_s"].to_list() == [2.0]
