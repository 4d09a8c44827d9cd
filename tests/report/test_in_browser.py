"""The page in a real browser: its script runs, tables sort, replays get their controls."""

import re
import subprocess

import pytest

from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.report.channels.evaluation.routes import route_blocks
from skidpad.report.elements.page import Cell, Page, Section, Table, Text, write_page
from skidpad.report.matrix.page import write_report
from support.chromium import CHROMIUM, FLAGS
from support.matrix_made import campaign, clear_cut
from support.report_page import page

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")


def dom(path, script, size):
    """What a browser makes of a page when a script of ours has run at its end."""
    path.write_text(path.read_text().replace("</body>", f"<script>{script}</script></body>"))
    where = [f"--user-data-dir={path.parent / 'profile'}", f"--window-size={size}"]
    return subprocess.run(
        [
            CHROMIUM,
            "--headless",
            *FLAGS,
            *where,
            "--virtual-time-budget=2000",
            "--dump-dom",
            f"file://{path}",
        ],
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    ).stdout


@pytest.mark.parametrize("size", ["1280,900", "390,844"])
def test_the_script_of_the_page_runs(tmp_path, size):
    path = tmp_path / "report.html"
    write_page(page(), path)
    shown = dom(path, "document.querySelector('.sortable th').click()", size)
    assert 'aria-sort="ascending"' in shown
    assert 'class="bar"' in shown
    assert "3.1 s · contact" in shown


def test_a_word_wider_than_a_phone_is_broken(tmp_path):
    path = tmp_path / "report.html"
    text = Text(f"results hash {'0752e679' * 16}.")  # Chromium's windows are 485 px wide at least
    write_page(Page(title="t", subtitle="", sections=[Section("s", [text])]), path)
    root = "document.documentElement"
    measured = f"{root}.dataset.wider = {root}.scrollWidth - {root}.clientWidth"
    assert 'data-wider="0"' in dom(path, measured, "390,844")


def test_a_table_with_long_remarks_is_whole_on_a_screen_of_1400_pixels(tmp_path):
    path = tmp_path / "report.html"
    remark = "1 of 20 seeds had one, at most 22 % do (95 %)"
    row = [Cell("3 · + traffic-light assist, resume"), *[Cell("0.25", note=remark)] * 6]
    heads = [("configuration", ""), *[("crashes with vehicles per run", "")] * 6]
    table = Table(heads, [row] * 3, "What happened")
    write_page(Page(title="t", subtitle="", sections=[Section("s", [table])]), path)
    box = "document.querySelector('.scroll')"
    measured = f"document.documentElement.dataset.cut = {box}.scrollWidth - {box}.clientWidth"
    assert 'data-cut="0"' in dom(path, measured, "1400,900")


def test_a_table_wider_than_a_phone_says_that_it_can_be_dragged(tmp_path):
    path = tmp_path / "report.html"
    wide, narrow = (
        Table([(f"column {k}", "") for k in range(n)], [[Cell("1")] * n], f"{n}") for n in (7, 2)
    )
    write_page(Page(title="t", subtitle="", sections=[Section("s", [wide, narrow])]), path)
    hints = "[...document.querySelectorAll('.scroll')].map(e => getComputedStyle(e, '::before').content)"
    shown = dom(path, f"document.documentElement.dataset.hints = {hints}.join('|')", "390,844")
    found = re.search(r'data-hints="([^"]*)"', shown).group(1).replace("&quot;", "")
    assert found == "drag sideways to see all of it|none"


@pytest.mark.parametrize("size", ["1400,900", "1000,900"])
def test_no_table_of_the_matrix_page_is_cut(tmp_path, size):
    campaign(tmp_path, clear_cut, seeds=9)
    path = write_report(tmp_path)
    boxes = "[...document.querySelectorAll('.scroll')]"
    script = (
        "document.querySelectorAll('details').forEach(d => d.open = true);"
        f"document.documentElement.dataset.cut = {boxes}"
        ".filter(e => e.scrollWidth > e.clientWidth).length;"
        f"document.documentElement.dataset.tables = {boxes}.length;"
    )
    shown = dom(path, script, size)
    assert 'data-cut="0"' in shown
    assert int(re.search(r'data-tables="(\d+)"', shown).group(1)) > 20


def test_no_table_of_the_evaluation_page_is_cut(tmp_path):
    names = [i.value for i in Indicator]
    counts = {f"violations_{n}": 100.0 for n in names} | {f"cause_many_{n}": 100.0 for n in names}
    rows = [{"name": "r.mcap", "route": f"route-{k}", "hours": 1.0, **counts} for k in range(1, 7)]
    blocks = route_blocks({"segment_table": rows})
    path = tmp_path / "report.html"
    write_page(Page(title="t", subtitle="", sections=[Section("s", blocks)]), path)
    script = (
        "document.documentElement.dataset.cut = [...document.querySelectorAll('.scroll')]"
        ".filter(e => e.scrollWidth > e.clientWidth).length"
    )
    assert len(blocks) == 4
    assert 'data-cut="0"' in dom(path, script, "1400,900")
