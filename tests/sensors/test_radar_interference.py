"""Radars of others: the rise of noise beside a published table, and what a radar loses by it."""

import csv
from dataclasses import replace
from math import log10, pi
from pathlib import Path

import numpy as np
import pytest

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.setup import ActorSetup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control
from skidpad.physics.interference import AFFECTED, interference_over_noise
from skidpad.roads.bundled import load_map
from skidpad.roads.roadside import Barrier, BarrierKind, Roadside
from skidpad.sensors.physical_radar.radar import PhysicalRadar
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.sensors.cars import RADAR, world

TABLE = Path(__file__).parents[2] / "docs" / "radar-interference.csv"
ROWS = list(csv.DictReader(TABLE.open(encoding="utf-8")))


@pytest.mark.parametrize("row", ROWS, ids=lambda r: "-".join(r.values())[:9])
def test_rise_of_noise_is_that_of_the_published_table(row):
    """TI SWRA662A, table 2-1; the first row gave the bandwidth, eleven are checks."""
    share = float(row["samples_affected_pct"]) / 100.0
    found = interference_over_noise(float(row["distance_m"]), share, float(row["ghz"]))
    assert 10.0 * log10(found) == pytest.approx(float(row["increase_published_db"]), abs=1.0)


def rows_of(*others, interference=1.0, roadside=None, ticks=20):
    """Detections of all ticks, with their power over the noise."""
    table, states = world(*others)
    radar = PhysicalRadar(RADAR, roadside or Roadside(), table, 1, interference=interference)
    counts = [(len(radar.read(k, states).points[0]), radar._out.copy()) for k in range(ticks)]
    return [out[:n] for n, out in counts]


def power(*others, **options):
    """Mean power over noise of what is found at the rear of a car 42 m ahead."""
    near = [r[np.abs(r[:, 0] - 38.0) < 3.0, 4] for r in rows_of(*others, **options)]
    return float(np.mean([p.max() if len(p) else 0.0 for p in near]))


AHEAD = (42.0, 0.0, 0.0, 0.0)  # a car that drives ahead
ONCOMING = (32.0, 3.5, 0.0, np.pi)  # one that faces us, beside our lane


def test_a_radar_that_faces_ours_takes_its_share_and_one_that_drives_ahead_none():
    clean = power(AHEAD, ONCOMING, interference=0.0)
    assert 0.0 < power(AHEAD, ONCOMING) < 0.95 * clean
    assert power(AHEAD) == power(AHEAD, interference=0.0) > 0.0
    assert power(AHEAD, ONCOMING, interference=1e-9) == clean


def test_loss_by_hand_on_the_axis():
    """A car that faces ours: all is less by 1 + I / N at the way between the antennas."""
    facing = (17.0, 0.0, 0.0, np.pi)
    loud, quiet = rows_of(facing), rows_of(facing, interference=0.0)
    ratio = [a[:, 4].max() / b[:, 4].max() for a, b in zip(loud, quiet, strict=True) if len(a)]
    way = 17.0 - 2.25 - 2.0
    by_hand = 1.0 / (1.0 + interference_over_noise(way, AFFECTED, 77.0))
    assert by_hand < 0.5
    assert np.median(ratio) == pytest.approx(by_hand, rel=0.15)


def test_a_rail_between_them_keeps_them_apart():
    rail = Barrier(BarrierKind.GUARDRAIL, np.array([[0.0, 1.7, 0.0], [60.0, 1.7, 0.0]]), 1.5)
    beside = Roadside((rail,))
    free = power(AHEAD, ONCOMING, roadside=beside, interference=0.0)
    assert power(AHEAD, ONCOMING, roadside=beside) == free > 0.0


def found_in_a_run(share, turned):
    """Ranges tick by tick of an ego that stands behind a car, which faces it or shows its rear."""
    map = load_map("figure8")
    place = map.ahead(map.place(map.ego_start), 15.0).pose
    other = ActorSetup(
        name="other", type="hatchback", place=replace(place, yaw=place.yaw + turned),
        driver=Control.SCRIPTED,
    )  # fmt: skip
    settings = {"radar_model": "physical", "radar_interference": share}
    spec = RunSpec(course=Roads(vehicles=0), settings=load_profile("recommended", settings))
    setup = replace(stage_of(spec).setup, traffic=None, actors=(other,))
    backend, found = EmbeddedBackend(), []
    backend.reset(setup, 3)
    for _ in range(10):
        found.append(backend.step(VehicleCommand(brake=1.0)).radar.range.tolist())
    backend.close()
    return found


def test_in_a_run_a_car_that_faces_ours_disturbs_it_and_one_ahead_does_not():
    assert found_in_a_run(1.0, pi) != found_in_a_run(0.0, pi)
    alone = found_in_a_run(0.0, 0.0)
    assert any(alone)
    assert found_in_a_run(1.0, 0.0) == alone
