"""docs/weather-checks.md names each switch of weather, what the profile says, and a check that is there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from skidpad.core.settings.parts import PROFILES, SensorSettings, WorldSettings, load_profile
from skidpad.core.settings.setting import describe_settings

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "weather-checks.md"
NOT_WEATHER = {"bumper_depth_fov_deg"}
# what an effect that rests on assumptions is when it is off
OFF = {"off", "0.0", "exact", "geometric", "points", "ideal", "fixed"}


class Row(NamedTuple):
    """A switch on the page."""

    name: str
    value: str  # in `recommended`
    check: str


def rows() -> list[Row]:
    found = re.findall(r"^\| `(\w+)` \| (\S+) \| (.+) \|$", PAGE.read_text(encoding="utf-8"), re.M)
    return [Row(*one) for one in found]


def switches() -> set[str]:
    """All settings of tyres, road, air and sensors, and those of drivers that mind weather."""
    named = {*describe_settings(WorldSettings), *describe_settings(SensorSettings)}
    return (named | {"drivers", "drivers_patches"}) - NOT_WEATHER


def text_of(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return "-" if value is None else str(value)


def targets(text: str) -> Iterator[str]:
    yield from re.findall(r"\]\(([^)]+)\)", text)
    yield from re.findall(r"`(tests/[^`]+)`", text)


def anchors(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    plain = (re.sub(r"[^\w\s-]", "", title).strip().lower() for title in titles)
    return {re.sub(r"[-\s]+", "-", title) for title in plain}


def test_every_switch_has_one_row() -> None:
    names = [row.name for row in rows()]
    assert len(names) == len(set(names))
    assert set(names) == switches()


def test_the_page_says_what_recommended_says() -> None:
    plain = load_profile("recommended").to_plain()
    assert {r.name: r.value for r in rows()} == {r.name: text_of(plain[r.name]) for r in rows()}


@pytest.mark.parametrize("profile", PROFILES)
def test_what_is_an_assumption_is_off_in_every_profile(profile: str) -> None:
    plain = load_profile(profile).to_plain()
    assumed = [r.name for r in rows() if r.check.startswith("assumption")]
    assert "spray" in assumed
    assert {name: text_of(plain[name]) for name in assumed if text_of(plain[name]) not in OFF} == {}


def test_what_is_on_in_recommended_names_a_check() -> None:
    """Pictures are as published; nothing else is on without one."""
    on = [r for r in rows() if r.value not in OFF and not r.check.startswith("value of")]
    without = {r.name for r in on if not list(targets(r.check))}
    assert without == {"camera", "night_rain"}
    assert all("as published" in r.check for r in on if r.name in without)


def test_links_of_the_page_lead_to_tables_and_tests() -> None:
    found = list(targets(PAGE.read_text(encoding="utf-8")))
    assert len(found) > 20
    for target in found:
        name, _, anchor = target.partition("#")
        path = ROOT / name if name.startswith("tests/") else PAGE.parent / name
        assert path.exists(), target
        assert not anchor or anchor in anchors(path), target


def test_every_limit_of_a_model_has_a_range_and_an_error() -> None:
    """On the page of limits; what is no model of something measured stands in the list of exceptions."""
    text = (PAGE.parent / "limits.md").read_text(encoding="utf-8")
    models = text.split("## The world")[1].split("## The numbers")[0]
    lacking = {
        bullet.split("**")[1].split(".")[0]
        for bullet in re.split(r"^\* ", models, flags=re.M)[1:]
        if not ("*valid*" in bullet.lower() and "*error*" in bullet.lower())
    }
    assert lacking == {"One car, few maps", "The object level sees boxes"}
