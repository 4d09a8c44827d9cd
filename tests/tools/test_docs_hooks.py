"""The site's navigation names every page, and its generated pages say what the program says."""

from __future__ import annotations

from pathlib import Path

import yaml

import skidpad
from docs_catalogue import sensor_page, vehicle_page, weather_page
from docs_hooks import ROOT, command_reference, home_page, on_page_markdown, page_list
from skidpad.core.sensor_types import SENSORS
from skidpad.physics.presets import preset_groups
from skidpad.physics.types import vehicle_types

DOCS = ROOT / "docs"
GENERATED = {
    "index.md", "contributing.md", "reference/cli.md", "reference/settings.md", "reference/weathers.md",
    "reference/vehicles.md", "reference/sensors.md", "reference/files.md", "gallery.md",
}  # fmt: skip


def own_presets() -> list[str]:
    return [name for members in preset_groups().values() for name in members]


PUBLISHED = (
    "results/claims.md",
    "results/effects.md",
)  # of the dated results, the site shows these


def pages_in(nav: object) -> list[str]:
    if isinstance(nav, str):
        return [nav]
    items = nav.values() if isinstance(nav, dict) else nav
    assert isinstance(items, (list, type({}.values())))
    return [page for item in items for page in pages_in(item)]


def test_the_navigation_names_every_page_once() -> None:
    config = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    named = pages_in(config["nav"])
    assert len(named) == len(set(named))
    there = {p.relative_to(DOCS).as_posix() for p in DOCS.rglob("*.md")}
    shown = {p for p in there if not p.startswith("results/") or p in PUBLISHED}
    assert set(named) - GENERATED == shown


def test_the_reference_lists_commands_with_their_options() -> None:
    text = command_reference()
    assert "## skidpad adas\n" in text
    assert "## skidpad fleet serve\n" in text
    section = text.split("## skidpad compare\n")[1].split("\n## ")[0]
    assert "`--fail-if`" in section
    assert "skidpad compare A B" in section


def test_links_of_the_home_page_lead_to_pages() -> None:
    text = on_page_markdown(home_page())
    targets = [part.split(")")[0].split("#")[0] for part in text.split("](")[1:]]
    inside = [t for t in targets if t and not t.startswith("http")]
    assert inside
    assert all(t in GENERATED or Path(DOCS, t).exists() for t in inside)


def section(page: str, name: str) -> str:
    """Text between the heading of an item and the next heading."""
    return page.split(f"# {name}\n")[1].split("\n#")[0]


def test_every_weather_vehicle_tyre_and_sensor_has_its_section() -> None:
    weathers, vehicles, sensors = weather_page(), vehicle_page(), sensor_page()
    for name in own_presets():
        assert "| friction at 0, 80 km/h | " in section(weathers, name)
    for name, kind in vehicle_types().items():
        assert f"| mass with driver | {kind.mass:.0f} kg |" in section(vehicles, name)
    for name in ("winter", "summer", "studded", "all_season"):
        assert f"| `{name}` | " in section(vehicles, "Tyres")
    for one in SENSORS.entries():
        assert f"specs.{one.spec.__name__}(" in section(sensors, one.name)
    assert "| `rgb_rear` | rgb | -2, 0, 2.4 | 0, 180 |" in sensors
    assert "| `semantic_bumper` | semantic | 2.3, 0, 0.4 | -20, 0 |" in sensors


def test_numbers_of_a_weather_are_those_of_the_models() -> None:
    pages = weather_page()
    ice = section(pages, "icy_100")
    assert "| ice, snow on the road | 20.0, 0.0 mm |" in ice
    assert "| rain | 50.0 mm/h |" in section(pages, "rain-noon")
    distance = float(ice.split("| braking from 80 km/h | ")[1].split(" m")[0])
    dry = float(section(pages, "clear-noon").split("| braking from 80 km/h | ")[1].split(" m")[0])
    assert distance > 5.0 * dry


def test_the_list_for_language_models_has_every_page() -> None:
    config = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    text = page_list(config["nav"])
    for page in pages_in(config["nav"]):
        assert f"]({page.removesuffix('.md')}.html)" in text


def test_the_citation_names_version_and_licence_of_the_package() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == skidpad.__version__
    assert f'license = "{cited["license"]}"' in (ROOT / "pyproject.toml").read_text("utf-8")
