"""A driven segment: recorded, repeatable, and blind to the truth topic."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from msgspec.structs import replace

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.channels.drive import drive_segment
from skidpad.campaign.channels.routes import chosen_routes, driven_routes
from skidpad.campaign.recipes.channels import RECIPE, segments, warm_up
from skidpad.campaign.workers.pool import local
from skidpad.core.channels import ChannelFrame, Decision, TruthFrame
from skidpad.core.errors import ConfigError, OutputError
from skidpad.core.run import ChannelCrew
from skidpad.recording.campaign.ledger import LEDGER
from skidpad.recording.campaign.results import read_results
from skidpad.recording.channels.content_hash import recording_hash
from skidpad.recording.channels.drives import read_outcomes
from skidpad.recording.channels.mcap_files import McapRecording
from skidpad.stack.channels.arbiter import Reason
from support.runs import segment_run

BOTH = ("lav_like", "tfuse_like")


@pytest.mark.req("C-020", "C-022", "C-023", "C-210")
def test_a_segment_gives_every_topic_each_cycle_and_the_same_bytes_again(tmp_path):
    outcome = drive_segment(segment_run(), tmp_path / "a.mcap")
    drive_segment(segment_run(), tmp_path / "b.mcap")
    assert recording_hash(tmp_path / "a.mcap") == recording_hash(tmp_path / "b.mcap")
    drive_segment(segment_run(seed=2), tmp_path / "c.mcap")
    assert recording_hash(tmp_path / "a.mcap") != recording_hash(tmp_path / "c.mcap")
    recording = McapRecording(tmp_path / "a.mcap")
    items = [m.item for m in recording.messages()]
    assert recording.channels == BOTH
    for kind, count in ((ChannelFrame, 80), (TruthFrame, 40), (Decision, 40)):
        assert sum(isinstance(i, kind) for i in items) == count
    assert outcome.driven_s == pytest.approx(4.0)
    assert outcome.distance_m > 5.0
    assert sum(outcome.driving_s.values()) + outcome.minimal_risk_s == pytest.approx(4.0)


@pytest.mark.req("C-023")
def test_three_channels_in_town(tmp_path):
    names = (*BOTH, "reference_like")
    three = segment_run("route-5", ChannelCrew(channels=names, drive_by="reference_like"))
    outcome = drive_segment(three, tmp_path / "a.mcap")
    assert list(outcome.driving_s) == ["reference_like"]
    frames = [m for m in McapRecording(tmp_path / "a.mcap").messages() if m.channel == 2]
    assert any(len(m.item.objects) for m in frames)


@pytest.mark.req("C-210")
def test_routes_are_the_six_and_hours_are_split():
    routes = chosen_routes("all")
    assert len(routes) == 6
    assert {r.course.map for r in routes} == {"town", "figure8"}
    night = driven_routes()["route-4"].weather
    assert night.is_night
    plans = segments(routes, 2.5, segment_run(seed=2))
    assert sum(p.duration for p in plans) == pytest.approx(9000.0)
    assert max(p.duration for p in plans) == 600.0
    assert len({p.name for p in plans}) == len(plans)
    other = segments(routes, 2.5, segment_run(seed=3))
    assert not {p.seed for p in plans} & {p.seed for p in other}


def test_wrong_words_are_refused():
    with pytest.raises(ConfigError, match="unknown route"):
        chosen_routes("route-9")
    with pytest.raises(ConfigError, match="drive-by"):
        ChannelCrew(drive_by="nobody")


def test_a_campaign_resumes_and_refuses_other_settings(tmp_path):
    campaign = Campaign(RECIPE, [segment_run(duration=1.0)])
    first = campaign.run(tmp_path, local(1, warm_up))
    assert first.driven == 1
    assert not first.failed
    (outcome,) = read_outcomes([tmp_path])
    again = campaign.run(tmp_path, local(1), resume=True)
    assert (again.driven, again.content_hash) == (0, first.content_hash)
    row = read_results(tmp_path).row(0, named=True)
    assert row["log_hash"] == outcome.content_hash
    assert (row["distance_m"], row["ended"]) == (outcome.distance_m, "time")
    with pytest.raises(OutputError, match="something else"):
        Campaign(RECIPE, [segment_run(crew=ChannelCrew(noise=2.0), duration=1.0)]).run(
            tmp_path, local(1), resume=True
        )


@pytest.mark.req("C-026")
def test_other_maps_by_name_or_file(tmp_path):
    (route,) = chosen_routes("route-6", "straight")
    outcome = drive_segment(replace(route, duration=3.0), tmp_path / "a.mcap")
    assert outcome.distance_m > 3.0


@pytest.mark.req("C-026")
def test_one_channel_can_drive_without_any_other(tmp_path):
    crew = ChannelCrew(channels=("tfuse_like",), drive_by="tfuse_like")
    alone = segment_run(crew=crew, duration=2.0)
    outcome = drive_segment(alone, tmp_path / "a.mcap")
    assert outcome.driving_s == {"tfuse_like": pytest.approx(2.0)}


@pytest.mark.slow
@pytest.mark.req("L-7")
def test_a_campaign_that_was_killed_goes_on_to_the_same_results(tmp_path):
    root = Path(__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root / "src")}
    hours = f"{6 * 2.0 / 3600.0}"  # six routes, 2 s each
    call = [sys.executable, "-m", "skidpad", "channels", "drive", "--hours", hours]
    call += ["--workers", "1", "--out", str(tmp_path / "part")]
    parent = subprocess.Popen(call, env=environment, stderr=subprocess.DEVNULL)
    ledger = tmp_path / "part" / LEDGER
    deadline = time.monotonic() + 900.0
    while not (ledger.exists() and b"\n" in ledger.read_bytes()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    done = len(ledger.read_bytes().splitlines())
    subprocess.run([*call, "--resume"], check=True, env=environment, timeout=900)
    whole = Campaign(RECIPE, segments(chosen_routes("all"), float(hours), segment_run(seed=0)))
    whole.run(tmp_path / "whole", local(1))
    assert done < 6 == len(ledger.read_bytes().splitlines())
    assert read_results(tmp_path / "part").equals(read_results(tmp_path / "whole"))


@pytest.mark.req("C-9", "C-010")
@pytest.mark.parametrize("route", ["route-1", "route-2"])
def test_the_arbiter_runs_no_more_red_lights_than_the_channel_that_sees_them(tmp_path, route):
    """The preferred channel cannot see lights: alone it runs one here."""
    blind_first = ("tfuse_like", "lav_like")

    def driven(by):
        crew = ChannelCrew(channels=blind_first, drive_by=by)
        return drive_segment(segment_run(route, crew, duration=90.0), tmp_path / f"{by}.mcap")

    blind, seeing, arbiter = driven("tfuse_like"), driven("lav_like"), driven("arbiter")
    assert blind.red_lights_run > 0
    assert arbiter.red_lights_run <= seeing.red_lights_run
    assert arbiter.driving_s["tfuse_like"] > 10.0  # it drives where there is no light ahead
    reasons = [
        m.item.reason
        for m in McapRecording(tmp_path / "arbiter.mcap").messages()
        if isinstance(m.item, Decision)
    ]
    assert Reason.LIGHTS.value in reasons
