"""Pages and output as they are rendered name no id without what it is, and only ids that are explained."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from support.ids import ROOT, bare_ids, check_ids, texts_in_script, texts_of


def test_a_page_is_read_by_block() -> None:
    page = "<p>rain <b>slows</b> it down (F-08)</p><td>F-08</td><td>rain slows it</td><p>F-17</p>"
    page += (
        '<a href="x">F-18</a><script>F-19</script><p>as <code>skidpad study A-278</code> does</p>'
    )
    assert [ids for text in texts_of(page) if (ids := bare_ids(text))] == [["F-17"]]


def matrix_page(folder: Path) -> Path:
    """A campaign of drawn numbers."""
    from skidpad.report.matrix.page import write_report
    from support.matrix_drawn import write_drawn_campaign

    write_drawn_campaign(folder)
    return write_report(folder)


def drive_page(folder: Path) -> Path:
    """A drive with two channels that a monitor watched."""
    from skidpad.evidence.channels.monitor import MonitorSettings
    from skidpad.live.watch import Timer, watch
    from skidpad.report.channels.page import write_drive_report
    from support.channel_worlds import Eyes, World, drive

    world = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-11.0, 0, 0, 15.5, 0)]))
    seen = drive(world, (Eyes("lav", 0.03), Eyes("tfuse", 0.03)), 6.0)
    watch(seen, folder, MonitorSettings(), Timer(perf_counter_ns))
    return write_drive_report(folder)


@pytest.mark.parametrize("write", [matrix_page, drive_page])
def test_ids_on_a_report_stand_with_what_they_are(
    write: Callable[[Path], Path], tmp_path: Path
) -> None:
    check_ids(texts_of(write(tmp_path).read_text(encoding="utf-8")))


COCKPIT = """
from starlette.testclient import TestClient

from skidpad.cockpit.about import About
from skidpad.cockpit.parts import list_parts
from skidpad.cockpit.serving import application
from skidpad.core.run import RunSpec
from support.cockpit.producers import bridge

app = application(bridge(), About("drive", vehicles=9, parts=list_parts(RunSpec())))
print(TestClient(app).get("/").text)
"""


def test_ids_on_the_cockpits_page_stand_with_what_they_are() -> None:
    pytest.importorskip("nicegui", reason="nicegui is not installed (extra cockpit)")
    # NiceGUI serves one site in a process, and other tests of this one may have built theirs
    env = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    page = subprocess.run(
        [sys.executable, "-c", COCKPIT], capture_output=True, text=True, check=True,
        cwd=ROOT / "tests", env=env,
    ).stdout  # fmt: skip
    check_ids(texts_in_script(page))


FLEET = {"axle": ("/", "/work", "/places", "/case", "/changes"), "red operator": ("/alerts",),
         "researcher": ("/research",)}  # fmt: skip


def test_ids_on_the_fleets_pages_stand_with_what_they_are(tmp_path: Path) -> None:
    pytest.importorskip("nicegui", reason="nicegui is not installed (extra fleet)")
    from skidpad.fleet.site.build import pages_of
    from support.fleet_server import call, filled, loaded, someone, start_fleet

    tokens = filled(tmp_path / "data")
    child, address = start_fleet(tmp_path / "data")
    with child:
        try:
            headers = {"Authorization": f"Bearer {tokens['axle']}"}
            hazards = call("GET", f"{address}/api/v1/hazards", headers=headers).json()
            replay = f"/replay/{hazards[0]['id']}"
            visited = {**FLEET, "axle": (*FLEET["axle"], replay)}
            assert sum(map(len, visited.values())) == len(pages_of(None, None))
            for who, paths in visited.items():
                with someone(address, tokens[who]) as client:
                    for path in paths:
                        check_ids(texts_in_script(loaded(client, path)))
        finally:
            child.terminate()


OUTPUT = (
    "extensions", "doctor", "friction", "profiles list", "profiles show thesis_text",
    "profiles diff thesis_text recommended", "campaign --help",
)  # fmt: skip


@pytest.mark.parametrize("words", OUTPUT)
def test_ids_in_output_stand_with_what_they_are(words: str, monkeypatch) -> None:
    monkeypatch.chdir(ROOT)
    done = CliRunner().invoke(app, words.split(), env={"COLUMNS": "400"})
    assert done.exit_code == 0, done.output
    check_ids(done.output.splitlines())
