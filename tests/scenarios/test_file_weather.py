"""The file's environment is the run's: weather, time of day, and a friction that every tyre feels."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.campaign.driving.outdoors import sun_at, weather_of
from skidpad.campaign.runs.stored import read_run
from skidpad.cli.main import app
from skidpad.core.errors import FileError
from skidpad.core.weather import Weather
from skidpad.physics.grip import rain_rate
from skidpad.physics.optics import sight
from skidpad.recording.run.log_files import read_log
from skidpad.scenarios.reading.environment import Environment, Fall, Wetness
from support.scenarios.files import at, event, story, time, write


def environment(friction: float | None = None, rain: float = 0.0, clouds: str = "sixOktas") -> str:
    kind = "rain" if rain else "dry"
    road = "" if friction is None else f'<RoadCondition frictionScaleFactor="{friction}"/>'
    return f"""<GlobalAction><EnvironmentAction><Environment name="theirs">
<TimeOfDay animation="false" dateTime="2026-03-20T22:00:00"/>
<Weather fractionalCloudCover="{clouds}"><Sun azimuth="0" elevation="-0.2" illuminance="1"/>
<Fog visualRange="300"/><Precipitation precipitationType="{kind}" precipitationIntensity="{rain}"/>
</Weather>{road}</Environment></EnvironmentAction></GlobalAction>"""


def played(folder, *words, **parts):
    init = at("ego", -3, 100) + at("other", -1, 120) + parts.pop("begin", "")
    file = write(folder, init=init, end=2.0, **parts)
    out = folder / f"out{len(words)}"
    run = ["play", str(file), "--out", str(out), "--actors", "physical", *words]
    done = CliRunner().invoke(app, run)
    assert done.exit_code == 0, done.output
    return read_log(out), read_run(out)


@pytest.mark.osc("RoadCondition")
def test_weather_time_and_friction_of_the_file_are_those_of_the_run(tmp_path):
    (tmp_path / "dry").mkdir()
    log, run = played(tmp_path, begin=environment(0.5, rain=20.0))
    plain, dry = played(tmp_path / "dry", "--weather", "clear-noon", begin=environment(0.5))
    bare, _ = played(tmp_path / "dry", "--set", "mu_ref=0.45", "--weather", "clear-noon")
    assert run.weather.name == "file"
    assert rain_rate(run.weather) == pytest.approx(20.0)
    assert run.weather.cloudiness == 75.0
    assert run.weather.sun_altitude_deg == pytest.approx(np.degrees(-0.2))  # the sun, not the clock
    assert log.weathers == ("file",)
    assert dry.weather.name == "clear-noon"
    wheels = [i for i in range(2) if not np.isnan(plain.mu[5, i]).any()]
    assert wheels == [0, 1]
    assert plain.mu[5] == pytest.approx(bare.mu[5], abs=1e-3)  # 0.9 halved, by another way
    assert log.mu[5].max() < plain.mu[5].min()  # wet


@pytest.mark.osc("EnvironmentAction")
def test_environments_of_events_act_from_their_time_on(tmp_path):
    later = event("change", environment(0.3, rain=30.0), time(1.0))
    log, run = played(tmp_path, stories=story(later))
    assert run.weather.name == "clear-noon"  # the file says nothing at the begin
    before, after = log.mu[log.t <= 1.0], log.mu[log.t > 1.1]
    assert before[1:].min() > 0.7
    assert after.max() < 0.35 * before.max()
    assert [log.weathers[k] for k in np.unique(log.weather)] == ["clear-noon", "file-2"]
    changed = log.t[np.flatnonzero(np.diff(log.weather))[0] + 1]
    assert changed == pytest.approx(1.05)


def test_sight_in_fog_is_what_the_file_says():
    for visual in (50.0, 120.0, 1000.0, 9000.0):
        fog = weather_of(Environment(visual_range=visual), Weather(), "x")
        assert sight(fog) == pytest.approx(visual, rel=1e-6)


def test_the_sun_stands_where_spherical_trigonometry_has_it():
    assert sun_at("2026-03-20T12:00:00") == pytest.approx((45.0, 180.0))
    assert sun_at("2026-03-20T06:00:00.000+01:00") == pytest.approx((0.0, 90.0), abs=1e-9)
    assert sun_at("2026-03-20T18:00:00") == pytest.approx((0.0, 270.0), abs=1e-9)
    assert sun_at("2026-03-20T00:00:00")[0] == pytest.approx(-45.0)
    assert sun_at("2026-03-20T12:00Z") == pytest.approx((45.0, 180.0))
    for wrong in ("tomorrow", "2026-03-20T25:99:00", "2026-03-20"):
        with pytest.raises(FileError, match="dateTime"):
            sun_at(wrong)


def test_what_is_not_said_stays_and_what_is_too_much_is_held_in_range():
    base = Weather(name="base", wetness=30.0, cloudiness=80.0)
    assert weather_of(Environment(friction_scale=0.2), base, "x") is base
    flood = Environment(fall=Fall.RAIN, fall_mm_h=900.0, wetness=Wetness.HIGH_FLOODED)
    found = weather_of(flood, base, "x")
    assert (found.precipitation, found.wetness, found.cloudiness) == (100.0, 100.0, 80.0)


def windy(speed: float) -> str:
    """An environment with a wind that blows to the left of the road."""
    return f"""<GlobalAction><EnvironmentAction><Environment name="theirs">
<Weather><Wind direction="1.5708" speed="{speed}"/></Weather>
</Environment></EnvironmentAction></GlobalAction>"""


@pytest.mark.osc("EnvironmentAction")
def test_the_wind_of_the_file_pushes_where_the_run_lets_it(tmp_path):
    (tmp_path / "later").mkdir()
    on = ("--set", "wind=on")
    calm, _ = played(tmp_path, begin=windy(25.0))
    blown, _ = played(tmp_path, *on, begin=windy(25.0))
    changed = event("change", windy(25.0), time(1.0))
    later, _ = played(tmp_path / "later", *on, begin=windy(0.0), stories=story(changed))
    place = [float(log.ego.y[-1]) for log in (calm, blown, later)]
    assert len(set(place)) == 3
    assert np.array_equal(calm.ego.y[:15], later.ego.y[:15])


def test_a_bad_wind_is_refused_with_its_range(tmp_path):
    file = write(tmp_path, init=at("ego", -3, 100) + at("other", -1, 120) + windy(120.0))
    with pytest.raises(FileError, match=r"<Wind>: speed must be in \[0, 100\] m/s, got 120"):
        CliRunner().invoke(
            app, ["play", str(file), "--out", str(tmp_path / "out")], catch_exceptions=False
        )
