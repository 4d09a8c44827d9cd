"""Killed, interrupted, on a full disk, in odd places: nothing done is lost, results are equal (item 7)."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
import yaml

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.core.errors import OutputError
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.campaign.ledger import LEDGER
from skidpad.recording.run.log_files import log_hash, read_log
from support import runs
from support.faults import slow_campaign
from support.faults.readers import here
from support.faults.waiting import PATIENCE, waited
from support.toy_campaign import campaign as toy_campaign

TESTS = Path(__file__).parents[1]
TOSSES = 12


def lines(out):
    path = out / LEDGER
    return path.read_bytes().count(b"\n") if path.exists() else 0


def started(out):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path])}
    return subprocess.Popen(
        [sys.executable, slow_campaign.__file__, str(out), str(TOSSES)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment,
        start_new_session=True,
    )  # fmt: skip


def test_a_campaign_that_is_ended_again_and_again_comes_to_the_same_results(tmp_path):
    whole = slow_campaign.campaign(TOSSES).run(tmp_path / "whole", here)
    out, rng, said = tmp_path / "out", random.Random(11), []
    gate = tmp_path / slow_campaign.GATE
    for how in (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        more = lines(out) + rng.randint(1, 4)
        gate.write_text(str(more + 2))  # it is under way when it is ended, however late we are
        process = started(out)
        assert waited(lambda wanted=more: lines(out) >= wanted), said
        process.send_signal(how)
        said.append(process.communicate(timeout=PATIENCE)[0])
        assert process.returncode == {signal.SIGINT: 130, signal.SIGTERM: 143}.get(how, -how)
        done = (out / LEDGER).read_bytes()
        assert done.count(b"\n") >= more  # nothing that was done is lost
    assert "interrupted; what is done is kept" in said[1]
    gate.unlink()
    process = started(out)
    said.append(process.communicate(timeout=PATIENCE)[0])
    assert process.returncode == 0, said
    finished = slow_campaign.campaign(TOSSES).run(out, here, resume=True)
    assert (finished.driven, finished.runs) == (0, 2 * TOSSES)
    assert finished.content_hash == whole.content_hash


def test_a_full_disk_costs_what_did_not_fit_and_nothing_before(tmp_path):
    whole = toy_campaign(4).run(tmp_path / "whole", here)
    size = (tmp_path / "whole" / LEDGER).stat().st_size
    rng = random.Random(3)
    for number in range(12):
        out = tmp_path / f"out{number}"
        free = rng.randrange(200, size + 3000)
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (free, hard))
        try:
            with suppress(OutputError):  # some are just large enough
                toy_campaign(4).run(out, here)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        again = toy_campaign(4).run(out, here, resume=True)
        assert again.content_hash == whole.content_hash
        assert not [p.name for p in out.iterdir() if p.name.endswith(".part")]


def test_a_run_on_a_full_disk_is_driven_again_as_it_was(tmp_path):
    run = runs.adas_run(duration=1.0, vehicles=2)
    whole = Campaign(RECIPE, [run]).run(tmp_path / "whole", here)
    for kilobytes in (1, 4, 12):
        out = tmp_path / f"out{kilobytes}"
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000 * kilobytes, hard))
        try:
            with pytest.raises(OutputError, match="the disk is full"):
                Campaign(RECIPE, [run]).run(out, here)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        again = Campaign(RECIPE, [run]).run(out, here, resume=True)
        assert again.content_hash == whole.content_hash


@pytest.fixture
def small_disk(tmp_path):
    """A file system of its own, of 1 MB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)]
    try:
        done = subprocess.run(mount, capture_output=True, text=True, check=False)
    except OSError as error:
        pytest.skip(f"no file system can be mounted: {error}")
    if done.returncode:
        pytest.skip(f"no file system can be mounted: {done.stderr.strip()}")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_a_file_system_that_is_really_full(tmp_path, small_disk):
    """Free space between nothing and more than enough; then somebody makes room."""
    whole = toy_campaign(4).run(tmp_path / "whole", here)
    ballast, said = small_disk / "ballast", []
    for free in (0, 4, 8, 12, 16, 24, 512):
        out = small_disk / f"out{free}"
        ballast.write_bytes(
            bytes(4096 * ((os.statvfs(small_disk).f_bavail * 4096 // 1024 - free) // 4))
        )
        try:
            toy_campaign(4).run(out, here)
        except OutputError as error:
            said.append(str(error))
        ballast.unlink()
        again = toy_campaign(4).run(out, here, resume=out.exists())
        assert again.content_hash == whole.content_hash
        assert not [p.name for p in out.iterdir() if p.name.endswith(".part")]
        shutil.rmtree(out)
    assert len(said) >= 3
    assert all("the disk is full" in s for s in said), said


@pytest.fixture
def as_nobody():
    """Rights of a user to whom folders of others are read-only, also where tests run as root."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def test_a_folder_that_may_not_be_written_is_one_sentence(tmp_path, as_nobody):
    root = Path("/")
    for out in (root / "skidpad-out", root / "usr" / "skidpad" / "out"):
        with pytest.raises(OutputError, match="cannot write"):
            toy_campaign(1).run(out, here)
        assert not out.exists()


@pytest.mark.parametrize(
    "name",
    ["with space", "ümläut 名", "a#b%20c?d&e", "line\nbreak", "-rf", "n" * 200, "b\udcffytes"],
)
def test_odd_folders_hold_the_same_results(tmp_path, name):
    run = runs.adas_run(duration=0.5, vehicles=1)
    first = Campaign(RECIPE, [run]).run(tmp_path / "plain", here)
    odd = Campaign(RECIPE, [run]).run(tmp_path / name, here)
    assert odd.content_hash == first.content_hash
    one, two = (read_log(tmp_path / f / RUNS / run.name) for f in ("plain", name))
    assert log_hash(one) == log_hash(two)


def test_a_clock_that_jumps_changes_no_result(tmp_path, monkeypatch):
    run = runs.adas_run(duration=0.5, vehicles=1)
    first = Campaign(RECIPE, [run]).run(tmp_path / "first", here)
    rng = random.Random(2)
    monkeypatch.setattr(time, "time", lambda: rng.uniform(-1e9, 4e9))
    monkeypatch.setattr(time, "perf_counter", lambda: rng.uniform(1.0, 4e9))
    jumpy = Campaign(RECIPE, [run]).run(tmp_path / "jumpy", here)
    assert jumpy.content_hash == first.content_hash


def test_locale_time_zone_and_hash_seed_change_no_result(tmp_path):
    run = runs.adas_run(duration=0.5, vehicles=1)
    here_too = Campaign(RECIPE, [run]).run(tmp_path / "plain", here)
    odd = {
        "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "TZ": "Pacific/Kiritimati",
        "PYTHONHASHSEED": "77", "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path]),
    }  # fmt: skip
    script = TESTS / "support" / "faults" / "odd_place.py"
    ended = subprocess.run(
        [sys.executable, str(script), str(tmp_path / "ö ç"), yaml.safe_dump(run.to_plain())],
        env=os.environ | odd, capture_output=True, timeout=600, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr.decode("utf-8", "replace")[-2000:]
    assert ended.stdout.decode().strip().endswith(here_too.content_hash)
