import pytest

from support.chromium import CHROMIUM, FLAGS


@pytest.fixture(scope="module")
def browser():
    pytest.importorskip("nicegui", reason="nicegui is not installed (extra cockpit)")
    sync = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed (cockpit in chromium)"
    )
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with sync.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield opened
        opened.close()
