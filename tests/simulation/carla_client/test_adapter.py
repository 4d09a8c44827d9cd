"""The adapter on the real client, against our own server (issue 5, part 3)."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from msgspec.structs import replace

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.campaign.workers.pool import local
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.recording.campaign.matrix import MatrixEntry
from skidpad.simulation.carla_server.process import ServerProcess
from support.backend_contract import CHECKS
from support.carla_programs import HERE, environment
from support.runs import adas_run

pytest.importorskip("carla")
Serve = Callable[..., ServerProcess]
Program = Callable[..., Any]
HERE_INSTEAD = BackendChoice()
LIMIT = 600.0  # s


@pytest.fixture(scope="module")
def verdicts(serve: Serve) -> dict[str, str]:
    from support.carla_programs import run_program

    failed: dict[str, str] = run_program("contract_on_carla", serve("--mu-ref", "0.9").port)
    return failed


@pytest.mark.req("L-4", "A-001", "A-018", "A-029", "A-030")
@pytest.mark.parametrize("check", [c.__name__ for c in CHECKS])
def test_contract(check: str, verdicts: dict[str, str]) -> None:
    assert check not in verdicts, verdicts[check]


@pytest.mark.req("K-6")
@pytest.mark.parametrize("weather", ["clear-noon", "rain-noon"])
def test_same_commands_same_way(serve: Serve, program: Program, weather: str) -> None:
    """K-6 a: 60 s through a bend, without traffic; the tolerance is that of the wire's floats."""
    drive = program("replay", serve("--mu-ref", "0.9").port, weather)
    assert len(drive["apart"]) == 1200
    assert drive["way"] > 800.0
    assert drive["turned"] > 1.0
    assert max(drive["apart"]) < 1e-3


@pytest.mark.req("K-6", "A-018", "A-028", "A-033", "X-4")
def test_same_scene_same_images_and_radar(serve: Serve, program: Program) -> None:
    """K-6 b. Beyond the depth code's 1000 m the horizon's last row may round either way."""
    seen = program("same_scene", serve("--mu-ref", "0.9").port)
    images = seen["images"]
    for id in ("semantic_roof", "semantic_bumper"):
        assert images[f"{id} near"] == 0
        assert images[id] < 2e-4 * 800 * 600
        assert images[f"{id} classes"] >= 6
    for id in ("depth_roof", "depth_bumper"):
        assert images[f"{id} missing"] == 0
        assert images[id] < 1.0
    radar = seen["radar"]
    assert radar["points"] > 300
    assert radar["off"] == 0
    assert radar["velocity"] < 1e-4
    assert radar["fastest"] == pytest.approx(-20.0, abs=0.3)  # the road comes closer
    assert radar["lead"] > 0.1


@pytest.mark.req(
    "B-060", "B-061", "B-062", "B-063", "B-064", "B-065", "B-066", "B-067", "B-068", "K-2"
)
def test_friction_is_applied_once_to_every_wheel(serve: Serve, program: Program) -> None:
    """Without the blueprint, wheels are scaled; with it they are not; both stop alike."""
    model = ("--weather-grip", "statistical", "--mu-ref", "0.9")
    bare = program(
        "grip_on_wheels", serve("--weather-grip", "none", "--mu-ref", "0.9").port, model[1]
    )
    served = program("grip_on_wheels", serve(*model).port, model[1])
    untouched = bare["dry"]["once"]
    for name, ratio in (("rain", 0.3), ("ice", bare["ice"]["once"][0]["friction"][0] / 3.5)):
        run = bare[name]
        assert run["once"] == run["twice"]
        for wheels, before in zip(run["once"], untouched, strict=True):
            assert wheels["friction"] == pytest.approx([ratio * f for f in before["friction"]])
            assert wheels["others"] == before["others"]
            assert wheels["mass"] == before["mass"]
        assert all(isnan(v) for v in run["mu"][2])  # the pedestrian
        notes = [n for n in run["notices"] if n.startswith("grip: vehicle.")]
        assert len(notes) == 2
        weather = {"rain": "rain-noon", "ice": "icy"}[name]
        assert all(f"{ratio:.4f}" in n and weather in n and "3.5" in n for n in notes)
    assert not any("grip: vehicle" in n for n in bare["dry"]["notices"])
    for name in ("dry", "rain", "ice"):
        assert any("statistical, mu_ref 0.9" in n for n in served[name]["notices"])
        assert served[name]["once"] == untouched
        assert served[name]["stop"] == pytest.approx(bare[name]["stop"], rel=0.01)
    assert bare["ice"]["stop"] > bare["rain"]["stop"] > 2.0 * bare["dry"]["stop"]


# min_ttc_s and lateral_max_m are extremes of thousands of values, which a single tick decides: the
# latter is reached where the lane moves aside by 8 to 10 cm per tick, and the two differ by 2.5 cm.
# So does a contact with all that comes after it: of a drive with contacts only counts are compared.
CLOSED = {
    "empty 2": (
        "mean_speed_kmh", "max_speed_kmh", "p95_speed_kmh", "distance_km", "lateral_std_m",
        "radar_fpr_pct",
    ),
    "empty 4": (
        "mean_speed_kmh", "max_speed_kmh", "p95_speed_kmh", "distance_km", "lateral_std_m",
    ),
    "contacts": (),
    "lead": ("distance_m", "duration_s", "route_completion"),
}  # fmt: skip
SAME = {
    "empty 2": ("fatal_collisions", "lane_changes", "samples"),
    "empty 4": ("fatal_collisions", "lane_changes", "samples"),
    "contacts": ("fatal_collisions", "samples"),
    "lead": ("outcome", "triggered", "completion", "score"),
}


@pytest.mark.slow
@pytest.mark.req("K-6")
def test_closed_loop_gives_the_same_metrics(serve: Serve, program: Program) -> None:
    """An empty road with lights, and a lead that a scenario player moves: within 1 % (K-6 c)."""
    runs = program("closed_loop", serve("--mu-ref", "0.9").port)
    for name, (ours, theirs) in runs.items():
        for metric in CLOSED[name]:
            assert theirs[metric] == pytest.approx(ours[metric], rel=0.01), (name, metric)
        for metric in SAME[name]:
            assert theirs[metric] == ours[metric], (name, metric)


@pytest.mark.req("A-263", "A-265", "A-266", "A-267", "A-268")
def test_optimisations_change_no_reading(serve: Serve, program: Program) -> None:
    """Five degraded feeds at night in rain, lights and truth; without a cache the world is asked."""
    runs = program("switches", serve("--mu-ref", "0.9").port)
    assert len({run["content"] for run in runs.values()}) == 1
    assert runs["all"]["asked"] == 0
    assert runs["light-cache"]["asked"] == runs["local-truth"]["asked"] == 12
    assert runs["all"]["pool"]
    assert not runs["feed-pool"]["pool"]


def test_a_server_that_dies_ends_the_run_with_one_sentence() -> None:
    with ServerProcess(
        ["--idle-exit", "120", "--scenery", "none", "--bodywork", "plain"]
    ) as server:
        client = subprocess.Popen(
            [sys.executable, str(HERE / "interrupted.py"), str(server.port)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=environment(),
        )
        assert client.stdout is not None
        assert client.stdout.readline().strip() == "DRIVING"
        server.stop()
        said, _ = client.communicate(timeout=LIMIT)
    assert "RESULT" in said
    assert "failed while driving tick" in said
    assert "\\n" not in said


def adas(out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "skidpad", "adas", "--out", str(out), *options]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
        env=environment() | {"COLUMNS": "200", "HOME": os.environ.get("HOME", str(out))},
    )


def test_runs_without_a_server_are_recorded_and_the_campaign_goes_on(tmp_path: Path) -> None:
    """The server is gone when the runs begin: each is crashed with one sentence."""
    server = BackendChoice(backend=BackendKind.CARLA, port=9)
    template = adas_run(0, seed=1, duration=1.0, backend=server)
    entries: list[MatrixEntry] = []
    cells = [template, replace(template, seed=2), replace(template, seed=3, backend=HERE_INSTEAD)]
    summary = Campaign(RECIPE, cells).run(tmp_path / "out", local(1), on_run=entries.append)
    assert (summary.runs, summary.failed) == (3, 2)
    told = {e.key.seed: (e.key.outcome, e.error) for e in entries}
    for seed in (1, 2):
        outcome, error = told[seed]
        assert outcome == "crashed"
        assert error.startswith("no CARLA server answers at 127.0.0.1:9")
        assert "\n" not in error
    assert told[3][0] == "completed"


@pytest.mark.req("A-001", "A-003", "A-206", "A-207", "A-211")
def test_adas_completes_a_cell_on_carla(serve: Serve, tmp_path: Path) -> None:
    port = str(serve("--mu-ref", "0.9").port)
    done = adas(
        tmp_path / "out", "--backend", "carla", "--port", port, "--configs", "4",
        "--weather", "rain-noon", "--duration", "4",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    results = pl.read_parquet(tmp_path / "out" / "results.parquet")
    assert results["outcome"].to_list() == ["completed"]
    assert results["samples"].to_list() == [80]
    assert (tmp_path / "out" / "report.html").is_file()
    from skidpad.recording.run.log_files import read_log

    log = read_log(next((tmp_path / "out" / "runs").iterdir()))
    assert log.actors.x.shape == (80, 21)
    types = log.table.types
    assert types[0] == "vehicle.mini.cooper_s_2021"
    assert list(types[1:]) == sorted(types[1:])  # twenty of a sorted list, in turn
    assert not [t for t in types if t.endswith(("microlino", "carlacola", "t2", "sprinter"))]
    assert np.hypot(log.actors.vx[-1, 1:], log.actors.vy[-1, 1:]).max() > 3.0


def test_no_server_is_one_sentence_before_anything_is_driven(tmp_path: Path) -> None:
    done = adas(tmp_path / "out", "--backend", "carla", "--port", "9", "--configs", "0")
    assert done.returncode != 0
    assert "no CARLA server answers at 127.0.0.1:9" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
