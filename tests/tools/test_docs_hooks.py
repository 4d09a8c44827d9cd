"""The site's navigation names every page, and its generated pages say what the program says."""

from __future__ import annotations

from pathlib import Path

import yaml

from docs_hooks import ROOT, command_reference, home_page, on_page_markdown

DOCS = ROOT / "docs"
GENERATED = {"index.md", "reference/cli.md", "reference/settings.md"}


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
    shown = {p for p in there if not p.startswith("results/") or p == "results/claims.md"}
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
    assert all(Path(DOCS, t).exists() for t in inside)
