"""Vector environments give what single ones give, and all vehicles can be agents of the one loop."""

from __future__ import annotations

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs Gymnasium (extra rl)")

from skidpad.core.errors import ConfigError  # noqa: E402
from skidpad.env import OBSERVED  # noqa: E402
from skidpad.env.all_agents import AllAgentsEpisode  # noqa: E402
from skidpad.env.ego import EgoEpisode  # noqa: E402
from skidpad.env.episodes import Episodes  # noqa: E402
from skidpad.env.reward import TERMS  # noqa: E402
from skidpad.recording.run.log_files import log_hash  # noqa: E402

AT = {quantity.name: i for i, quantity in enumerate(OBSERVED)}
TERM = {name: i for i, name in enumerate(TERMS)}


def begin_by(make, **options):
    defaults = {
        "map": "figure8", "weather": "clear-noon", "grip": "physical", "vehicles": 20,
        "traffic": "fixed", "duration": 20.0, "seeds": None, "profile": "recommended",
    }  # fmt: skip
    return Episodes(make, **{**defaults, **options})


def begin(make, **options):
    return begin_by(make, **options).begin(1, None, None)


def keep_lane(seen, pedal=0.6):
    """Actions of all agents: along the lane, and not into the vehicle ahead."""
    steer = 2.0 * seen[:, AT["curvature"]] * (1.0 + 0.002 * seen[:, AT["speed"]] ** 2)
    steer -= 0.05 * seen[:, AT["lane_offset"]] + 0.6 * seen[:, AT["heading_error"]]
    pedals = np.clip((seen[:, AT["gap"]] - 15.0) / 30.0, -1.0, pedal)
    return np.column_stack([pedals, np.clip(steer, -1.0, 1.0)])


def test_a_vector_of_environments_is_that_of_gymnasium():
    options = {"num_envs": 3, "weather": "icy_30", "duration": 3.0, "seeds": (3, 4)}
    ours = gymnasium.make_vec("skidpad/Follow-v0", **options)
    theirs = gymnasium.make_vec("skidpad/Follow-v0", vectorization_mode="sync", **options)
    assert type(ours).__name__ == "DriveVectorEnv"
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"]
    actions = np.random.default_rng(1).uniform(-0.3, 1.0, (130, 3, 1)).astype(np.float32)
    for a, b in zip(ours.reset(seed=[3, 4, 3]), theirs.reset(seed=[3, 4, 3]), strict=True):
        assert_equal(a, b)
    cut = 0
    for action in actions:
        found, wanted = ours.step(action), theirs.step(action)
        for a, b in zip(found, wanted, strict=True):
            assert_equal(a, b)
        assert found[0] in ours.observation_space
        cut += found[3].sum()
    assert cut == 6  # each of three twice, so that autoresets are among what was compared
    ours.close()
    theirs.close()


def assert_equal(a, b):
    """Equal arrays, in nested dicts too; what the masks leave out does not count."""
    if not isinstance(a, dict):
        np.testing.assert_array_equal(a, b)
        return
    assert a.keys() == b.keys()
    for name in a:
        mask = slice(None) if name.startswith("_") else a[f"_{name}"]
        if isinstance(a[name], dict):
            for term, values in a[name].items():
                np.testing.assert_array_equal(values[mask], b[name][term][mask])
        else:
            np.testing.assert_array_equal(a[name][mask], b[name][mask])


def test_what_cannot_be_of_a_vector_is_said_at_once():
    with pytest.raises(ConfigError, match="num_envs must be at least 1, got 0"):
        gymnasium.make_vec("skidpad/Follow-v0", num_envs=0)
    many = gymnasium.make_vec("skidpad/Follow-v0", num_envs=2, vehicles=0)
    with pytest.raises(ConfigError, match="call reset first"):
        many.step(np.zeros((2, 1)))
    with pytest.raises(ConfigError, match="seed: 2 are needed, got 3"):
        many.reset(seed=[1, 2, 3])


class Unmoved:
    """An episode without a world."""

    def __init__(self, spec):
        self.closed = False

    def restart(self):
        """Has nothing to go back to."""

    def close(self):
        self.closed = True


def test_a_reset_that_fails_leaves_the_present_episode_to_its_environment():
    kept, fresh = begin_by(Unmoved, seeds=(1, 2)), begin_by(Unmoved)
    for episodes in (kept, fresh):
        present = episodes.begin(1, None, None)
        with pytest.raises(ConfigError, match="nonsense"):
            episodes.begin(2, {"grip": "nonsense"}, present)
        assert not present.closed
        assert episodes.begin(1, None, None) is not present, "two environments would share it"
    present = kept.begin(2, None, None)
    assert kept.begin(2, None, present) is present
    other = kept.begin(1, None, present)
    assert kept.begin(2, None, other) is present


@pytest.mark.parametrize(
    ("map", "pedal", "steer", "term"),
    [
        ("figure8", 0.4, 0.4, "contacts"),
        ("figure8", 0.2, 1.0, "wrong_way"),
        ("town", 0.3, -0.2, "off_road"),
        ("straight", 0.4, 0.0, None),  # over the end of the map
    ],
)
def test_an_agent_alone_drives_and_ends_as_an_ego(map, pedal, steer, term):
    alone, ego = (
        begin(kind, map=map, vehicles=0, duration=60.0) for kind in (AllAgentsEpisode, EgoEpisode)
    )
    for _ in range(1199):
        alone.step(np.array([[pedal, steer]]))
        _, terminated, _ = ego.step((pedal, steer), {})
        np.testing.assert_array_equal(alone.observations, ego.observations)
        np.testing.assert_allclose(alone.terms[0], ego.terms, rtol=1e-12)
        assert bool(alone.ended[0]) == terminated
        if terminated:
            break
    assert terminated
    ends = [name for name in ("contacts", "off_road", "wrong_way") if ego.sums[TERM[name]]]
    assert ends == ([] if term is None else [term])


def test_agents_drive_on_the_one_loop_and_their_vehicles_are_noted_in_its_log():
    crowd = begin(AllAgentsEpisode, weather="icy_30")
    assert len(crowd.names) == 21
    for _ in range(200):
        crowd.step(keep_lane(crowd.observations))
    log = crowd.run.finish().log
    assert len(log) == 200
    assert log.table.names == crowd.names
    way = np.hypot(log.actors.vx, log.actors.vy)[1:].sum(axis=0) * 0.05 / 1000.0
    going = ~crowd.ended
    assert going.sum() >= 15
    speed = np.hypot(*(np.array(v[-1]) for v in (log.actors.vx, log.actors.vy)))
    assert (speed[going] > 2.0).sum() >= 12
    gone = crowd.sums[going, TERM["distance_km"]] - way[going]
    np.testing.assert_allclose(gone, speed[going] * 0.0, atol=0.002)


def test_the_tyres_of_every_agent_slide_on_ice():
    speeds = {}
    for weather in ("clear-noon", "icy_100"):
        crowd = begin(AllAgentsEpisode, weather=weather)
        for _ in range(40):
            crowd.step(np.tile((1.0, 0.0), (21, 1)))
        speeds[weather] = crowd.observations[:, AT["speed"]][~crowd.ended]
    assert speeds["icy_100"].max() < 0.7 * np.median(speeds["clear-noon"])


def test_agents_that_touch_are_both_taken_off_the_road():
    crowd = begin(AllAgentsEpisode)
    for _ in range(300):
        crowd.step(np.tile((1.0, 0.0), (21, 1)))
        touched = crowd.terms[:, TERM["contacts"]] > 0
        if touched.sum() >= 2:
            break
    assert touched.sum() >= 2
    assert crowd.ended[touched].all()
    assert crowd.world.states.present[touched].all()  # in this tick they are still seen
    for _ in range(2):
        crowd.step(np.tile((0.0, 0.0), (21, 1)))
    assert not crowd.world.states.present[touched].any()
    assert not crowd.terms[touched].any()


def test_a_crowd_goes_back_to_its_first_tick():
    found = []
    crowd = begin(AllAgentsEpisode, weather="icy_30", duration=5.0)
    for _ in range(2):
        while not crowd.over:
            crowd.step(keep_lane(crowd.observations, 1.0))
        found.append((log_hash(crowd.run.finish().log), crowd.sums.tolist(), crowd.ended.tolist()))
        crowd.restart()
        assert not crowd.over
    assert found[0] == found[1]


def test_pettingzoo_finds_no_fault():
    pytest.importorskip("pettingzoo", reason="needs PettingZoo (extra rl)")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    from skidpad.env.parallel_env import TrafficEnv

    parallel_api_test(TrafficEnv(weather="icy_30", vehicles=5, duration=8.0, seeds=(0, 1)), 200)
    parallel_seed_test(lambda: TrafficEnv(vehicles=5, duration=3.0), num_cycles=60)


def test_all_agents_have_what_they_are_rewarded_for():
    pytest.importorskip("pettingzoo", reason="needs PettingZoo (extra rl)")
    from skidpad.env.parallel_env import TrafficEnv

    env = TrafficEnv(vehicles=8, duration=10.0, rewards={"distance_km": 1000.0, "contacts": -5.0})
    observations, infos = env.reset(seed=2, options={"weather": "icy_70"})
    assert infos["ego"] == {"seed": 2}
    with pytest.raises(ConfigError, match="action of traffic_02 must be two numbers"):
        env.step({"traffic_02": np.array([np.nan, 0.0])})
    sums, metrics = dict.fromkeys(env.agents, 0.0), {}
    while env.agents:
        seen = np.array([observations[agent] for agent in env.agents])
        actions = dict(zip(env.agents, keep_lane(seen), strict=True))
        observations, rewards, _, _, infos = env.step(actions)
        for agent, reward in rewards.items():
            sums[agent] += reward
            metrics |= {agent: info["metrics"] for agent, info in infos.items() if info}
    assert metrics.keys() == set(env.possible_agents)
    for agent, found in metrics.items():
        wanted = 1000.0 * found["distance_km"] - 5.0 * found["contacts"]
        assert sums[agent] == pytest.approx(wanted)
    with pytest.raises(ConfigError, match="call reset first"):
        env.step({})
    with pytest.raises(ConfigError, match="unknown reward term of all agents 'stuck_relocations'"):
        TrafficEnv(rewards={"stuck_relocations": -1.0})
    with pytest.raises(ConfigError, match="unknown traffic 'random'"):
        TrafficEnv(traffic="random")
