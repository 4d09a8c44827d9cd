"""Routes in other light and weather, and among risky drivers."""

from __future__ import annotations

import json
import re
from importlib.resources import files

import numpy as np
import pytest
from msgspec import structs

from skidpad.campaign import channels
from skidpad.campaign.channels import routes
from skidpad.campaign.channels.drive import RISKY_JUMPS, Crew, drive_segment
from skidpad.campaign.channels.routes import CONDITIONS, Condition, chosen_routes, driven_routes
from skidpad.campaign.channels.world import segment_of
from skidpad.campaign.recipes.channels import segments
from skidpad.core.channels import TruthFrame
from skidpad.core.errors import ConfigError
from skidpad.core.files.reading import decode_yaml
from skidpad.core.run import run_from_plain
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.vocabulary import Stratum
from skidpad.recording.channels.context import context_of
from skidpad.recording.channels.mcap_files import McapRecording
from skidpad.sensors.channels.presets import senses_of
from skidpad.simulation.world.stage import build_world
from skidpad.simulation.world.traffic.variety import risky_character
from support.runs import segment_run


@pytest.mark.req("C-210")
def test_every_route_by_day_night_rain_and_ice_and_in_both_strata():
    runs = chosen_routes("all", None, [*Condition], [*Stratum])
    assert len(runs) == 6 * 5 * 2
    assert len({r.name for r in runs}) == len(runs)
    assert {r.course.place for r in runs} == set(driven_routes())
    for run in runs:
        night, rain = run.weather.is_night, run.weather.precipitation > 0.0
        if run.weather.name in {c.value for c in CONDITIONS}:
            assert (night, rain) == (run.weather.name == "night", run.weather.name == "rain")
        assert run_from_plain(run.to_plain(), "it") == run
    plans = segments(runs, 8.0, segment_run(seed=5))
    assert sum(p.duration for p in plans) == pytest.approx(8.0 * 3600.0)
    seeds = [p.seed for p in plans]  # none twice: the same errors of sensors would be counted twice
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize(
    ("line", "wrong", "words"),
    [
        ("vehicles: 16", "vehicles: many", "Expected `int`, got `str` - at `$.vehicles`"),
        ("vehicles: 16", "vehicles: 81", "Expected `int` <= 80 - at `$.vehicles`"),
        ("parked: 20", "parks: 20", "unknown field `parks`"),
        ("  weather: {cloud", "  sky: {cloud", "Expected `object`, got `null`"),
    ],
)
def test_a_wrong_file_of_routes_is_one_sentence(monkeypatch, line: str, wrong: str, words: str):
    text = (files(channels) / routes.FILE).read_text().replace(line, wrong, 1)
    assert text.count(wrong)
    monkeypatch.setattr(routes, "decode_yaml", lambda *_: decode_yaml(text.encode(), "it"))
    with pytest.raises(ConfigError, match=rf"^routes\.yaml: route-1: .*{re.escape(words)}"):
        driven_routes.__wrapped__()


def test_the_route_as_published_is_what_it_was():
    """Its name, weather and words in a recording, so that earlier ones stay comparable."""
    (run,) = chosen_routes("route-4")
    assert run.course.name == run.course.place == "route-4"
    assert run == driven_routes()["route-4"]


def test_risky_drivers_are_those_of_the_embedded_simulator():
    """CARLA's traffic manager knows no such drivers, and their weights would say nothing."""
    (run,) = chosen_routes("route-4", strata=[Stratum.RISKY])
    with pytest.raises(ConfigError, match="risky drivers"):
        structs.replace(run, backend=BackendChoice(backend=BackendKind.CARLA))


@pytest.mark.req("R-5")
def test_background_drivers_mind_the_weather_unless_told_not_to():
    (minding,), (careless,) = (
        chosen_routes("route-4", drivers_mind_weather=minds) for minds in (True, False)
    )
    assert segment_of(minding).setup.traffic.slow_in_weather
    assert not segment_of(careless).setup.traffic.slow_in_weather


@pytest.mark.req("C-2")
def test_a_recording_of_risky_drivers_says_how_much_each_of_them_counts(tmp_path):
    (run,) = chosen_routes("route-4", None, [Condition.DAY], [Stratum.RISKY])
    run = structs.replace(run, seed=3, duration=1.0)
    drive_segment(run, tmp_path / "a.mcap")
    recording = McapRecording(tmp_path / "a.mcap")
    context = context_of(recording)
    assert (context["route"], context["stratum"]) == ("route-4", "risky")
    assert float(context["weight_of_jumps"]) == 1.0 / RISKY_JUMPS
    rates = [senses_of(c, RISKY_JUMPS).localisation.jump_rate for c in recording.channels]
    assert rates == [20.0, 20.0]  # per hour; 1 as it occurs
    crew = Crew(run, segment_of(run))
    senses = [senses_of(spec.id, spec.jumps) for spec in crew.sensors()]
    assert [s.localisation.jump_rate for s in senses] == rates
    weights = json.loads(context["weights"])
    world = build_world(segment_of(run).setup, run.seed)
    traits = world.traffic.drivers.trait
    for row, (of_headway, of_gap) in weights.items():
        character = risky_character(run.seed, int(row))
        assert (of_headway, of_gap) == (
            pytest.approx(character.of_headway, abs=1e-6),
            pytest.approx(character.of_gap, abs=1e-6),
        )
        assert (traits["headway"][int(row)] < 0.587) == (of_headway < 1.0)
    rows = {
        int(i)
        for m in recording.messages()
        if isinstance(m.item, TruthFrame)
        for i in m.item.ids[np.hypot(*m.item.actors[:, 3:].T) > 1.0]
    }
    assert rows <= {int(row) for row in weights}  # who drives in the true world has a weight
