"""The pictures of the README, from the program as it is: `make figures` writes them to docs/img.

python tools/readme_pictures.py docs/img               # the cockpit
python tools/readme_pictures.py docs/img out/adas      # and the first page of that report
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image

WIDTH, HEIGHT = 1280, 940  # pixels
COCKPIT_HEIGHT = 793  # of them, down to the end of the pictures
QUALITY = 82  # of the pictures
WAIT_MS = 300_000.0  # kernels may have to be compiled
DRIVEN_S = 32.0  # simulated: the stack comes along a street of the town, lamps mirrored in it
DRIVE = [
    "drive",
    "--no-browser",
    "--weather",
    "examples/dusk_rain.yaml",
    "--map",
    "town",
    "--traffic",
    "random",
    "--vehicles",
    "24",
    "--sensors",
    "objects",
    "--configs",
    "4",
    "--seed",
    "4",
]
TIME = """s => parseFloat([...document.querySelectorAll('.cockpit dt')]
    .find(dt => dt.textContent === 'time')?.nextElementSibling.textContent) > s"""


def photograph(
    address: str, file: Path, ready: Callable[[Any], None], height: int = HEIGHT
) -> None:
    """Write a picture of the top of a page once `ready` has seen that it is complete."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium") or shutil.which("chromium-browser")
    flags = ["--no-sandbox", "--disable-gpu"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=flags)
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(address)
        ready(page)
        shot = Image.open(BytesIO(page.screenshot()))
        shot.crop((0, 0, WIDTH, height)).convert("RGB").save(file, quality=QUALITY)
        browser.close()


def cockpit(file: Path) -> None:
    """The cockpit in rain at dusk, our stack at the wheel."""

    def driven(page: Any) -> None:
        page.wait_for_function(TIME, arg=DRIVEN_S, timeout=WAIT_MS)

    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "skidpad", *DRIVE, "--out", f"{folder}/run"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            address = next(w for w in process.stdout.readline().split() if w.startswith("http"))
            try:
                photograph(address, file, driven, COCKPIT_HEIGHT)
            finally:
                process.terminate()


def report(folder: Path, file: Path) -> None:
    """The first screen of a campaign's page."""
    page = (folder / "report.html").resolve().as_uri()
    photograph(page, file, lambda page: page.wait_for_load_state("networkidle"))


if __name__ == "__main__":
    target = Path(sys.argv[1])
    cockpit(target / "cockpit-page.webp")
    if len(sys.argv) > 2:
        report(Path(sys.argv[2]), target / "report.png")
