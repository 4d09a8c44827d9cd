"""Exports are followed to millimetres by players that merge near vertices, and by our own."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from skidpad.campaign.runs.run import run
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.run import Passenger
from skidpad.core.vocabulary import Outcome, SemanticClass
from skidpad.scenarios.export.hazard_export import export_hazard, road_under
from skidpad.scenarios.export.tracks import Track, tracks
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.export.writer import Sheet, write_element, write_scenario
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import compile_scenario
from support.hazard_record import a_record
from support.runs import scenario_run
from support.scenarios.merging_player import led, merged, place

T = np.round(np.arange(0.0, 12.01, 0.1), 3)
MOTIONS = {
    "from_rest": np.maximum(T - 3.05, 0.0) ** 2,
    "to_rest": 40.0 - np.maximum(5.0 - T, 0.0) ** 2,
    "short_stop": np.where(T < 4.0, 4.0 * T, np.where(T < 4.6, 16.0, 16.0 + 3.0 * (T - 4.6))),
    "creeping": 0.4 * T + 0.02 * np.sin(3.0 * T),
    "standing": np.full_like(T, 7.0),
    "fast": 25.0 * T,
    "stop_and_go": np.cumsum(np.maximum(np.sin(T), 0.0) * 0.3),
}


def a_track(name, s, h=0.6, seed=None):
    """A motion s along heading h; seed: with the noise of a sensor."""
    noise = 0.0 if seed is None else np.random.default_rng(seed).normal(0.0, 0.04, (2, len(T)))
    x, y = np.array([np.cos(h) * s, np.sin(h) * s]) + noise
    v = np.gradient(s, T)
    track = Track(name, "", name == "fast", SemanticClass.CAR, (4.0, 1.8, 1.3, 0.0))
    for k, t in enumerate(T.tolist()):
        track.add(t, [x[k], y[k], h, v[k] * np.cos(h), v[k] * np.sin(h)])
    return track


def written(folder, entities, version=OscVersion.V1_2, sparse=False):
    road, parking = road_under(entities, "road")
    write_element(folder / "road.xodr", road)
    t_end = max(e.t[-1] for e in entities)
    sheet = Sheet(
        title="x", date=datetime(2026, 1, 1), road_file="road.xodr", t_end=t_end,  # noqa: DTZ001
        parking=parking, version=version, sparse=sparse,
    )  # fmt: skip
    write_scenario(folder / "x.xosc", entities, sheet)
    return folder / "x.xosc"


def farthest(file, entities):
    """m between a track and where a merging player has it, at vertices and between them."""
    worst, follows = 0.0, led(file)
    for track in entities:
        for a, b in track.stretches():
            t = np.array(track.t[a:b])
            for when in np.concatenate([t, 0.5 * (t[1:] + t[:-1])]).tolist():
                x, y = (np.interp(when, t, v[a:b]) for v in (track.x, track.y))
                at = place(follows[track.name], when)
                worst = max(worst, np.hypot(at[0] - x, at[1] - y))
    return worst


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("version", list(OscVersion))
def test_a_player_that_merges_near_vertices_follows_within_5_mm(tmp_path, version, sparse):
    entities = [a_track("fast", MOTIONS["fast"])]
    entities += [a_track(name, s) for name, s in MOTIONS.items() if name != "fast"]
    entities += [a_track(f"{name}_noisy", s, seed=k) for k, (name, s) in enumerate(MOTIONS.items())]
    file = written(tmp_path, entities, version, sparse)
    assert farthest(file, entities) < 0.005


@pytest.mark.parametrize("version", list(OscVersion))
def test_exported_hazards_too_with_objects_that_come_late_and_go_early(tmp_path, version):
    record = a_record(late=True)
    file, _ = export_hazard(record, tmp_path, version, "lav")
    assert farthest(file, tracks(record, ("lav",))) < 0.005


def test_the_oracle_merges_what_lies_within_a_decimetre():
    slow = [(0.1 * k, 0.05 * k, 0.0, 0.0) for k in range(7)]
    assert [r[0] for r in merged(slow)] == pytest.approx([0.0, 0.3, 0.6])
    stand = [(0.0, 0.0, 0.0, 0.0), (1.0, 0.01, 0.0, 0.0), (1.1, 0.5, 0.0, 0.0), (1.2, 1.0, 0, 0)]
    assert merged(stand)[1] == (1.0, 0.0, 0.0, 0.0)


def test_our_own_replay_is_within_1_cm_although_the_worlds_overlap(tmp_path):
    record = a_record(late=True)
    file, _ = export_hazard(record, tmp_path)
    scenario = compile_scenario(file)
    ghosts = {name for name, entity in scenario.entities.items() if entity.is_ghost}
    assert ghosts == {name for name in scenario.entities if "tfuse" in name}
    told = play_ideal(scenario, 60.0)
    for track in tracks(record, record.channels):
        rows = told.of(track.name)
        times = [row.time for row in rows]
        known = slice(1 if track.t[0] > 0.0 else 0, None)  # who comes is seen a tick later
        for t, x, y in list(zip(track.t, track.x, track.y, strict=True))[known]:
            row = rows[int(np.searchsorted(times, t - 1e-6))]
            assert row.time == pytest.approx(t, abs=1e-6)
            assert np.hypot(row.x - x, row.y - y) < 0.01, (track.name, t)


def test_what_other_channels_saw_is_seen_in_a_run_and_touches_nothing(tmp_path):
    file, _ = export_hazard(a_record(2), tmp_path)
    driven = run(scenario_run(file, driver=Passenger(), course=Scenario(actors=ActorMode.IDEAL)))
    assert not driven.log.contacts
    assert driven.outcome is Outcome.COMPLETED
    assert driven.log.t[-1] == pytest.approx(11.0, abs=0.11)
    a, names = driven.log.actors, driven.log.table.names
    egos = [names.index(f"Ego_{channel}") for channel in ("lav", "tfuse")]
    apart = np.hypot(*(v[1:, egos[0]] - v[1:, egos[1]] for v in (a.x, a.y)))
    assert apart.max() < 1.0  # two bodies at one place
