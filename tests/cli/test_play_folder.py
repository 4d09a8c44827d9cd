"""`skidpad play DIR`: a folder of scenarios as a campaign."""

import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.cli.options.asked import PlayCross
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.run import Friction
from skidpad.recording.campaign.grip import GripEntry
from skidpad.recording.campaign.ledger import read_ledger
from skidpad.recording.campaign.results import read_results
from skidpad.scenarios.shipped import FOLDER
from support.scenarios.files import document


def play(*call):
    return CliRunner().invoke(app, ["play", *map(str, call)], catch_exceptions=False)


@pytest.fixture
def folder(tmp_path):
    below = tmp_path / "scenarios" / "below"
    below.mkdir(parents=True)
    text = (FOLDER / "ghost_cut_in.xosc").read_text(encoding="utf-8")
    (below / "cut.in.xosc").write_text(text, encoding="utf-8")
    odd = text.replace("StandStillCondition", "TimeOfDayCondition")
    (tmp_path / "scenarios" / "odd.xosc").write_text(odd, encoding="utf-8")
    return tmp_path / "scenarios"


def test_every_file_is_driven_in_every_weather_with_and_without_its_grip(folder, tmp_path):
    out = tmp_path / "out"
    call = [
        folder,
        "--out",
        out,
        "--duration",
        "1",
        "--workers",
        "1",
        "--seeds",
        "2",
        "--seed",
        "5",
    ]
    call += ["--weather", "rain-noon,clear-noon", "--grip", "none,statistical"]
    done = play(*call)
    assert done.exit_code == 1, "1 s is too short for the cut-in: void"
    assert "TimeOfDayCondition" in done.stderr
    lines = done.stdout.splitlines()
    assert (
        len([x for x in lines if x.startswith("cut.in") and "rain-noon" in x and "void" in x]) == 4
    )
    assert "0 of 9 runs passed; 1 in error, 8 void." in lines
    table = read_results(out)
    assert len(table) == len(read_ledger(out, GripEntry)) == 1 * 2 * 2 * 2
    assert set(table["scenario"]) == {"cut.in"}
    assert sorted(set(table["seed"])) == [5, 6]
    assert set(table["friction"]) == {"original", "reduced"}
    assert (out / "runs" / "cut.in_rain-noon_reduced-000005" / "ticks.parquet").is_file()
    again = CliRunner().invoke(app, ["report", str(out)])
    assert again.stdout == done.stdout
    resumed = play(*call, "--resume")
    assert resumed.exit_code == 1
    assert len(read_ledger(out, GripEntry)) == 8


def test_what_cannot_be_played_is_told_of_a_whole_folder(folder):
    done = play(folder, "--check")
    assert done.exit_code == 2
    assert "cut.in.xosc: can be played" in done.stdout
    assert "odd.xosc, line" in done.stdout


def test_catalogs_are_passed_over_and_distributions_checked_choice_by_choice(folder):
    (folder / "odd.xosc").unlink()
    (folder / "catalog.xosc").write_text(document('<Catalog name="c"/>'), encoding="utf-8")
    values = "".join(f'<Element value="{v}"/>' for v in (20.0, 25.0))
    choices = f"""<ParameterValueDistribution>
<ScenarioFile filepath="below/cut.in.xosc"/><Deterministic>
<DeterministicSingleParameterDistribution parameterName="EgoSpeed"><DistributionSet>{values}
</DistributionSet></DeterministicSingleParameterDistribution></Deterministic>
</ParameterValueDistribution>"""
    (folder / "choices.xosc").write_text(document(choices), encoding="utf-8")
    done = play(folder, "--check")
    assert done.exit_code == 0, done.output
    assert "choices.xosc: can be played" in done.stdout
    assert "catalog" not in done.stdout
    wrong = document(choices.replace("EgoSpeed", "Nobody"))
    (folder / "choices.xosc").write_text(wrong, encoding="utf-8")
    (folder / "torn.xosc").write_text("<OpenSCENARIO", encoding="utf-8")
    done = play(folder, "--check")
    assert done.exit_code == 2
    assert "declares no parameter 'Nobody'" in done.stdout
    assert "not XML" in done.stdout
    assert "cut.in.xosc: can be played" in done.stdout


def test_what_cannot_be_played_is_never_as_expected(folder, tmp_path):
    junit = tmp_path / "junit.xml"
    done = play(
        folder, "--out", tmp_path / "o", "--duration", 1, "--workers", 1, "--stack", "ideal",
        "--expect", "no-collision", "--junit", junit,
    )  # fmt: skip
    assert done.exit_code == 1, done.output
    cases = {case.get("name"): len(case) for case in etree.parse(str(junit)).getroot()}
    assert sorted(cases.values()) == [1, 1], "one is void in 1 s, one cannot be played"
    (odd,) = etree.parse(str(junit)).getroot().findall("testcase/error")
    assert odd.getparent().get("name").endswith("odd.xosc: no-collision")
    assert "cannot be played" in odd.get("message")


def test_two_files_of_one_name_are_named_by_their_paths(folder, tmp_path):
    (folder / "odd.xosc").unlink()
    (folder / "above").mkdir()
    text = (folder / "below" / "cut.in.xosc").read_text(encoding="utf-8")
    for name in ("above/cut.in.xosc", "other.xosc"):
        (folder / name).write_text(text, encoding="utf-8")
    done = play(folder, "--out", tmp_path / "o", "--duration", 0.2, "--workers", 1)
    assert done.exit_code == 1, done.output
    names = sorted(run.name.partition("_")[0] for run in (tmp_path / "o" / "runs").iterdir())
    assert names == ["above-cut.in", "below-cut.in", "other"]
    assert set(read_results(tmp_path / "o")["scenario"]) == {
        "above/cut.in",
        "below/cut.in",
        "other",
    }


def test_a_folder_without_scenarios_and_a_file_with_two_weathers_are_refused(folder, tmp_path):
    (folder / "below" / "no").mkdir()
    with pytest.raises(FileError, match=r"holds no \.xosc"):
        play(folder / "below" / "no", "--out", tmp_path / "o")
    file = folder / "below" / "cut.in.xosc"
    with pytest.raises(ConfigError, match="take a folder"):
        play(file, "--out", tmp_path / "o", "--weather", "rain-noon,clear-noon")


@pytest.mark.parametrize(
    ("text", "frictions", "model"),
    [
        ("physical", [Friction.REDUCED], "physical"),
        ("none", [Friction.ORIGINAL], "none"),
        ("none,statistical", [Friction.ORIGINAL, Friction.REDUCED], "statistical"),
    ],
)
def test_grips_are_none_and_one_model(text, frictions, model):
    assert PlayCross(grip=text).frictions() == (frictions, model)
    for wrong in ("physical,statistical", "none,none", "ice"):
        with pytest.raises(ConfigError, match="--grip"):
            PlayCross(grip=wrong).frictions()
