"""The page says what a run is made of, with the titles of the registries and the package of each part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import pytest

from skidpad.cockpit.about import About
from skidpad.cockpit.parts import list_parts
from skidpad.core.courses import Roads, Scenario
from skidpad.core.objects.registry import Source
from skidpad.core.run import AdasDriver, Function, RunSpec, StackDriver
from skidpad.core.simulator import BACKENDS, BackendChoice
from skidpad.core.weather import Weather
from skidpad.physics.presets import WEATHERS, preset
from skidpad.roads.map_files import MAPS
from skidpad.stack.functions import FUNCTIONS
from support.cockpit.producers import bridge


@dataclass(frozen=True)
class Entry:
    """An entry of a package."""

    name: str
    title: str


@pytest.fixture
def packages(monkeypatch):
    """Four registries with an entry each of the package `winter`."""
    for registry in (FUNCTIONS, MAPS, WEATHERS, BACKENDS):
        new = f"new_{registry.noun}"
        entry = Source(new, "winter", partial(Entry, new, f"A {registry.noun} of others"))
        monkeypatch.setattr(registry, "_sources", {**registry.sources(), new: entry})


FOREIGN = RunSpec(
    driver=AdasDriver(functions=frozenset({Function.LCA, Function.ACC}), added=("new_function",)),
    course=Roads(map="new_map:60"),
    weather=Weather(name="new_weather"),
    backend=BackendChoice(backend="new_backend"),
)


@pytest.mark.usefixtures("packages")
def test_parts_of_packages_are_listed_with_title_and_package():
    assert list_parts(FOREIGN) == (
        ("stack", "2"),
        ("function", "acc: ACC"),
        ("function", "lca: lane centring"),
        ("function", "new_function: A function of others [package winter]"),
        ("map", "new_map:60: A map of others [package winter]"),
        ("weather", "new_weather: A weather of others [package winter]"),
        ("simulator", "new_backend: A backend of others [package winter]"),
    )


def test_parts_whose_package_is_gone_keep_their_names():
    spec = RunSpec(
        driver=StackDriver("mine.py:Mine"),
        course=Scenario(file="cut-in"),
        weather=preset("snow"),
        backend=BackendChoice(backend="gone"),
    )
    listed = dict(list_parts(spec))
    assert listed["stack"] == "mine.py:Mine"
    assert listed["scenario"] == "cut-in"
    assert listed["weather"].startswith("snow: ")
    assert listed["simulator"] == "gone"
    assert ("function", "new_function") in list_parts(FOREIGN)
    assert ("map", "new_map:60") in list_parts(FOREIGN)


@pytest.mark.usefixtures("packages")
def test_the_page_shows_every_part_and_offers_weathers_of_packages():
    pytest.importorskip("nicegui", reason="nicegui is not installed (extra cockpit)")
    from starlette.testclient import TestClient

    from skidpad.cockpit.serving import application

    app = application(bridge(), About("drive", parts=list_parts(FOREIGN)))
    page = TestClient(app).get("/").text
    for kind, name in list_parts(FOREIGN):
        assert f"{kind}  {name}" in page
    assert page.count("A weather of others") == 2  # of this run, and to choose
