"""The demo in small: real drives, real service, and the outcome that the vehicles' reports decide."""

from __future__ import annotations

import subprocess
import sys

import pytest
from sqlalchemy import func, select

from skidpad.cli.fleet.demo import (
    MAKER,
    PLAN,
    SEED,
    Demo,
    drive,
    enrol_fleet,
    play,
    rule_sets,
    serving,
)
from skidpad.core.errors import FileError
from skidpad.evidence.channels.choices import Profile
from skidpad.fleet import recorded
from skidpad.fleet.insight.worklist import rank_work
from skidpad.fleet.loop.plan import Plan
from skidpad.fleet.patterns.analysis import newest_clusters
from skidpad.fleet.recorded import unpack_recorded
from skidpad.fleet.service import Places, open_fleet
from skidpad.fleet.store.accounts import add_person
from skidpad.fleet.store.reading import Wanted, hazard_rows, record_of
from skidpad.fleet.store.tables import drives, hazards, vehicles
from skidpad.fleet.updates.payloads import PayloadKind, read_payload_content
from skidpad.fleet.words import Role


def test_the_rule_sets_of_the_demo_are_valid_and_differ():
    sets = rule_sets()
    assert len(set(sets.values())) == 3
    settings = {name: read_payload_content(PayloadKind.RULES, c) for name, c in sets.items()}
    assert {name: s.profile for name, s in settings.items()} == {
        "published": Profile.AS_PRINTED,
        "tracked": Profile.TRACKED,
        "looser": Profile.TRACKED,
    }
    assert {name: len(s.rules) for name, s in settings.items()} == {
        "published": 6, "tracked": 7, "looser": 7,
    }  # fmt: skip
    assert Plan(**{**PLAN, "stages": tuple(PLAN["stages"])}).alpha_of_look == 0.025


@pytest.mark.slow
@pytest.mark.req("C-176", "C-178", "C-190", "C-191", "C-192")
def test_the_demo_takes_back_the_bad_update_and_decides_by_what_was_driven(tmp_path):
    """Four vehicles, ten seconds each; every drive has a seed of its own."""
    maker, _, cars = enrol_fleet(tmp_path, 4)
    said: list[str] = []
    with serving(tmp_path / "data", 0) as address:
        demo = Demo(
            tmp_path, address, maker, cars, 10.0, lambda jobs: [drive(j) for j in jobs], said.append
        )
        good, bad = play(demo)
        told = [demo.call(c.token, "GET", "/api/v1/updates/assignment").json() for c in cars]
    means = [[e["detail"] for e in r["events"] if e["what"] == "looked"][-1] for r in (good, bad)]
    assert means[0]["mean"] < means[1]["mean"], said
    assert bad["ended"] == "reverted", said
    for release, last in zip((good, bad), means, strict=True):
        expected = {"advance": "completed", "revert": "reverted"}[last["decision"]]
        assert release["ended"] == expected
    stands = good["payload"] if good["ended"] == "completed" else ""
    assert bad["before"] == stands
    assert {t["payload"] for t in told} == {stands}
    assert demo.next_seed - SEED == sum(car.drives for car in cars)  # no seed twice


def test_a_recorded_fleet_opens_with_its_provenance_and_holds_what_it_says(tmp_path):
    about = unpack_recorded(tmp_path / "data")
    assert about.command.startswith("skidpad fleet demo")
    assert not list((tmp_path / "data").rglob("*.key"))
    fleet = open_fleet(Places(data=tmp_path / "data"))
    try:
        with fleet.engine.begin() as connection:
            maker = add_person(connection, MAKER, Role.MANUFACTURER, "visitor", 1.0).principal
            counts = [
                connection.execute(select(func.count()).select_from(t)).scalar_one()
                for t in (vehicles, drives, hazards)
            ]
            work = rank_work(connection, maker, newest_clusters(connection, maker))
            rows = hazard_rows(connection, maker, Wanted())
            assert record_of(connection, fleet.blobs, rows[0]["id"]).worlds
        assert counts == [about.vehicles, about.drives, about.hazards]
        assert work, "something recurs"
    finally:
        fleet.close()


def test_the_command_opens_it_and_says_where(tmp_path):
    command = [sys.executable, "-m", "skidpad", "fleet", "demo", "--recorded", "--no-stay"]
    done = subprocess.run(
        [*command, "--out", str(tmp_path / "fleet")], capture_output=True, text=True, check=True
    )
    first, maker, operator = done.stdout.splitlines()
    assert first.startswith("recorded 20")
    assert "dashboard of the manufacturer: http://127.0.0.1:" in maker
    assert "dashboard of the operator: http://127.0.0.1:" in operator
    again = subprocess.run(
        [*command, "--out", str(tmp_path / "fleet")], capture_output=True, text=True, check=False
    )
    assert again.returncode == 2, "a folder that holds something is not touched"
    for folder in ("fleet", "fleet-2"):  # without --out: a folder of its own each time
        subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
        assert (tmp_path / "out" / folder / "data").is_dir()


LOADED = """
import sys
from pathlib import Path
{}
heavy = ("numba", "polars", "alembic", "fastapi", "scipy.stats", "skidpad.fleet.loop.judging")
print(*(name for name in heavy if name in sys.modules))
"""


def loaded_by(statements):
    """What a fresh interpreter has loaded, of what takes longest to load."""
    code = LOADED.format(statements)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_what_opens_the_recorded_fleet_loads_nothing_that_its_server_loads_again(tmp_path):
    opening = f"""
from skidpad.cli.fleet.demo import open_recorded
with open_recorded(Path({str(tmp_path / "fleet")!r}), 0, print):
    pass
"""
    assert loaded_by(opening) == set()


def test_the_server_starts_without_what_only_an_evaluation_needs():
    assert not loaded_by("import skidpad.fleet.server") & {
        "scipy.stats", "skidpad.fleet.loop.judging"
    }  # fmt: skip


def test_a_damaged_recording_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(recorded, "ARCHIVE", tmp_path / "fleet.tar.gz")
    (tmp_path / "fleet.tar.gz").write_bytes(b"nothing")
    with pytest.raises(FileError, match="the recorded fleet cannot be unpacked"):
        unpack_recorded(tmp_path / "data")
