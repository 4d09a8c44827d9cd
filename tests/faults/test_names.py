"""Every name that becomes a path leads to one place inside its folder (issue 14, item 1)."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from skidpad.campaign.runs.folder import fresh_folder
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.files.names import LONGEST, inside, path_part, slug
from skidpad.core.run import StackDriver
from skidpad.core.weather import Weather
from skidpad.recording.campaign.folder import RUNS, CampaignFolder
from skidpad.recording.campaign.grip import read_series
from skidpad.recording.campaign.matrix import MatrixEntry
from support import runs

BAD = [
    "../../victim",
    "x/../../../../victim",
    "..",
    ".",
    "",
    "a\x00b",
    "/etc",
    "\ud800",
    "n" * 5000,
]
words = st.text(st.characters(), max_size=300)


@given(words)
def test_a_word_becomes_one_visible_part_of_a_path(text):
    part = path_part(text)
    assert Path("folder", part).parent == Path("folder")
    assert len(part.encode()) <= LONGEST
    assert part[0] != "."
    assert path_part(part) == part
    assert inside(Path("folder"), part) == Path("folder", part)


@pytest.mark.parametrize("name", ["2_clear-noon", "acc+lca", "rain-night_wetness-20.5", "icy_30"])
def test_plain_names_stay_as_they_are(name):
    assert path_part(name) == name


def test_long_names_that_differ_at_their_end_stay_apart():
    assert path_part("x" * 400 + "a") != path_part("x" * 400 + "b")
    assert slug("../a b") == "---a-b"


@pytest.mark.parametrize("bad", BAD)
def test_no_weather_driver_or_scenario_leads_out_of_the_runs(tmp_path, bad):
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "kept.txt").write_text("kept")
    out = tmp_path / "out"
    described = [
        runs.adas_run(weather=Weather(name=bad)),
        runs.adas_run(driver=StackDriver("m:C", name=bad)),
        runs.scenario_run("ghost_cut_in", course=Scenario(variant=bad)),
        structs.replace(
            runs.segment_run(), course=structs.replace(runs.segment_run().course, name=bad)
        ),
    ]
    for run in described:
        for _ in range(2):  # the second attempt removes what the first one left
            folder = fresh_folder(out, run.name)
            folder.mkdir(parents=True)
            assert folder.parent == out / RUNS
    assert (victim / "kept.txt").read_text() == "kept"


@pytest.mark.parametrize("bad", BAD)
def test_a_name_that_leads_elsewhere_is_refused_where_it_is_read(tmp_path, bad):
    with pytest.raises(ConfigError):
        fresh_folder(tmp_path, bad)
    with pytest.raises(ConfigError):
        CampaignFolder(tmp_path, MatrixEntry).log(bad)
    with pytest.raises(ConfigError):
        read_series(tmp_path, f"{bad}-000001" if bad else "/-1")


def test_a_link_in_place_of_a_run_is_removed_and_what_it_points_at_is_not(tmp_path):
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "kept.txt").write_text("kept")
    (tmp_path / RUNS).mkdir()
    (tmp_path / RUNS / "a-001").symlink_to(victim)
    assert not fresh_folder(tmp_path, "a-001").exists()
    assert (victim / "kept.txt").read_text() == "kept"
