"""The commands grip, play and campaign estimate, and wrong input to them."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.grip import template
from skidpad.campaign.recipes.grip import recipe
from skidpad.cli.campaigns.grip_plan import plan_grip, with_model
from skidpad.cli.main import app
from skidpad.cli.options.asked import EgoStack, GripCross, Tuned
from skidpad.core.errors import ConfigError, InputError
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.report.grip.page import write_grip_report
from skidpad.scenarios.shipped import FOLDER
from support.ids import check_ids, texts_of

SMALL = (
    "--scenarios", "lead_slowdown", "--weather", "icy_0,icy_30", "--repeats", "2", "--workers", "1",
)  # fmt: skip


def plan(repeats=100, **asked) -> list[RunSpec]:
    """As the command makes it: what is asked of the crossing, of the run, and who drives."""
    run = {n: asked.pop(n) for n in ("sensors", "overlay") if n in asked}
    driver = EgoStack(stack=asked.pop("stack", "2")).find_driver()
    cross = GripCross(**asked)
    return plan_grip(
        cross, with_model(template(driver=driver, **run), Tuned(), cross.model), repeats
    )


@pytest.mark.req("B-122")
def test_the_default_is_the_published_campaign():
    cells = plan()
    assert len(cells) == 6600
    assert len({c.name for c in cells}) == 6600
    assert len({c.weather.name for c in cells}) == 11


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"weather": "rain-20,hail"}, "unknown weather 'hail'"),
        ({"weather": "snow"}, "physical grip model"),
        ({"scenarios": "ghost"}, "unknown scenario 'ghost'"),
        ({"friction": "half"}, "original, reduced"),
        ({"cutin": "broken"}, "original, unfixed, fixed"),
        ({"stack": "agent:nowhere.py:A"}, "does not exist"),
        ({"stack": "no.such:Thing"}, "cannot be imported"),
        ({"overlay": True}, "--sensors pixels"),
    ],
)
def test_wrong_input_is_one_sentence(wish, message):
    with pytest.raises(InputError, match=re.escape(message)):
        plan(**wish)


@pytest.mark.req("B-002")
def test_rain_with_ice_is_refused(tmp_path):
    (tmp_path / "mix.yaml").write_text("ice_thickness: 20\nprecipitation: 30\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="ice_thickness 20 together with"):
        plan(weather=str(tmp_path / "mix.yaml"))


def test_batches_of_twenty_with_a_stopping_rule():
    campaign = Campaign(recipe(), plan(repeats=50, weather="rain_0"))
    assert len(campaign.batches()) == 1
    stopping = replace(campaign, until_halfwidth=0.05)
    assert [len(b) // 6 for b in stopping.batches()] == [20, 20, 10]
    with pytest.raises(ConfigError, match="between 0.001 and 0.5"):
        replace(campaign, until_halfwidth=0.9)


@pytest.mark.slow
@pytest.mark.req(
    "B-005", "B-060", "B-124", "B-140", "B-141", "B-143", "B-144", "B-146", "B-147", "B-148"
)
def test_a_small_campaign_from_command_to_page(tmp_path):
    out = tmp_path / "out"
    words = ["grip", "--out", str(out), *SMALL, "--scenarios", "lead_slowdown,ghost_cut_in"]
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    for part in (
        "Completion and score", "published", "Findings of the source", "BF-02", "Distances between",
        "Series over time", "Across weathers", "Replays", "Stopping distances", "other outcome",
        "corrections", "Trajectories of the cut-in",
    ):  # fmt: skip
        assert part in page, part
    assert 'src="http' not in page
    check_ids(texts_of(page))
    write_grip_report(out)
    assert (out / "report.html").read_text(encoding="utf-8") == page


def test_play_and_check(tmp_path):
    file = str(FOLDER / "ghost_cut_in.xosc")
    run = [
        "play",
        file,
        "--out",
        str(tmp_path / "run"),
        "--duration",
        "2",
        "--param",
        "EgoSpeed=15",
    ]
    done = CliRunner().invoke(app, run, catch_exceptions=False)
    assert done.exit_code == 1  # two seconds are too few for its story
    assert "The run is void" in done.stdout
    checked = CliRunner().invoke(app, ["play", file, "--check"], catch_exceptions=False)
    assert "can be played" in checked.stdout
    odd = tmp_path / "odd.xosc"
    text = (FOLDER / "ghost_cut_in.xosc").read_text(encoding="utf-8")
    odd.write_text(text.replace("StandStillCondition", "TidalCondition"), encoding="utf-8")
    refused = CliRunner().invoke(app, ["play", str(odd), "--check"], catch_exceptions=False)
    assert refused.exit_code == 2
    assert re.search(r"odd\.xosc, line \d+, <TidalCondition>: .* is not supported", refused.stdout)
    assert not (tmp_path / "odd").exists()


@pytest.mark.req("B-161")
def test_four_cells_cross_drops_with_friction():
    asked = {
        "scenarios": "lead_slowdown", "weather": "rain_100", "repeats": 2, "four_cells": True,
        "sensors": SensorLevel.PIXELS,
    }  # fmt: skip
    cells = plan(**asked)
    seen = {(c.overlay, c.friction.value, c.seed) for c in cells}
    assert len(cells) == len(seen) == len({c.name for c in cells}) == 8
    with pytest.raises(ConfigError, match="pixels"):
        plan(**{**asked, "sensors": SensorLevel.OBJECTS})
    with pytest.raises(ConfigError, match="both frictions"):
        plan(**{**asked, "friction": "reduced"})
