"""Every campaign on a cluster: the same rows, deadlines that hold, deaths that cost one run."""

import pytest

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes import channels, matrix
from skidpad.campaign.workers.cluster import runner_of
from skidpad.campaign.workers.worker import Finished, Job
from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.vocabulary import Outcome
from support import jobs as work
from support.runs import adas_run, segment_run

pytest.importorskip("distributed")


def here(jobs):
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


def cells():
    return [adas_run(4, "rain-night", seed=seed, duration=4.0) for seed in (1, 2)]


def segments():
    return [segment_run(seed=seed, duration=2.0) for seed in (1, 2)]


@pytest.mark.slow
@pytest.mark.req("X-1")
@pytest.mark.parametrize(
    ("recipe", "tasks"),
    [(matrix.RECIPE, cells), (channels.RECIPE, segments)],
    ids=["matrix", "channels"],
)
def test_a_cluster_gives_the_same_results_and_goes_on(tmp_path, recipe, tasks):
    both = tasks()
    alone = Campaign(recipe, both).run(tmp_path / "alone", here)
    with runner_of("local:1", recipe.warm_up) as runner:
        far = Campaign(recipe, both).run(tmp_path / "far", runner)
        again = Campaign(recipe, both).run(tmp_path / "far", runner, resume=True)
    assert far.content_hash == alone.content_hash == again.content_hash
    assert (far.driven, far.failed, again.driven) == (2, 0, 0)


@pytest.mark.req("L-7")
def test_deadlines_and_deaths_are_as_in_the_pool(tmp_path):
    tries = tmp_path / "tries"
    some = [
        Job("hangs", work.sleep, 60.0, 0.5),
        Job("dies", work.suicide, str(tries)),
        Job("dies once", work.die_first, str(tmp_path / "mark")),
        Job("raises", work.odd_only, 2),
        *[Job(f"square-{n}", work.square, n) for n in range(3)],
    ]
    with runner_of("local:1") as runner:
        done = {f.job.key: f for f in runner(some)}
    assert {k: f.failure for k, f in done.items() if f.failure} == {
        "hangs": Outcome.TIMEOUT, "dies": Outcome.CRASHED, "raises": Outcome.CRASHED
    }  # fmt: skip
    assert tries.read_text() == "xx"
    assert "ValueError: 2 is even" in done["raises"].detail
    assert (done["dies once"].value, done["dies once"].attempts) == ("second", 2)
    assert [done[f"square-{n}"].value for n in range(3)] == [0, 1, 4]


def test_a_wrong_address_is_one_sentence(monkeypatch):
    with pytest.raises(ConfigError, match="local:N"), runner_of("local:none"):
        pass
    monkeypatch.setattr("skidpad.campaign.workers.cluster.CONNECT_S", 0.5)
    with (
        pytest.raises(BackendError, match="no scheduler answers"),
        runner_of("tcp://127.0.0.1:9"),
    ):
        pass
