"""The monitor beside a drive: the same judgement, never in the way, and its death is one sentence."""

from __future__ import annotations

import io
import json
import os
import signal
import threading
import time

import numpy as np
import polars as pl
import pytest

from skidpad.campaign.channels.drive import drive_segment
from skidpad.core.channels import ChannelFrame, Context
from skidpad.core.errors import ConfigError
from skidpad.evidence.channels.monitor import MonitorSettings
from skidpad.evidence.channels.timing import LIVE_TIMES, delay_sentence, late_cycles
from skidpad.live import links as live_links
from skidpad.live.child import ALARMS
from skidpad.live.monitor_link import MonitorLink
from skidpad.live.outcome import read_outcome
from skidpad.live.settings import Flow, Links, MonitorLinkSettings
from skidpad.live.watch import watch
from skidpad.live.wire import WireSource, cycle_mark, end_mark, pack_item
from skidpad.recording.channels.content_hash import recording_hash
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.indicators import read_indicators
from skidpad.recording.channels.mcap_files import McapRecording
from skidpad.recording.channels.monitored import read_summary, read_timing
from support.channel_worlds import Eyes, Listed, World, drive
from support.runs import segment_run

FOLLOWED = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-30.0, 0.0, 0.0, 16.5, 0.0)]))
BLIND_BEHIND = (Eyes("lav", 0.02), Eyes("tfuse", 0.02, blind=(0,)))
PATIENCE = 600.0  # s for what another process does


def tell(link, source):
    """Pass a listed drive on as the recording sink does."""
    link.hear(None, Context(0.0, {"route": "ring"}))
    by_time: dict[int, list] = {}
    for channel, item in source.rows:
        by_time.setdefault(round(item.t * 10), []).append((channel, item))
    for k, rows in by_time.items():
        for channel, item in rows:
            link.hear(channel, item)
        link.cycle_over(k, 0.1 * k)


def same_judgement(a, b):
    assert (a / "hazards.txt").read_bytes() == (b / "hazards.txt").read_bytes()
    assert read_indicators(a).equals(read_indicators(b))
    assert read_summary(a) == read_summary(b)


def wait_for(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.req("C-001", "C-235")
def test_the_monitor_judges_while_the_drive_goes_on_and_as_the_recording_would_be(tmp_path):
    source = drive(FOLLOWED, BLIND_BEHIND, 16.0)
    live = tmp_path / "live"
    link = MonitorLink(source.channels, live, MonitorLinkSettings())
    tell(link, source)
    alarms = live / ALARMS
    wait_for(lambda: alarms.exists() and "ego_tailgated" in alarms.read_text())  # not over yet
    assert link.process.poll() is None
    link.close()
    after = Listed(source.channels, [(None, Context(0.0, {"route": "ring"})), *source.rows])
    found = watch(after, tmp_path / "after", MonitorSettings())
    assert found.hazards
    same_judgement(live, tmp_path / "after")
    told = [json.loads(line)["hazard"] for line in alarms.read_text().splitlines()]
    assert sorted(told) == sorted(e["name"] for e in read_summary(live)["hazards"])
    assert read_outcome(live).ended == "complete"
    times = read_timing(live, LIVE_TIMES)
    assert times["cycle"].to_list() == list(range(161))
    for column in ("total", "wall_ms", "waited_ms", "faults"):
        assert times[column].is_not_null().all()
        assert times[column].min() >= 0.0


@pytest.mark.req("C-001", "C-203")
def test_a_drive_with_its_monitor_is_the_same_drive_and_judged_the_same(tmp_path):
    spec = segment_run("route-5", duration=3.0)
    drive_segment(spec, tmp_path / "alone.mcap")
    drive_segment(spec, tmp_path / "watched.mcap", Links(monitor=True))
    assert recording_hash(tmp_path / "alone.mcap") == recording_hash(tmp_path / "watched.mcap")
    watch(McapRecording(tmp_path / "alone.mcap", truth=False), tmp_path / "x", MonitorSettings())
    same_judgement(tmp_path / "watched.monitor", tmp_path / "x")


class Doomed(MonitorLink):
    """A monitor that is killed in the middle of the drive."""

    def cycle_over(self, k, t):
        if k == 10:
            self.process.kill()
            self.process.wait()
        super().cycle_over(k, t)


@pytest.mark.req("C-005")
@pytest.mark.parametrize("live", [False, True])
def test_a_monitor_that_is_killed_costs_the_drive_nothing(tmp_path, monkeypatch, live):
    spec = segment_run(duration=2.0)
    drive_segment(spec, tmp_path / "alone.mcap")
    monkeypatch.setattr(live_links, "MonitorLink", Doomed)
    outcome = drive_segment(spec, tmp_path / "a.mcap", Links(monitor=True, live=live))
    assert outcome.driven_s == pytest.approx(2.0)
    assert recording_hash(tmp_path / "alone.mcap") == recording_hash(tmp_path / "a.mcap")
    link = read_outcome(tmp_path / "a.monitor")
    assert link.cycles == 20
    assert link.missing[-1] == 19
    assert "ended with code -9" in link.ended


@pytest.mark.req("C-005")
def test_a_monitor_that_stands_still_holds_nobody_up_and_what_it_missed_is_known(tmp_path):
    """Its process is stopped: a drive that waited for it would wait for ever."""
    source = drive(FOLLOWED, BLIND_BEHIND, 60.0, with_truth=False)
    live = tmp_path / "live"
    settings = MonitorLinkSettings(flow=Flow.LIVE, capacity=3)
    link = MonitorLink(source.channels, live, settings)
    link.process.send_signal(signal.SIGSTOP)
    tell(link, source)
    stopped = link.outcome
    link.process.send_signal(signal.SIGCONT)
    link.close()
    outcome = read_outcome(live)
    assert stopped.missing == outcome.missing
    assert outcome.ended == "complete"
    assert outcome.missing
    missing = set(outcome.missing)
    context = (None, Context(0.0, {"route": "ring"}))
    heard = [row for row in source.rows if round(row[1].t * 10) not in missing]
    watch(Listed(source.channels, [context, *heard]), tmp_path / "same", MonitorSettings())
    same_judgement(live, tmp_path / "same")


@pytest.mark.req("C-203")
@pytest.mark.parametrize(
    "heard", [[0, 1, 2, 9], [0, 1, 84, 225, 226, 400], [0, 200, 201, 390, 391]]
)
def test_cycles_are_those_of_the_recording_however_long_the_silences(heard):
    source = drive(FOLLOWED, BLIND_BEHIND, 40.0, with_truth=False)
    rows = [row for row in source.rows if round(row[1].t * 10) in heard]
    sent = []
    for k in heard:
        sent += [pack_item(c, item) for c, item in rows if round(item.t * 10) == k]
        sent.append(cycle_mark(k, 0.1 * k, 0))
    wire = WireSource(io.BytesIO(b"".join([*sent, end_mark()])), source.channels)
    listed = Listed(source.channels, rows)

    def seen(one):
        return [(c.k, [None if f is None else f.t for f in c.frames]) for c in cycles(one)]

    assert seen(wire) == seen(listed)
    assert wire.losses == listed.losses


@pytest.mark.req("C-001")
def test_poses_that_are_no_numbers_and_a_silent_channel_are_flagged_cycles(tmp_path):
    source = drive(FOLLOWED, BLIND_BEHIND, 4.0)

    def spoilt(channel, item):
        if channel == 0 and isinstance(item, ChannelFrame) and 1.0 < item.t < 1.55:
            return item._replace(ego=np.full(5, np.nan))
        return item

    rows = [
        (c, spoilt(c, item)) for c, item in source.rows if not (c == 1 and 1.95 < item.t < 3.05)
    ]
    link = MonitorLink(source.channels, tmp_path / "live", MonitorLinkSettings())
    tell(link, Listed(source.channels, rows))
    link.close()
    summary = read_summary(tmp_path / "live")
    assert summary["cycles"] == 41
    assert summary["unusable"]["poses"] == {"lav": 5}
    assert summary["unusable"]["absent"] == {
        "tfuse": 10
    }  # the first silent cycle takes the one before
    assert read_outcome(tmp_path / "live").ended == "complete"


def test_a_monitor_that_cannot_write_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("in the way")
    link = MonitorLink(("a", "b"), tmp_path / "file" / "live", MonitorLinkSettings())
    tell(link, drive(FOLLOWED, (Eyes("a"), Eyes("b")), 1.0))
    assert link.missing == list(range(11))
    assert "cannot be written" in link.ended or "ended with code" in link.ended
    link.folder = tmp_path / "elsewhere"
    link.close()


@pytest.mark.req("C-006", "C-235")
def test_late_cycles_have_their_cause():
    rows = pl.DataFrame(
        {
            "cycle": [0, 1, 2, 3, 4, 5],
            "wall_ms": [3.0, 60.0, 40.0, 70.0, 30.0, 26.0],
            "total": [1.0, 1.0, 1.0, 50.0, 1.0, 1.0],
            "writing": [0.1] * 6,
            "waited_ms": [50.0, 58.0, 0.0, 0.0, 0.0, 0.0],
            "faults": [0.0, 0.0, 0.0, 0.0, 0.0, 900.0],
        }
    )
    assert late_cycles(rows)["cause"].to_list() == [
        "no processor was free", "behind an earlier late cycle", "own work",
        "behind an earlier late cycle", "behind an earlier late cycle",
    ]  # fmt: skip
    said = delay_sentence(rows)
    assert said.endswith(
        "later than 25 ms: 3 behind an earlier late cycle, 1 no processor was free, 1 own work"
    )
    alone = late_cycles(rows.filter(pl.col("cycle").is_in([0, 5])))
    assert alone["cause"].to_list() == ["page faults"]


@pytest.mark.req("C-231")
def test_the_monitor_has_a_processor_of_its_own_where_that_is_allowed(tmp_path):
    if not hasattr(os, "sched_getaffinity"):
        pytest.skip("this system has no affinity")
    cpu = min(os.sched_getaffinity(0))
    link = MonitorLink(("a", "b"), tmp_path / "live", MonitorLinkSettings(pin=cpu))
    assert os.sched_getaffinity(link.process.pid) == {cpu}
    tell(link, drive(FOLLOWED, (Eyes("a"), Eyes("b")), 0.5))
    link.close()
    said = read_outcome(tmp_path / "live").isolation
    assert said["processor"] == cpu
    assert {"nice", "governor"} <= said.keys()


def test_a_feeder_that_died_holds_no_drive_at_its_end(tmp_path, monkeypatch):
    monkeypatch.setattr(MonitorLink, "_feed", lambda self: None)
    settings = MonitorLinkSettings(flow=Flow.LIVE, capacity=1)
    link = MonitorLink(("a", "b"), tmp_path / "live", settings)
    tell(link, drive(FOLLOWED, (Eyes("a"), Eyes("b")), 0.5))
    closing = threading.Thread(target=link.close, daemon=True)
    closing.start()
    closing.join(60.0)
    assert not closing.is_alive()
    assert read_outcome(tmp_path / "live").missing == list(range(6))


def test_a_queue_without_room_is_refused():
    with pytest.raises(ConfigError, match="at least 1 cycle, got 0"):
        MonitorLinkSettings(capacity=0)
