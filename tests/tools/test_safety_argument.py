"""The safety argument: a failing result turns its claim red, and what was not driven supports nothing."""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import safety_argument as safety  # noqa: E402
from safety_argument import Status  # noqa: E402

ARGUMENT = yaml.safe_load(safety.ARGUMENT.read_text(encoding="utf-8"))


def write_estimates(results: Path, too_high: float) -> None:
    path = results / safety.ESTIMATES
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = {"surface": ["snow", "patches of ice"], "too_high": [too_high, 0.0]}
    pl.DataFrame(rows).write_csv(path)


def write_drives(results: Path, bare: int, governed: int, speed: float = 40.0) -> None:
    """So many contacts in each run of 12 on each map, of the bare stack, and of the envelope."""
    for name in safety.proof.MAPS:
        for folder, config, n, v in (
            (name, "3", bare, 60.0), (name, "5", governed, speed), (f"{name}-table", "3", bare, 40.0),
            (f"{name}-oracle", "3", 0, 40.0),
        ):  # fmt: skip
            path = results / folder / "results.parquet"
            path.parent.mkdir(parents=True, exist_ok=True)
            rows = [
                {"config": config, "weather": "snow", "seed": s, "distance_km": 5.0, "rear_ended": 0,
                 "mean_speed_kmh": v, "serious_contacts": n, "road_departures": 0,
                 "motion_hash": f"{s} {n}"}
                for s in range(12)
            ]  # fmt: skip
            table = pl.DataFrame(rows)
            if path.is_file():
                table = pl.concat([pl.read_parquet(path), table])
            table.write_parquet(path)


def find_node(id: str, node: dict | None = None) -> dict | None:
    node = ARGUMENT if node is None else node
    if node["id"] == id:
        return node
    found = (find_node(id, child) for child in node.get("children", ()))
    return next((n for n in found if n is not None), None)


@pytest.mark.parametrize(("too_high", "status"), [(0.01, Status.SUPPORTED), (0.4, Status.REFUTED)])
def test_a_failing_estimate_turns_its_claim_and_all_above_it_red(tmp_path, too_high, status):
    write_estimates(tmp_path, too_high)
    assert safety.status_of(find_node("Sn3"), tmp_path) is status
    if status is Status.REFUTED:
        assert safety.status_of(ARGUMENT, tmp_path) is Status.REFUTED
        assert "The top claim is refuted" in safety.write_page(tmp_path)


@pytest.mark.parametrize(
    ("bare", "governed", "speed", "refuted"),
    [(10, 0, 39.0, ""), (10, 8, 39.0, "Sn9"), (10, 12, 39.0, "Sn10"), (10, 0, 20.0, "Sn11")],
)
def test_drives_that_miss_a_goal_refute_its_claim(tmp_path, bare, governed, speed, refuted):
    write_drives(tmp_path, bare, governed, speed)
    found = {id: safety.status_of(find_node(id), tmp_path) for id in ("Sn9", "Sn10", "Sn11")}
    if refuted:
        assert found[refuted] is Status.REFUTED
    else:
        assert set(found.values()) == {Status.SUPPORTED}


def test_what_was_not_driven_and_what_has_no_evidence_is_undeveloped(tmp_path):
    for id in ("G4", "Sn9", "Sn10", "Sn11", "Sn3"):
        assert safety.status_of(find_node(id), tmp_path) is Status.UNDEVELOPED
    assert (
        safety.status_of({"test": "tests/envelope/test_envelope_grip.py::test_none"})
        is Status.REFUTED
    )


def test_every_test_that_is_named_as_evidence_stands():
    assert safety.status_of(find_node("G2")) is Status.SUPPORTED
    assert safety.status_of(find_node("G5")) is Status.SUPPORTED


def test_the_page_is_what_the_results_make():
    assert safety.PAGE.read_text(encoding="utf-8") == safety.write_page(), (
        "run python tools/safety_argument.py"
    )


def test_no_word_of_the_argument_is_lost():
    """A comma in a claim would make keys of its own."""
    known = {"id", "claim", "strategy", "children", "test", "check", "counter", "triggers"}

    def look(node):
        assert set(node) <= known
        for child in node.get("children", ()):
            look(child)

    look(ARGUMENT)
