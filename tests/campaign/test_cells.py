import pytest
from msgspec.structs import replace

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.matrix import cross, published_drivers, sweep
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.cli.campaigns.adas_plan import plan
from skidpad.cli.options.asked import Climate, Drivers, Tuned
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import TrafficStart
from skidpad.core.weather import Weather
from skidpad.simulation.recovery import Supervisor
from support.runs import adas_run

RAIN = Weather(name="rain-noon", title="Heavy Rain - Noon", precipitation=100, wetness=100)
CLEAR = Weather(name="clear-noon", title="Clear Sky - Noon")


def template():
    return adas_run(0, CLEAR)


@pytest.mark.req("A-006", "A-007", "A-008")
def test_the_matrix_is_every_driver_in_every_weather_with_common_seeds():
    cells = cross(published_drivers("all"), [CLEAR, RAIN], 3, template())
    assert len(cells) == 5 * 2 * 3
    assert len({c.name for c in cells}) == 30
    seeds = {(c.driver.label, c.weather.name): set() for c in cells}
    for c in cells:
        seeds[c.driver.label, c.weather.name].add(c.seed)
    assert set(map(tuple, seeds.values())) == {(1, 2, 3)}
    assert all(c.duration == 500.0 for c in cells)


@pytest.mark.req("A-210")
def test_traffic_stands_at_the_fixed_places_unless_asked():
    assert RunSpec().course.traffic is TrafficStart.FIXED
    runs = plan(template(), Drivers().find_drivers(), Climate().find_weathers())
    assert all(c.course.traffic is TrafficStart.FIXED for c in runs)


@pytest.mark.req("A-270")
def test_the_command_line_reaches_the_cells():
    run = Tuned(set=("mu_ref=0.7",)).resolve(RunSpec(duration=60.0), grip="none", range=None)
    run = replace(run, course=Roads(traffic=TrafficStart.RANDOM, vehicles=40))
    cells = plan(
        run, Drivers(configs="3").find_drivers(), Climate(weather="rain-night").find_weathers(), 2
    )
    assert [c.seed for c in cells] == [1, 2]
    (one, _) = cells
    assert (one.driver.label, one.weather.name) == ("3", "rain-night")
    assert (one.course.traffic, one.course.vehicles, one.duration) == (
        TrafficStart.RANDOM,
        40,
        60.0,
    )
    world = one.settings.world
    assert (world.grip.value, world.mu_ref) == ("none", 0.7)


@pytest.mark.req("A-201")
def test_recovery_and_wrong_way_watch_over_every_configuration():
    for run in plan(
        template(), Drivers().find_drivers(), Climate(weather="clear-noon").find_weathers()
    ):
        assert isinstance(stage_of(run).supervisor, Supervisor)


@pytest.mark.req("A-005")
def test_a_run_lasts_500_simulated_seconds():
    assert RunSpec().duration == 500.0


def test_a_sweep_varies_one_field_and_names_each_value():
    swept = sweep([CLEAR], "wetness=0:100:25")
    assert [w.wetness for w in swept] == [0, 25, 50, 75, 100]
    assert len({w.name for w in swept}) == 5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("colour=0:1:1", "weather field"),
        ("wetness=0:1", "three numbers"),
        ("wetness=5:1:1", "A <= B"),
        ("wetness=0:200:100", "between 0 and 100, got 200"),
    ],
)
def test_a_wrong_sweep_says_what_is_wrong(text, message):
    with pytest.raises(ConfigError, match=message):
        sweep([CLEAR], text)


def test_unknown_configurations_are_refused_with_the_choice():
    with pytest.raises(ConfigError, match="choose"):
        published_drivers("0,7")
    with pytest.raises(ConfigError, match="'x'"):
        published_drivers("x")


def test_a_weather_given_twice_is_refused():
    with pytest.raises(ConfigError, match="twice"):
        cross(published_drivers("1"), [CLEAR, CLEAR], 1, template())


def test_the_identity_changes_with_anything_that_decides_a_run():
    base = cross(published_drivers("1"), [CLEAR], 1, template())
    other = cross(published_drivers("1"), [CLEAR], 2, template())
    again = cross(published_drivers("1"), [CLEAR], 1, template())
    wetter = cross(published_drivers("1"), [RAIN], 1, template())
    same, *others = [Campaign(RECIPE, cells).identity() for cells in (again, other, wetter)]
    assert Campaign(RECIPE, base).identity() == same
    assert same not in others
