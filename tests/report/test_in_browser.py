"""The page in a real browser: its script runs, tables sort, replays get their controls."""

import subprocess

import pytest
from test_page import page

from chromium import CHROMIUM, FLAGS
from skidpad.report.page import write_page


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.parametrize("size", ["1280,900", "390,844"])
def test_the_script_of_the_page_runs(tmp_path, size):
    path = tmp_path / "report.html"
    write_page(page(), path)
    clicked = path.read_text().replace(
        "</body>", "<script>document.querySelector('.sortable th').click()</script></body>"
    )
    path.write_text(clicked)
    where = [f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={size}"]
    dom = subprocess.run(
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
    assert 'aria-sort="ascending"' in dom
    assert 'class="bar"' in dom
    assert "3.1 s · contact" in dom
