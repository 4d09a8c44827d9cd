"""The gallery: its commands are the program's, and its replays play in a page without a server."""

from __future__ import annotations

import re
import shutil

import pytest
from typer.main import get_command

from gallery import CSS, DATA, ROOT, gallery_page, make, player, read_list, words_of
from skidpad.cli.main import app
from support.chromium import CHROMIUM, FLAGS

ENTRIES = read_list()
MOST_BYTES = 3_000_000
FILES = re.compile(r"examples/[\w./]+")
CLOCK = "id => document.getElementById(id).querySelector('small').textContent"
OTHER = (
    "([id, before]) => document.getElementById(id).querySelector('small').textContent !== before"
)


def test_at_least_twelve_replays_have_a_title_and_a_sentence() -> None:
    assert len(ENTRIES) >= 12
    assert len({e.name for e in ENTRIES}) == len({e.title for e in ENTRIES}) == len(ENTRIES)
    for entry in ENTRIES:
        assert entry.look.endswith("."), entry.name
        assert entry.begin < entry.end


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda e: e.name)
def test_a_command_is_one_that_the_program_takes(entry) -> None:
    name, *words = words_of(entry, ROOT / "out")
    root = get_command(app)
    context = root.make_context("skidpad", [name, *words], resilient_parsing=True)
    command = root.get_command(context, name)
    assert command is not None
    while hasattr(command, "list_commands"):
        command, words = command.get_command(context, words[0]), words[1:]
    command.make_context(name, words, parent=context)
    assert all((ROOT / file).is_file() for file in FILES.findall(entry.command))


def test_every_replay_is_on_the_page_with_its_data_and_none_lies_about() -> None:
    page = gallery_page()
    for entry in ENTRIES:
        assert f'id="{entry.name}"' in page
        assert f'src="gallery/{entry.name}.js"' in page
        assert f"$ skidpad {entry.command} --out out/gallery/{entry.name}\n" in page
    assert {p.stem for p in DATA.glob("*.js")} == {e.name for e in ENTRIES}
    assert sum(p.stat().st_size for p in DATA.iterdir()) < MOST_BYTES


def test_the_command_of_a_replay_makes_its_data_again(tmp_path) -> None:
    entry = next(e for e in ENTRIES if e.name == "split")
    made = make(entry, tmp_path / "out", tmp_path)
    assert made.read_bytes() == (DATA / made.name).read_bytes()


def test_the_scenario_of_the_tutorial_is_the_one_of_the_gallery() -> None:
    printed = (ROOT / "docs" / "tutorials" / "own-scenario.md").read_text("utf-8")
    assert (ROOT / "examples" / "cut_in.xosc").read_text("utf-8") in printed


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    folder = tmp_path_factory.mktemp("gallery")
    shutil.copytree(DATA, folder / "gallery")
    (folder / "gallery" / "player.js").write_text(player(), "utf-8")
    (folder / "gallery" / "player.css").write_text(CSS, "utf-8")
    shown = [line for line in gallery_page().splitlines() if line.startswith("<")]
    text = '<!doctype html><meta charset="utf-8">' + "\n".join(shown)
    (folder / "page.html").write_text(text, "utf-8")
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        opened = browser.new_page(viewport={"width": 390, "height": 844})
        opened.wrong = []
        opened.on("pageerror", lambda error: opened.wrong.append(str(error)))
        opened.on("requestfailed", lambda request: opened.wrong.append(request.url))
        opened.on("request", lambda r: r.url.startswith("http") and opened.wrong.append(r.url))
        opened.goto((folder / "page.html").as_uri())
        yield opened
        browser.close()


def test_every_replay_plays_from_a_file_and_its_time_moves(page) -> None:
    for entry in ENTRIES:
        figure = page.locator(f"#{entry.name}")
        figure.get_by_role("button", name="play").click()
        begun = page.evaluate(CLOCK, entry.name)
        page.wait_for_function(OTHER, arg=[entry.name, begun], timeout=60_000)
        figure.get_by_role("button").click()
    assert page.wrong == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_replay_draws_something_that_changes(page) -> None:
    drawn = "id => document.getElementById(id).querySelector('canvas').toDataURL()"
    for entry in ENTRIES:
        slider = page.locator(f"#{entry.name} input")
        last = int(slider.get_attribute("max"))
        pictures = set()
        for k in (0, last // 2, last):
            slider.evaluate("(e, k) => { e.value = k; e.dispatchEvent(new Event('input')) }", k)
            pictures.add(page.evaluate(drawn, entry.name))
        assert len(pictures) == 3, entry.name
