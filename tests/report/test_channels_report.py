import json
import re
from html import unescape
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from skidpad.core.errors import InputError
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.monitor import MonitorSettings
from skidpad.evidence.channels.timing import MODULES
from skidpad.live.watch import Timer, watch
from skidpad.recording.hazards.records import read_hazards
from skidpad.recording.hazards.searched import add_search
from skidpad.report.channels.data import load_drive
from skidpad.report.channels.figures import risk, timing
from skidpad.report.channels.page import drive_page, write_drive_report
from skidpad.report.channels.worlds import UNIT, worlds_replay
from skidpad.report.elements.figures import PALETTE
from skidpad.report.elements.timeline import Mark, Strip, timelines
from support.channel_worlds import Eyes, World, drive
from support.report_page import read_page
from support.svg_values import curves_of

WORLD = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-11.0, 0, 0, 15.5, 0), (50.0, 3.5, 0, 15, 0)]))
EYES = (Eyes("lav", 0.03), Eyes("tfuse", 0.03, blind=(0,)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("watched")
    ticks = iter(range(0, 10**12, 1_000_000))
    watch(drive(WORLD, EYES, 12.0), folder, MonitorSettings(), Timer(lambda: next(ticks)))
    return folder


@pytest.mark.req("C-034", "C-106", "C-211", "C-233", "C-236", "C-238", "C-17")
def test_the_page_holds_every_part_and_needs_no_network(folder):
    text = write_drive_report(folder).read_text()
    for title in ("Timeline", "Hazards", "Safety case", "Indicators", "Risk", "Computing time"):
        assert f"<h2>{title}</h2>" in text
    assert not re.search(r'(src|href)="(?!#|data:)|url\(', text.replace("url(#", ""))
    assert 'class="worlds"' in text
    assert "Ego tailgated at" in text


def test_what_a_search_around_a_hazard_came_to_stands_on_its_card(folder):
    one = next(read_hazards(folder))
    add_search(folder, one.id, ["It would have been a crash with OthersPace 1.1 instead of 1."])
    assert "crash with OthersPace 1.1" in write_drive_report(folder).read_text()
    (folder / "searches.json").write_text('{"h1": 3}')
    with pytest.raises(InputError, match=r"searches\.json"):
        load_drive(folder)
    (folder / "searches.json").unlink()


@pytest.mark.req("C-033", "C-104")
def test_indicator_table_agrees_with_the_summary(folder):
    page = drive_page(load_drive(folder))
    table = next(s for s in page.sections if s.title == "Indicators").blocks[0]
    audit = json.loads((folder / "monitor.json").read_text())["indicators"]
    assert [int(row[6].text) for row in table.rows] == [a["violation_events"] for a in audit]
    assert [int(row[8].text) for row in table.rows] == [a["not_evaluated_cycles"] for a in audit]
    assert all(row[2].text == (a["claim"] or "") for row, a in zip(table.rows, audit, strict=True))


@pytest.mark.req("C-104")
def test_every_indicator_carries_what_a_violation_points_at_into_the_page(folder):
    drive_ = load_drive(folder)
    table = next(s for s in drive_page(drive_).sections if s.title == "Indicators").blocks[0]
    audit = json.loads((folder / "monitor.json").read_text())["indicators"]
    entries = [drive_.thresholds[Indicator(a["indicator"])] for a in audit]
    meanings = [f"{entry.label}: {entry.meaning}" for entry in entries]
    claimed = [m for m, a in zip(meanings, audit, strict=True) if a["claim"]]
    assert len(claimed) >= 9
    assert all(claimed)
    assert [row[0].hint for row in table.rows] == meanings
    html = unescape(read_page(write_drive_report(folder)))
    for meaning in filter(None, meanings):
        assert f'title="{meaning}"' in html


@pytest.mark.req("C-030", "C-033")
def test_a_tree_node_is_challenged_exactly_when_an_indicator_below_it_was_violated(folder):
    drive_ = load_drive(folder)
    root = next(s for s in drive_page(drive_).sections if s.title == "Safety case").blocks[0].root
    statements = [s for argument in root.children for s in argument.children]
    against = {a["claim"] for a in drive_.summary["indicators"] if a["violation_cycles"]}
    challenged = {s.title.split()[0] for s in statements if s.state == "challenged"}
    assert against == challenged
    assert len(statements) == 10


@pytest.mark.req("C-211", "C-212")
def test_the_replay_shows_each_channel_its_own_objects_in_place(folder):
    record = next(r for r in read_hazards(folder) if r.type.value == "ego_tailgated")
    data = worlds_replay(record)
    lav, tfuse = data["cycles"][data["mark"]]
    assert (len(lav[2]), len(tfuse[2])) == (2, 1)
    follower = min(lav[2], key=lambda box: box[0])
    gap = (lav[0][0] - follower[0]) * UNIT
    assert len(lav[1]) >= 4  # plan and predictions are drawn at every moment
    assert len(lav[3]) == 2
    t = data["t0"] + data["mark"] * data["dt"]
    assert gap == pytest.approx(11.0 - 0.5 * t, abs=0.2)  # it starts 11 m behind, closes at 0.5 m/s
    assert data["names"] == ["lav", "tfuse"]


def test_a_timeline_marks_alarms_and_what_was_not_evaluated():
    t = np.arange(0.0, 60.0, 0.1)
    value = np.where(t < 20.0, np.nan, 0.9)
    value[t > 50.0] = 0.1
    strip = Strip("score", t, value, value < 0.5, threshold=0.5)
    svg = timelines([strip], [Mark(50.0, 55.0, "a < b")], 0.0, 60.0)
    (missing,) = re.findall(
        r'x="([\d.]+)" y="\d+" width="([\d.]+)" height="[\d.]+" class="missing"', svg
    )
    assert float(missing[1]) == pytest.approx(840.0 / 3.0, abs=4.0)
    assert "a &lt; b" in svg
    alarms = re.findall(r'width="([\d.]+)" height="3"', svg)
    assert sum(map(float, alarms)) == pytest.approx(840.0 / 6.0, abs=6.0)


def test_reports_of_the_same_drive_are_the_same_bytes(folder):
    assert write_drive_report(folder).read_bytes() == write_drive_report(folder).read_bytes()


def changed(folder, tmp_path, **words):
    """The folder with other words in its summary."""
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    summary = json.loads((tmp_path / "monitor.json").read_bytes())
    (tmp_path / "monitor.json").write_text(json.dumps(summary | words))
    return tmp_path


def test_a_recording_that_lost_something_says_so(folder, tmp_path):
    losses = {"cut": True, "chunks": 2, "stale": {"a": 1}}
    page = write_drive_report(changed(folder, tmp_path, losses=losses)).read_text()
    assert "was not read in full" in page


UNKNOWN = {"name": "no_hazard", "t_start": 0.0, "t_end": 1.0}


@pytest.mark.parametrize(
    "words",
    [
        {"indicators": [{}]},
        {"hazards": [{"name": "a"}]},
        {"hazards": [UNKNOWN]},
        {"seconds": None},
        {"losses": []},
    ],
)
def test_a_summary_that_cannot_be_shown_is_refused_in_a_sentence(folder, tmp_path, words):
    with pytest.raises(InputError, match="monitor.json"):
        write_drive_report(changed(folder, tmp_path, **words))


@pytest.mark.req("C-236", "C-238")
def test_times_are_drawn_by_objects_and_over_the_drive():
    """Modules of 1 to 6 times a base that grows with the objects, so that none can be exchanged."""
    n = 400
    objects = np.repeat([1, 2, 4, 8], n // 4)
    times = {m: (k + 1.0) * objects for k, m in enumerate(("total", *MODULES))}
    table = pl.DataFrame({"cycle": np.arange(n), "objects": objects, **times})
    over_time, by_objects = timing(SimpleNamespace(timing=table))
    for k, colour in enumerate(PALETTE[: len(times)]):
        lines = [p for _, p in curves_of(by_objects.svg, colour) if len(p) == 4]
        assert len(lines) == 1
        assert lines[0] == pytest.approx(
            np.array([[o, (k + 1) * o] for o in (1, 2, 4, 8)]), abs=0.05
        )
    assert "the budget is 25 ms" in over_time.caption


@pytest.mark.req("C-106")
def test_the_risk_of_hazard_free_driving_is_cumulated_and_hazards_are_left_out():
    t = np.arange(0.0, 100.0, 0.1)
    score = np.where(t < 50.0, 1.0 - t / 100.0, 0.1)  # risks 0 to 0.5, then a hazard of 0.9
    hazard = {"name": "ego_tailgating", "t_start": 55.0, "t_end": 100.0}
    trace = SimpleNamespace(subject="lav", t=t, value=score)
    drive_ = SimpleNamespace(
        traces=lambda indicator: [trace] if indicator is Indicator.SAFETY_SCORE else [],
        summary={"hazards": [hazard]},
    )
    figure, words = risk(drive_)
    ((_, line),) = curves_of(figure.svg, PALETTE[0])  # straight, so thinned
    assert line[0] == pytest.approx([0.0, 1 / 500], abs=2e-3)
    assert line[-1][0] == pytest.approx(0.5, abs=5e-3)
    for risk_, share in ((0.1, 0.2), (0.25, 0.5), (0.4, 0.8)):
        assert np.interp(risk_, line[:, 0], line[:, 1]) == pytest.approx(share, abs=0.01)
    assert (
        "lav: median, 90 % and 99 % of 500 cycles: 0.25, 0.45, 0.49; above 0.2 in 59.8 %"
        in words.text
    )
