"""The pictures of docs/fleet.md: pages of the recorded fleet in Chromium.

    python tools/fleet_pictures.py docs/img

A page of the manufacturer each, as wide as a window; the dashboard also as wide as a phone. No test
compares them: they are for looking at. Chromium and the package playwright must be installed.
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import ViewportSize, sync_playwright

from skidpad.cli.fleet.demo import open_recorded

FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
WINDOW, PHONE = ViewportSize(width=1180, height=800), ViewportSize(width=390, height=844)
PAGES = (("work", "/work", WINDOW, False), ("changes", "/changes", WINDOW, False),
         ("dashboard", "/", WINDOW, True), ("phone", "/", PHONE, False))  # fmt: skip
SETTLE_MS = 3000.0  # until a page has come whole


def main() -> int:
    """Draw all of them."""
    out = Path(sys.argv[1])
    said: list[str] = []
    with TemporaryDirectory() as folder, open_recorded(Path(folder), 0, said.append) as address:
        link = next(found[0] for line in said if (found := re.search(rf"{address}\S+", line)))
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            context = browser.new_context(viewport=WINDOW)
            page = context.new_page()
            page.goto(link)
            for name, path, size, whole in PAGES:
                page.set_viewport_size(size)
                page.goto(f"{address}{path}")
                page.wait_for_timeout(SETTLE_MS)
                page.screenshot(path=out / f"fleet-{name}.png", full_page=whole)
            browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
