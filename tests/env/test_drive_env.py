"""The environments keep Gymnasium's rules, and drive what `skidpad.drive` drives."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs Gymnasium (extra rl)")

import skidpad  # noqa: E402
from skidpad.campaign.runs.rerun import first_ticks  # noqa: E402
from skidpad.core.errors import ConfigError  # noqa: E402
from skidpad.env import OBSERVED, WEIGHTS  # noqa: E402
from skidpad.env.drive_env import DriveEnv  # noqa: E402
from skidpad.env.episodes import Episodes  # noqa: E402
from skidpad.env.wheel import WHERE  # noqa: E402
from skidpad.evidence.drive.metrics import run_metrics  # noqa: E402
from skidpad.recording.run.log_files import log_hash  # noqa: E402

AT = {quantity.name: i for i, quantity in enumerate(OBSERVED)}


def make(id="skidpad/Follow-v0", **options):
    return gymnasium.make(id, **{"weather": "icy_30", "duration": 10.0, **options})


def drive_episode(env, actions, **reset):
    """Drives the actions until the episode ends; returns what each step gave."""
    env.reset(**reset)
    steps = []
    for action in actions:
        steps.append(env.step(np.array(action, dtype=np.float32)))
        if steps[-1][2] or steps[-1][3]:
            break
    return steps


@pytest.mark.parametrize("id", ["skidpad/Follow-v0", "skidpad/Drive-v0"])
def test_gymnasium_finds_no_fault(id):
    from gymnasium.utils.env_checker import check_env

    check_env(make(id, seeds=(1, 2)).unwrapped, skip_render_check=True)


def test_an_episode_has_the_hash_of_the_drive_with_its_actions():
    rng = np.random.default_rng(0)
    actions = rng.uniform(-0.2, 0.9, (200, 1)).astype(np.float32)
    env = make()
    drive_episode(env, actions, seed=5)
    log = env.unwrapped.finish().log
    again = skidpad.drive(
        WHERE, weather="icy_30", seed=5, duration=10.0, sensors="objects", stack_settings={
            "actions": actions.astype(np.float64).tolist()
        },
    )  # fmt: skip
    assert len(log) == 200
    assert log_hash(log) == log_hash(again.log)


def test_a_reset_to_a_kept_world_is_a_reset_to_a_new_one():
    actions = [(0.5,)] * 60 + [(-0.3,)] * 40
    kept, fresh = make(seeds=(3, 4)), make()
    drive_episode(kept, [(1.0,)] * 50, seed=3)  # another episode of that world
    drive_episode(kept, actions, seed=4)
    found = [drive_episode(env, actions, seed=3) for env in (kept, fresh)]
    for a, b in zip(*found, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
        assert a[1:] == b[1:]
    logs = [first_ticks(env.unwrapped.finish().log, 100) for env in (kept, fresh)]
    assert log_hash(logs[0]) == log_hash(logs[1])


def test_seeds_are_drawn_from_the_list_and_repeat():
    env = make(seeds=(11, 12, 13), vehicles=0)
    drawn = [env.reset(seed=None if k else 11)[1]["seed"] for k in range(20)]
    assert set(drawn) == {11, 12, 13}
    assert drawn == [env.reset(seed=None if k else 11)[1]["seed"] for k in range(20)]


def test_full_throttle_into_traffic_ends_with_a_contact_that_costs():
    env = make(weather="clear-noon", duration=60.0)
    steps = drive_episode(env, [(1.0,)] * 1200, seed=1)
    _, reward, terminated, truncated, info = steps[-1]
    assert terminated
    assert not truncated
    assert info["metrics"]["contacts"] >= 1.0
    assert reward == pytest.approx(
        sum(weight * info["terms"][name] for name, weight in WEIGHTS.items())
    )
    assert reward < -0.9
    with pytest.raises(ConfigError, match="call reset first"):
        env.unwrapped.step(np.zeros(1, dtype=np.float32))


def test_terms_add_up_to_the_metrics_of_the_log():
    env = make(weather="clear-noon", duration=25.0)
    steps = drive_episode(env, [(0.6,)] * 500, seed=2)
    metrics = run_metrics(env.unwrapped.finish().log, env.unwrapped.map)
    told = steps[-1][4]["metrics"]
    assert told["distance_km"] == pytest.approx(metrics.distance_km, rel=0.01)
    assert told["contacts"] == metrics.contacts


def test_ice_is_felt_and_not_said():
    speeds = {}
    for weather, grip in (("clear-noon", "physical"), ("icy_100", "physical"), ("icy_100", "none")):
        steps = drive_episode(make(vehicles=0, grip=grip, weather=weather), [(1.0,)] * 100, seed=1)
        speeds[weather, grip] = steps[-1][0][AT["speed"]]
    assert speeds["icy_100", "physical"] < 0.7 * speeds["clear-noon", "physical"]
    assert speeds["icy_100", "none"] == pytest.approx(speeds["clear-noon", "physical"], rel=0.05)
    assert not any("grip" in q.name or "friction" in q.name for q in OBSERVED)


def test_the_vehicle_ahead_is_the_one_of_the_world():
    env = make(weather="clear-noon")
    for observation, *_ in drive_episode(env, [(0.7,)] * 150, seed=1):
        gap = observation[AT["gap"]]
        world = env.unwrapped.world
        ahead = [
            float(
                np.hypot(
                    world.states.x[i] - world.states.x[0], world.states.y[i] - world.states.y[0]
                )
            )
            - 0.5 * float(world.table.length[0] + world.table.length[i])
            for i in range(1, len(world.table))
            if world.placed["lane"][i] == world.placed["lane"][0]
            and world.placed["s"][i] > world.placed["s"][0]
        ]
        if ahead and min(ahead) < 60.0:
            assert gap == pytest.approx(min(ahead), abs=0.5)
        assert observation[AT["has_lead"]] == (gap < 150.0)


def test_a_vector_of_environments_gives_what_each_gives_alone():
    many = gymnasium.make_vec(
        "skidpad/Follow-v0", num_envs=2, vectorization_mode="sync", weather="icy_30", duration=5.0
    )
    many.reset(seed=[3, 4])
    for _ in range(40):
        observations, rewards, *_ = many.step(np.full((2, 1), 0.4, dtype=np.float32))
    for row, seed in enumerate((3, 4)):
        steps = drive_episode(make(duration=5.0), [(0.4,)] * 40, seed=seed)
        np.testing.assert_array_equal(observations[row], steps[-1][0])
        assert rewards[row] == steps[-1][1]
    many.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"grip": "icy"}, "unknown grip 'icy'; choose one of: none, statistical, physical"),
        ({"weather": "icy"}, "unknown weather 'icy'"),
        ({"traffic": "many"}, "unknown traffic 'many'"),
        ({"vehicles": -1}, "vehicles must be between 0 and 80, got -1"),
        ({"duration": -1.0}, "duration must be between 0.05 and 100000, got -1.0"),
        ({"seeds": ()}, "seeds: at least one is needed"),
        ({"rewards": {"speed": 1.0}}, "unknown term 'speed'; there are distance_km, contacts"),
    ],
)
def test_what_cannot_be_is_said_at_once(options, message):
    with pytest.raises(ConfigError, match=message):
        make(**options)
    with pytest.raises(
        ConfigError, match="unknown reset option 'friction'; choose one of: weather, grip"
    ):
        make().reset(options={"friction": 0.3})


def test_help_tells_what_each_argument_is_by_default():
    said = " ".join(DriveEnv.__doc__.split())
    for name, parameter in inspect.signature(Episodes).parameters.items():
        if name != "make":
            default = parameter.default
            word = (
                f'"{default}"'
                if isinstance(default, str)
                else f"{default:g}"
                if default
                else "None"
            )
            about = said.partition(f" {name}: ")[2].partition(".")[0]
            assert f"{word} (default)" in about or f"default {word}" in about
