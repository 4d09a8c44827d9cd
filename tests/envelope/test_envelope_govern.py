"""What the envelope does to a stack: less acceleration, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.campaign.driving.governing import choose_envelope
from skidpad.campaign.runs.drive import drive
from skidpad.campaign.runs.run import run as drive_run
from skidpad.core.courses import Roads, Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.frames import EgoEstimate, RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.run import Passenger, RunSpec
from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.specs import RadarSpec
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Govern, GripModel, Outcome, RangeModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.envelope.envelope import AIR_ID, RAIN_ID, SENSORS, Envelope, EnvelopeSettings
from skidpad.envelope.govern import GovernedStack, govern, with_pedals
from skidpad.envelope.govern_kernel import (
    PULSE_BRAKE,
    PULSE_TIME,
    V_CREEP,
    find_limits,
    grip_at,
    hold_back,
    keep_inside,
    pulse_brake,
)
from skidpad.envelope.limits import Binding
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.sensors.outside import make_rain_sensor, make_thermometer, wiper_stage
from skidpad.stack.configurations import numbered_driver

UNIT = st.floats(0.0, 1.0)
SPEEDS = st.floats(0.0, 60.0)


class Straight:
    """Full throttle straight on, whatever happens."""

    def __init__(self, specs, map, settings):
        self.told = []

    def limit_speed(self, v):
        self.told.append(v)

    def tick(self, frame):
        return VehicleCommand(throttle=1.0)


class Raises(Straight):
    """Fails in its tenth tick."""

    def tick(self, frame):
        if frame.tick >= 10:
            raise ValueError("lost")
        return super().tick(frame)


@given(UNIT, UNIT, st.floats(-1.0, 1.0), SPEEDS, SPEEDS)
def test_the_envelope_only_lowers_acceleration(throttle, brake, steer, v, allowed):
    command = VehicleCommand(throttle, brake, steer, handbrake=True)
    after = lower(command, v, allowed, 2.0, 11.0)
    assert after.throttle <= throttle
    assert after.brake >= brake
    assert (after.steer, after.handbrake, after.reverse) == (steer, True, False)


@given(UNIT, SPEEDS)
def test_below_creep_speed_and_well_below_the_limit_the_stack_is_left_alone(throttle, v):
    command = VehicleCommand(throttle)
    assert lower(command, V_CREEP, 0.0, 2.0, 11.0) == command
    assert lower(command, v, v + 1.5, 2.0, 11.0) == command


def test_a_falling_limit_is_approached_with_the_stated_deceleration_at_most():
    braked = lower(VehicleCommand(1.0), 30.0, 5.0, 2.0, 11.0)
    assert braked.throttle == 0.0
    assert braked.brake * 11.0 == pytest.approx(2.0)


def lower(command, v, allowed, approach, a_brake):
    """The command as a governed stack gives it on."""
    pedals = hold_back(
        command.throttle, command.brake, command.reverse, v, allowed, approach, a_brake
    )
    return with_pedals(command, *pedals)


class Whole(Straight):
    """Commands in whole numbers, as a stack may give them."""

    def tick(self, frame):
        return VehicleCommand(throttle=1, brake=0, steer=0)


class Nothing(Straight):
    """Gives no number."""

    def tick(self, frame):
        return VehicleCommand(throttle=None)


def test_a_command_of_other_types_needs_no_kernels_of_its_own_and_none_is_refused_in_a_sentence():
    governed_run(Straight, 2.0)
    before = len(find_limits.overloads), len(keep_inside.overloads)
    assert governed_run(Whole, 2.0, share=1).outcome is Outcome.COMPLETED
    assert (len(find_limits.overloads), len(keep_inside.overloads)) == before
    refused = governed_run(Nothing, 2.0)
    assert refused.outcome is Outcome.AGENT_ERROR
    assert "throttle" in refused.error


def test_limits_that_do_not_count_are_those_of_the_envelope_alone():
    """A rival is its own limit."""
    run = governed_run(Straight, 25.0, table_kmh=(50.0, 40.0, 30.0), limits=frozenset())
    assert np.asarray(run.log.ego.speed).max() * 3.6 < 51.0


def governed_run(kind, duration, weather="clear-noon", vehicles=0, **settings):
    spec = RunSpec(
        course=Roads(map="straight", vehicles=vehicles), duration=duration,
        weather=preset(weather), sensors=SensorLevel.OBJECTS,
    )  # fmt: skip
    return drive_run(spec, govern(kind, EnvelopeSettings(**settings)))


def test_full_throttle_stays_below_the_limit_and_its_name_is_recorded():
    run = governed_run(Straight, 25.0, table_kmh=(50.0, 40.0, 30.0))
    v = np.asarray(run.log.ego.speed) * 3.6
    assert run.outcome is Outcome.COMPLETED
    assert 48.0 < v.max() < 51.0
    assert set(run.readings.table["envelope.binding"].to_list()) == {Binding.TABLE}


@pytest.mark.parametrize(
    ("weather", "kmh"), [("clear-noon", 50.0), ("rain-noon", 40.0), ("snow", 30.0)]
)
def test_a_table_has_a_speed_for_dry_rain_and_cold(weather, kmh):
    run = governed_run(Straight, 25.0, weather, table_kmh=(50.0, 40.0, 30.0))
    allowed = run.readings.table["envelope.speed_mps"].to_numpy() * 3.6
    assert allowed == pytest.approx(np.full(len(allowed), kmh))


def test_a_stack_of_ours_that_was_held_back_does_not_shoot_forward_when_released():
    """Its integral does not wind up: on release it accelerates no harder than from the same speed."""
    from skidpad.stack.adas import AdasStack

    stack = AdasStack
    limits = []

    class Held(stack):
        def __init__(self, specs, map, settings):
            super().__init__(specs, map, {"functions": [], "cruise_kmh": 60.0})

        def tick(self, frame):
            limits.append(self.v_told)
            return super().tick(frame)

    held = governed_run(Held, 40.0, table_kmh=(40.0, 40.0, 40.0))
    v = np.asarray(held.log.ego.speed) * 3.6
    throttle = np.asarray(held.log.requested.throttle)
    assert v.max() < 41.5
    assert throttle[-100:].max() < 0.5  # held by its own cruise, not against full throttle
    assert min(limits) == pytest.approx(40.0 / 3.6)


def test_a_stack_starts_from_rest_behind_a_limit_that_is_zero():
    command = lower(VehicleCommand(0.6), 0.0, 0.0, 2.0, 11.0)
    assert command.throttle == 0.6


def test_a_stack_that_raises_is_the_outcome_of_its_run():
    run = governed_run(Raises, 2.0)
    assert run.outcome is Outcome.AGENT_ERROR
    assert "lost" in run.error


def test_a_governed_stack_looks_like_the_stack():
    stack = govern(Straight)((), load_map("straight"), {})
    assert isinstance(stack, GovernedStack)
    assert type(stack).__name__ == "Straight"
    assert stack.told == []
    assert stack.sensors() == SENSORS


def test_configuration_5_is_slower_on_ice_than_4_and_runs_without_an_envelope_have_no_column():
    runs = {
        n: drive(n, weather="icy_100", sensors="objects", duration=25.0, seed=900_001)
        for n in (3, 5, 6)
    }
    assert runs[3].readings is None
    v = {n: float(np.max(run.log.ego.speed)) for n, run in runs.items()}
    assert max(v[5], v[6]) < v[3]


def test_only_a_stack_can_be_governed():
    with pytest.raises(
        ConfigError, match="--govern envelope keeps a stack's speed, and ideal is no"
    ):
        RunSpec(driver=Passenger(), course=Scenario(file="x"), govern=Govern.ENVELOPE)


def test_the_oracle_knows_the_tyres_of_the_run():
    ice = Weather(name="ice", ice_thickness=100.0, road_temperature_c=-5.0)

    def grip(tyres):
        setup = Setup(
            map="figure8", specs=(), ego=ActorSetup(name="ego", type="tesla", place=Pose(0.0, 0.0)),
            weather=ice, grip=GripModel.PHYSICAL, tyres=tyres,
        )  # fmt: skip
        return choose_envelope(RunSpec(govern=Govern.ORACLE), setup).oracle

    summer, winter, studded = (
        grip_at(np.array(grip(tyres)), 10.0) for tyres in ("summer", "winter", "studded")
    )
    assert summer < winter < studded


def test_the_oracle_of_sight_knows_how_far_the_radar_reaches_in_rain():
    def reach(weather, range_model=RangeModel.PHYSICAL):
        setup = Setup(
            map="figure8", specs=(), ego=ActorSetup(name="ego", type="tesla", place=Pose(0.0, 0.0)),
            weather=weather, range_model=range_model,
        )  # fmt: skip
        settings = choose_envelope(RunSpec(govern=Govern.ORACLE_SIGHT), setup)
        radar = RadarSpec("radar", Pose(2.0, 0.0, 1.0), range=100.0)
        return Envelope([radar], load_map("straight"), settings).arrays.sight.memory["reach"][0]

    rain = Weather(precipitation=100.0)
    assert reach(Weather()) == pytest.approx(100.0)
    assert reach(rain) < 99.0
    assert reach(rain, RangeModel.NONE) == pytest.approx(100.0)
    with pytest.raises(ConfigError, match="oracle-sight needs a stack with a radar"):
        Envelope([], load_map("straight"), EnvelopeSettings(oracle_sight=lambda nominal: nominal))


@pytest.mark.parametrize("rss", [False, True])
def test_off_every_lane_a_lead_of_before_is_no_limit(rss):
    envelope = Envelope([], load_map("straight"), EnvelopeSettings(rss=rss))
    envelope.arrays.sight.memory["gap"] = 3.0
    ego = EgoEstimate(Pose(0.0, 5000.0), 20.0, 0.0, 0.0, 0.0, (20.0,) * 4, 4)
    told = envelope.update(
        SensorFrame(1, ego, {}, {}, RadarPoints.none(), {}, extra={RAIN_ID: 0, AIR_ID: 20.0}),
        VehicleCommand(),
    )
    assert told.places == 0
    assert np.isinf(envelope.arrays.limits[Binding.LEAD])


def test_settings_out_of_range_are_told():
    with pytest.raises(ConfigError, match="share"):
        EnvelopeSettings(share=2.0)


class Host:
    """A run's weather, for the two sensors of the air."""

    def __init__(self, weather, seed):
        ego = ActorSetup(name="ego", type="mini_cooper_s", place=None)
        self.setup = Setup(map="straight", weather=weather, specs=(), ego=ego)
        self.seed = seed


def test_the_rain_sensor_has_four_stages():
    assert [wiper_stage(r) for r in (0.0, 0.5, 5.0, 20.0)] == [0, 1, 2, 3]
    heavy = Host(Weather(precipitation=100.0), 1)
    assert make_rain_sensor(SENSORS[0], heavy)() == 3


def test_the_thermometer_knows_the_air_within_2_k_and_never_the_road():
    cold_road = Weather(air_temperature_c=6.0, road_temperature_c=-10.0)
    warm_road = replace(cold_road, road_temperature_c=30.0)
    read = [make_thermometer(SENSORS[1], Host(cold_road, seed))() for seed in range(40)]
    assert read == [make_thermometer(SENSORS[1], Host(warm_road, seed))() for seed in range(40)]
    assert 3.75 <= min(read) < 5.0 < 7.0 < max(read) <= 8.25


def numbered_run(kind, weather, duration):
    spec = RunSpec(
        driver=numbered_driver(3), course=Roads(), weather=preset(weather), duration=duration,
        seed=900_001, sensors=SensorLevel.OBJECTS, govern=kind,
    )  # fmt: skip
    return drive_run(spec)


def settings_of(kind):
    host = Host(Weather(), 1)
    return choose_envelope(RunSpec(govern=kind), host.setup)


@pytest.mark.parametrize("kind", [k for k in Govern if k is not Govern.NONE])
def test_each_word_of_govern_has_settings_of_its_own(kind):
    others = [settings_of(k) for k in Govern if k not in (kind, Govern.NONE)]
    assert settings_of(kind) is not None
    assert settings_of(kind) not in others


@pytest.mark.parametrize(
    ("kind", "binding"),
    [
        (Govern.ONLY_SIGHT, Binding.SIGHT),
        (Govern.ONLY_LEAD, Binding.LEAD),
        (Govern.ONLY_BEND, Binding.BEND),
    ],
)
def test_an_ablation_knows_one_limit_alone(kind, binding):
    run = numbered_run(kind, "snow", 8.0)
    found = set(run.readings.table["envelope.binding"].to_list())
    assert found <= {float(binding), float(Binding.NONE)}


def test_watching_changes_no_drive_and_records_what_would_be_allowed():
    watched, bare = (numbered_run(kind, "icy_100", 10.0) for kind in (Govern.WATCH, Govern.NONE))
    assert np.array_equal(np.asarray(watched.log.ego.x), np.asarray(bare.log.ego.x))
    assert watched.readings.table["envelope.speed_mps"].min() < 20.0


def test_brake_pulses_are_short_gentle_and_far_apart_and_end_where_something_is_known():
    pulse, dt = np.zeros(2), 0.05
    asked = [pulse_brake(pulse, 20.0, 0.0, 0.0, False, dt) for _ in range(1000)]  # 1 km
    pulsed = np.flatnonzero(asked)
    assert max(asked) == PULSE_BRAKE <= 2.0
    assert len(pulsed) * dt == pytest.approx(3 * PULSE_TIME, rel=0.1)
    assert not any(pulse_brake(pulse, 20.0, 0.0, 0.9, False, dt) for _ in range(1000))
    assert not any(pulse_brake(pulse, 20.0, 0.0, 0.0, True, dt) for _ in range(1000))
