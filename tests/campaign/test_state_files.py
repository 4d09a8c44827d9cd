"""A run goes on from a file as one that was not cut (T-13); what is no file of it is refused."""

from __future__ import annotations

import zlib
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np
import pytest

from skidpad.campaign.cells.grip import template
from skidpad.campaign.driving.drivers import STACK, find_driver
from skidpad.campaign.recipes.files import runs_of
from skidpad.campaign.runs import state_files
from skidpad.campaign.runs.rerun import last_ticks
from skidpad.campaign.runs.run import OpenRun
from skidpad.campaign.runs.run import run as drive
from skidpad.campaign.runs.state_files import (
    CHECKPOINTS,
    MAGIC,
    REFUSED,
    StateFiles,
    find_nearest,
    read_state,
    unpack_state,
)
from skidpad.core.courses import Scenario
from skidpad.core.errors import CheckpointError
from skidpad.core.run import Friction
from skidpad.core.settings.parts import load_profile
from skidpad.core.simulator import BackendChoice
from skidpad.core.vocabulary import GripModel, SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.recording.run.log_files import log_hash
from skidpad.scenarios.shipped import find_scenario
from support.cut_runs import SCRIPTS, STACKS, go_on, spec_of


def scenario_run(name):
    base = template(
        course=Scenario(),
        duration=15.0,
        seed=5,
        settings=load_profile("recommended", {"grip": GripModel.PHYSICAL}),
        weather=find_weather("clear-noon"),
        driver=find_driver(2, label=STACK),
    )
    weathers = [find_weather("icy_30")]
    (run,) = runs_of(base, [find_scenario(Path(name))], weathers, [Friction.REDUCED], [5])
    return run


def begin(spec):
    """Returns a run whose first tick was driven, and its files."""
    run = OpenRun(spec)
    assert run.step() is not None
    return run, StateFiles(run)


CASES = {
    "figure8 0": lambda: spec_of("figure8", 0, weather="icy_100", duration=20.0),
    "figure8 4": lambda: spec_of("figure8", 4, duration=20.0),
    "town 1": lambda: spec_of("town", 1, weather="icy_100", duration=20.0),
    "motorway 3": lambda: spec_of("motorway", 3, weather="clear-noon", duration=15.0),
    **{name: lambda name=name: scenario_run(name) for name in SCRIPTS},
    "pixels 4": lambda: spec_of("figure8", 4, level=SensorLevel.PIXELS, duration=1.5),
}


@pytest.mark.parametrize("case", CASES)
def test_a_run_goes_on_from_a_file(tmp_path, case):
    spec = CASES[case]()
    log = drive(spec).log
    rng = np.random.default_rng(len(case))
    run, files = begin(spec)
    written = {}
    for k in sorted(int(k) for k in rng.choice(len(log) - 2, 3, replace=False) + 1):
        go_on(run, k - run.tick)
        written[k] = tmp_path / f"{k}"
        files.write(written[k])
    go_on(run)
    assert log_hash(run.finish().log) == log_hash(log), "to write changes nothing"
    for k, path in written.items():
        assert read_state(path, spec).header.tick == k
        run, files = begin(spec)
        files.restore(unpack_state(path))
        assert run.tick == k
        go_on(run)
        rest = run.log.log.finish()
        assert int(rest.tick[0]) == k + 1
        assert log_hash(rest) == log_hash(last_ticks(log, k + 1)), f"from tick {k}"


@cache
def written_bytes():
    run, files = begin(spec_of("figure8", 2, duration=6.0))
    go_on(run, 20)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "there"
        files.write(path)
        return path.read_bytes()


def with_header(**changes):
    _, line, state = written_bytes().split(b"\n", 2)
    header = msgspec.structs.replace(msgspec.json.decode(line, type=state_files.Header), **changes)
    return MAGIC + msgspec.json.encode(header) + b"\n" + state


@pytest.mark.parametrize(
    ("contents", "sentence"),
    [
        (lambda: b"\x80\x04pickle", "is no checkpoint of Skidpad"),
        (lambda: b"", "is no checkpoint of Skidpad"),
        (lambda: with_header(format=99), "with another format: 99, here 1"),
        (lambda: with_header(skidpad="0.0"), "with another Skidpad: 0.0, here "),
        (lambda: with_header(fingerprint="0"), "another fingerprint of machine and libraries: 0"),
        (lambda: with_header(run="0"), "is of another run"),
    ],
)
def test_another_file_is_refused_in_one_sentence(tmp_path, contents, sentence):
    path = tmp_path / "state"
    path.write_bytes(contents())
    with pytest.raises(CheckpointError, match=sentence) as caught:
        read_state(path, spec_of("figure8", 2, duration=6.0))
    assert "\n" not in str(caught.value)


def repacked(change):
    """Returns the file with its state changed, and with the hash of that."""
    _, line, state = written_bytes().split(b"\n", 2)
    plain = msgspec.msgpack.decode(zlib.decompress(state))
    change(plain)
    state = zlib.compress(msgspec.msgpack.encode(plain))
    header = msgspec.json.decode(line, type=state_files.Header)
    header = msgspec.structs.replace(header, state=sha256(state).hexdigest())
    return MAGIC + msgspec.json.encode(header) + b"\n" + state


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "state"
    path.write_bytes(written_bytes()[:-7] + b"\0" * 7)
    _, files = begin(spec_of("figure8", 2, duration=6.0))
    with pytest.raises(CheckpointError, match="is damaged"):
        files.restore(unpack_state(path))


@pytest.mark.parametrize(
    "forged",
    [
        [["object", "subprocess:Popen"], []],
        [["object", "skidpad.recording.run.staging:Path"], []],
        [["object", "skidpad.core.objects.checkpoint:deepcopy"], []],
        [["object", "builtins:eval"], []],
        [["list"], [["struct", "skidpad.campaign.runs.rerun:Film", [["path", "gone.mp4"]]]]],
        [["list"], [["named", "skidpad.campaign.runs.rerun:Film", ["gone.mp4"]]]],
        [["list"], [["_fill", 0]]],
        [["function"], "import os"],
    ],
)
def test_no_file_makes_what_is_no_data(tmp_path, forged):
    path = tmp_path / "state"
    path.write_bytes(repacked(lambda plain: plain["came"].append(forged)))
    _, files = begin(spec_of("figure8", 2, duration=6.0))
    with pytest.raises(CheckpointError, match="cannot be a part of|none of this run"):
        files.restore(unpack_state(path))


def test_a_run_that_begins_otherwise_is_refused(tmp_path):
    path = tmp_path / "state"
    path.write_bytes(written_bytes())
    _, files = begin(scenario_run(SCRIPTS[0]))
    with pytest.raises(CheckpointError, match="begins otherwise"):
        files.restore(unpack_state(path))


def test_a_file_branches_by_name(tmp_path):
    spec = spec_of("figure8", 4, duration=6.0)
    run, files = begin(spec)
    go_on(run, 20)
    files.write(tmp_path / "state")
    hashes = []
    for branch in ("", "a", "b", "a"):
        run, files = begin(spec)
        files.restore(unpack_state(tmp_path / "state"))
        if branch:
            run.branch(branch)
        go_on(run)
        hashes.append(log_hash(run.log.log.finish()))
    assert hashes[1] == hashes[3]
    assert len({*hashes}) == 3


@pytest.mark.parametrize("name", ["Counting", "Giving"])
def test_a_stack_of_the_user_goes_on_from_a_file(tmp_path, name):
    (tmp_path / "stacks.py").write_text(STACKS)
    spec = spec_of("figure8", f"{tmp_path / 'stacks.py'}:{name}", duration=3.0)
    log = drive(spec).log
    run, files = begin(spec)
    go_on(run, 20)
    files.write(tmp_path / "state")
    run, files = begin(spec)
    files.restore(unpack_state(tmp_path / "state"))
    go_on(run)
    assert log_hash(run.log.log.finish()) == log_hash(last_ticks(log, 21))


def test_a_stack_that_is_no_data_is_driven_without_files(tmp_path):
    (tmp_path / "stacks.py").write_text(STACKS)
    spec = spec_of("figure8", f"{tmp_path / 'stacks.py'}:Reading", duration=2.0)
    drive(spec, folder=tmp_path, checkpoints_s=0.5)
    assert "__getstate__" in (tmp_path / CHECKPOINTS / REFUSED).read_text()
    with pytest.raises(CheckpointError, match=r"TextIOWrapper.*__getstate__"):
        find_nearest(tmp_path, spec, 30)


def test_the_nearest_before_is_found(tmp_path):
    spec = spec_of("figure8", 2, duration=2.0)
    whole = log_hash(drive(spec, folder=tmp_path, checkpoints_s=0.5).log)
    assert whole == log_hash(drive(spec).log)
    found = [find_nearest(tmp_path, spec, tick) for tick in (10, 11, 20, 39)]
    assert [None if stored is None else stored.path.stem for stored in found] == [
        None, "0000010", "0000010", "0000030",
    ]  # fmt: skip


def test_what_cannot_be_cut_says_so():
    run, _ = begin(spec_of("figure8", 2, duration=2.0))
    for change, sentence in (
        ({"inputs": "0" * 64}, "a person took part"),
        ({"backend": BackendChoice(backend="carla")}, "needs the embedded simulator"),
    ):
        run.spec = msgspec.structs.replace(spec_of("figure8", 2, duration=2.0), **change)
        with pytest.raises(CheckpointError, match=sentence):
            StateFiles(run)
