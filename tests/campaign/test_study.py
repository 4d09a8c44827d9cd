"""Studies: every arm differs in one thing, and that thing acts."""

from dataclasses import asdict, replace
from math import nan

import numpy as np
import polars as pl
import pytest
from msgspec import structs
from typer.testing import CliRunner

from skidpad.campaign.runs.run import run
from skidpad.campaign.studies import arms as study_arms
from skidpad.campaign.studies import stacks as study_stacks
from skidpad.campaign.studies.study import BY_ID, drive_variant, stage_for
from skidpad.cli.main import app
from skidpad.core.frames import RadarPoints, Segments, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.states import EgoEstimate, StackReport, VehicleCommand
from skidpad.core.vocabulary import Clearance, Tier
from skidpad.evidence.verdicts import judge
from skidpad.recording.run.log_files import log_hash
from skidpad.roads.bundled import load_map
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.stack.control.tiers import Situation, decide

FIGURE8 = load_map("figure8")
STUDIES = study_arms.STUDIES


def short(id, seconds):
    """The arms of a study, cut to so many seconds."""
    return [replace(v, run=structs.replace(v.run, duration=seconds)) for v in STUDIES[id].arms(1)]


def changed(stack, **change):
    options = {"configuration": 2, "change": change}
    return getattr(study_stacks, stack)(twelve_sensors(), FIGURE8, options)


@pytest.mark.req("A-002", "A-099")
def test_pace_changes_no_byte():
    rows = [drive_variant(v) for v in short("F-25", 5.0)]
    assert rows[0]["log_hash"] == rows[1]["log_hash"]
    assert judge([BY_ID["F-25"]], [pl.DataFrame(rows)])[0].verdict.value != "contradicted"


def test_injected_dropout_blinds_about_its_share_of_time():
    assert changed("Blinking", dropout=0.2, seed=1).blind.mean() == pytest.approx(0.2, abs=0.03)
    blind, sighted = (
        run(
            structs.replace(study_arms.make_changed_run("Blinking", 3, 2, dropout=p), duration=30.0)
        )
        for p in (0.2, 0.0)
    )
    assert np.isfinite(blind.log.report.tier).all()
    assert log_hash(blind.log) != log_hash(sighted.log)


@pytest.mark.parametrize("id", STUDIES)
def test_arms_have_common_seeds_and_every_claim_a_finding(id):
    arms = {}
    for v in (v for seed in (4, 5, 6) for v in STUDIES[id].arms(seed)):
        arms.setdefault(tuple(v.labels.values()), set()).add(v.run.seed)
    assert len(set(map(frozenset, arms.values()))) == 1
    assert len(arms) >= 2
    assert all(BY_ID[claim].study for claim in STUDIES[id].claims)


def test_every_claim_with_runs_of_its_own_has_a_study():
    claims = [claim for study in STUDIES.values() for claim in study.claims]
    assert sorted(claims) == sorted(id for id, f in BY_ID.items() if f.study)


@pytest.mark.parametrize("id", [id for id in STUDIES if id != "F-25"])
def test_rows_have_every_column_that_the_claims_ask_for(id):
    """One second of each arm: contrasts can be drawn, whatever they say."""
    rows = [drive_variant(v) for v in short(id, 1.0)]
    table = pl.DataFrame(rows).with_columns(
        pl.col("radar_fpr_pct", "radar_fnr_pct", "dropout_pct", "jerk_rms").cast(pl.Float64)
    )
    table = table.fill_null(0.0)
    for claim in STUDIES[id].claims:
        assert BY_ID[claim].contrasts(table), claim


def test_the_plain_arm_is_our_own_stack():
    plain = structs.replace(study_arms.base_run(2), duration=10.0, seed=5)
    wrapped = structs.replace(study_arms.make_changed_run("Changed", 5, 2), duration=10.0)
    assert log_hash(run(plain).log) == log_hash(run(wrapped).log)


def test_without_the_coast_phase_a_lost_lead_is_not_coasted_after():
    for stack, coasts in (("Changed", True), ("Coastless", False)):
        found = changed(stack).stack
        m, rules = found.memory[0], found.rules.tiers
        free = Situation(10.0, 36.0, nan, nan, False, nan, 150.0, 1e9)
        decide(m, rules, free._replace(distance=25.0, gap=2.5, confirmed=True))
        assert m["tier"] == Tier.ACC_HOLD
        assert m["ticks_since_lead"] == 0
        assert (decide(m, rules, free).tier == Tier.COAST) is coasts


def test_the_handbrake_is_pulled_in_tiers_1_to_3_only(monkeypatch):
    for stack, pulled in (("Changed", False), ("Handbraked", True)):
        driver = changed(stack)
        for tier in Tier:
            monkeypatch.setattr(driver.stack, "tick", lambda _frame: VehicleCommand(brake=1.0))
            driver.stack.report = StackReport(tier=tier)
            held = driver.tick(None).handbrake
            assert held is (pulled and tier in (1, 2, 3)), tier


def seen(noise, ticks, depth=40.0):
    """Depths that a noisy stack hands on of one segment, None where it hands on nothing."""
    driver = changed("Noisy", noise=asdict(noise), seed=4)
    handed = []
    driver.stack.tick = lambda frame: handed.append(frame.segments["depth_roof"].depth)
    ego = EgoEstimate(Pose(0.0, 0.0), 10.0, 0.0, 0.0, 0.0, (10.0,) * 4, 1)
    one = np.ones(1, dtype=np.float32)
    segments = Segments(one, one, one, one, depth * one, np.ones(1, dtype=np.uint8))
    for k in range(ticks):
        driver.tick(SensorFrame(k, ego, {}, {"depth_roof": segments}, RadarPoints.none(), {}))
    return [float(d[0]) if len(d) else None for d in handed]


@pytest.mark.req("A-230")
def test_noise_has_the_size_it_was_given():
    assert seen(study_stacks.NOISE["exact"], 20) == [40.0] * 20
    night = seen(study_stacks.NOISE["night"], 40_000)
    known = np.array([d for d in night if d is not None])
    assert np.mean(np.abs(known / 40.0 - 1.0)) == pytest.approx(0.17, abs=0.02)
    assert 1.0 - len(known) / len(night) == pytest.approx(17.0 / 385.0, abs=0.01)
    lost = np.array([d is None for d in night])
    stretches = np.count_nonzero(lost[1:] & ~lost[:-1])
    assert np.count_nonzero(lost) / stretches >= 10.0, "a miss lasts half a second or longer"


@pytest.mark.req("A-230")
def test_in_rain_nothing_is_seen_beyond_two_fifths_of_the_range():
    rain = study_stacks.NOISE["rain"]
    assert all(d is not None for d in seen(rain, 100, depth=31.0))
    assert seen(rain, 100, depth=33.0) == [None] * 100
    assert len(seen(study_stacks.Noise(), 3, depth=140.0)) == 3
    assert None not in seen(study_stacks.Noise(), 3, depth=140.0)


def test_every_arm_of_recovery_lacks_another_safeguard():
    whole, clearance, warm_up, grace = (
        stage_for(v).supervisor.settings for v in STUDIES["F-30"].arms(1)
    )
    assert whole.clearance is Clearance.OTHERS
    assert replace(whole, clearance=Clearance.NONE) == clearance
    assert replace(whole, warm_up=0.05) == warm_up
    assert replace(whole, grace=0.0) == grace


def test_an_unknown_study_is_refused():
    done = CliRunner().invoke(app, ["study", "F-99"])
    assert "F-08" in str(done.exception)
