"""The friction campaign: pairs, hashes, kills, agents that fail, stopping rule, cluster."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import polars as pl
import pytest

from skidpad.campaign.campaign import Campaign, uncertain_cells
from skidpad.campaign.cells.grip import Cross, cross, seeds, template
from skidpad.campaign.recipes.grip import recipe, select_shown_runs, warm_up
from skidpad.campaign.workers.cluster import run_on, runner_of
from skidpad.campaign.workers.pool import local
from skidpad.campaign.workers.worker import Finished, Runner
from skidpad.core.errors import OutputError
from skidpad.core.run import AgentDriver, Friction, RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import GripModel
from skidpad.physics.presets import preset
from skidpad.recording.campaign.grip import GripEntry, read_series
from skidpad.recording.campaign.ledger import read_ledger
from skidpad.recording.campaign.results import read_results
from skidpad.report.grip.data import load_grip
from skidpad.scenarios.variation import CutIn

WEATHERS = [preset("icy_0"), preset("icy_30")]


def cells(n=1, scenarios=("lead_slowdown",), **more) -> list[RunSpec]:
    return cross(template(**more), Cross(scenarios=scenarios, weather=WEATHERS), seeds(0, n))


def here(jobs):
    """A runner in this process: quick, and failures show their traceback."""
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


def run(cells, out, runner=here, **how):
    return Campaign(recipe(), cells).run(out, runner, **how)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("grip") / "out"
    run(cells(2, ("lead_slowdown", "ghost_cut_in")), out)
    return out


def test_a_kept_run_is_driven_again_from_its_checkpoint(tmp_path):
    from skidpad.campaign.runs.rerun import rerun

    out = tmp_path / "out"
    Campaign(recipe(checkpoints_s=2.0), cells()[:1]).run(out, here)
    (kept,) = (out / "runs").iterdir()
    again = rerun(kept, 5.0, 5.2, tmp_path / "pictures")
    assert again.same
    assert (again.begun_s, again.refused) == (4.0, "")


@pytest.mark.req("B-001", "B-004", "B-055", "B-066")
def test_ratio_1_changes_nothing_and_less_does(campaign):
    table = read_results(campaign)
    sides = (table.filter(pl.col("friction") == f) for f in ("original", "reduced"))
    both = sides.__next__().join(sides.__next__(), on=["scenario", "weather", "seed"])
    same = both["log_hash"] == both["log_hash_right"]
    assert same.filter(both["weather"] == "icy_0").all()
    assert not same.filter(both["weather"] == "icy_30").any()
    assert both.filter(pl.col("weather") == "icy_30")["ratio_right"].unique().to_list() == [
        pytest.approx(0.315022, abs=1e-6)
    ]


@pytest.mark.req("B-068", "B-125", "B-126")
def test_every_run_leaves_its_row_and_its_series(campaign):
    table = read_results(campaign)
    assert len(table) == 2 * 2 * 2 * 2
    for row in table.to_dicts():
        name = f"{row['scenario']}_{row['weather']}_{row['friction']}"
        series = read_series(campaign, f"{name}-{row['seed']:06d}")
        assert len(series) == round(row["duration_s"] / 0.05) + 1
        assert row["score"] is not None
        assert row["mu"] == pytest.approx(0.9 * row["ratio"], rel=1e-6)


@pytest.mark.req("X-8")
def test_pairs_begin_alike_and_seeds_differ(campaign):
    table = read_results(campaign)
    first = table.filter((pl.col("scenario") == "lead_slowdown") & (pl.col("weather") == "icy_30"))
    series = {
        (r["friction"], r["seed"]): read_series(
            campaign, f"lead_slowdown_icy_30_{r['friction']}-{r['seed']:06d}"
        )
        for r in first.to_dicts()
    }
    assert series["original", 1].row(0) == series["reduced", 1].row(0)
    assert series["original", 1].row(0) != series["original", 2].row(0)


def test_a_campaign_is_not_overwritten_and_resumes_without_driving(campaign):
    batch = cells(2, ("lead_slowdown", "ghost_cut_in"))
    with pytest.raises(OutputError, match="--resume"):
        run(batch, campaign)
    again = run(batch, campaign, resume=True)
    assert (again.driven, again.runs) == (0, 16)


def test_the_runs_that_a_report_shows_are_kept(campaign):
    roles = select_shown_runs(read_results(campaign))
    for row in roles.to_dicts():
        name = f"{row['scenario']}_{row['weather']}_{row['friction']}-{row['seed']:06d}"
        assert (campaign / "runs" / name / "ticks.parquet").exists()
    assert set(roles["role"]) == {"median", "worst"}


@pytest.mark.slow
@pytest.mark.req("X-1", "L-7")
def test_two_workers_one_worker_and_kills_give_the_same_results(tmp_path):
    batch = cells(3)
    one = run(batch, tmp_path / "one", local(1, warm_up))
    two = run(batch, tmp_path / "two", _killing(local(2, warm_up)))
    assert one.content_hash == two.content_hash
    assert (two.runs, two.failed) == (len(batch), 0)


def _killing(runner: Runner) -> Runner:
    """Kill one child of this process with SIGKILL while the runs are driven."""

    def run(jobs):
        begun = threading.Event()

        def kill():
            begun.wait(600.0)
            mine = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()
            workers = [p for p in mine if b"spawn_main" in Path(f"/proc/{p}/cmdline").read_bytes()]
            os.kill(int(workers[-1]), signal.SIGKILL)

        thread = threading.Thread(target=kill)
        thread.start()
        for finished in runner(jobs):
            if not begun.is_set():
                begun.set()
                time.sleep(0.05)
            yield finished
        thread.join()

    return run


@pytest.mark.slow
@pytest.mark.req("X-1")
def test_a_dask_cluster_gives_the_same_results(tmp_path):
    pytest.importorskip("distributed")
    batch = cells(1)
    alone = run(batch, tmp_path / "alone")
    with runner_of("local:2") as runner:
        far = run(batch, tmp_path / "far", runner)
    assert far.content_hash == alone.content_hash


@pytest.mark.slow
@pytest.mark.req("X-1", "L-7")
def test_a_dask_worker_killed_during_a_run_loses_nothing(tmp_path):
    distributed = pytest.importorskip("distributed")
    batch = cells(3)
    alone = run(batch, tmp_path / "alone")

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        begun = threading.Event()
        pids = set(client.run(os.getpid).values())

        def kill():
            begun.wait(600.0)
            os.kill(min(pids), signal.SIGKILL)

        thread = threading.Thread(target=kill)
        thread.start()

        def killing(jobs):
            for finished in run_on(client, jobs):
                begun.set()
                yield finished

        far = run(batch, tmp_path / "far", killing)
        thread.join()
    assert far.content_hash == alone.content_hash
    assert (far.runs, far.failed) == (len(batch), 0)


AGENTS = """
class Good:
    def setup(self, path): self.n = 0
    def sensors(self): return [{'type': 'sensor.speedometer', 'id': 'speed'}]
    def set_global_plan(self, gps, world): self.plan = world
    def run_step(self, data, timestamp):
        class Control: throttle, brake, steer, hand_brake, reverse = 0.0, 1.0, 0.0, False, False
        assert data['speed'][1]['speed'] >= 0.0 and len(self.plan) > 10
        return Control()
    def destroy(self): pass
class Raises(Good):
    def run_step(self, data, timestamp): raise ZeroDivisionError('on purpose')
class Silent(Good):
    def run_step(self, data, timestamp): return None
"""


@pytest.mark.parametrize(
    ("name", "outcome", "told"),
    [
        ("Good", "not_triggered", ""),
        ("Raises", "agent_error", "on purpose"),
        ("Silent", "agent_error", "no control"),
    ],
)
def test_an_agent_that_fails_is_an_outcome_and_the_campaign_goes_on(tmp_path, name, outcome, told):
    (tmp_path / "agents.py").write_text(AGENTS, encoding="utf-8")
    batch = cells(1, driver=AgentDriver(f"{tmp_path / 'agents.py'}:{name}"))[:2]
    run(batch, tmp_path / "out")
    entries = read_ledger(tmp_path / "out", GripEntry)
    if name == "Good":
        # it brakes at once, so that the lead drives off: the scenario takes place without it
        assert {e.key.outcome for e in entries} <= {"completed", "not_triggered"}
        return
    assert [e.key.outcome for e in entries] == [outcome] * 2
    for entry in entries:
        assert told in entry.error
        trace = (tmp_path / "out" / "runs" / entry.run / "error.txt").read_text(encoding="utf-8")
        assert "Traceback" in trace


@pytest.mark.req("X-9")
def test_only_cells_that_are_still_uncertain_get_more_runs(campaign):
    trials = [
        (e.run.rsplit("-", 1)[0], e.metrics.completion) for e in read_ledger(campaign, GripEntry)
    ]
    assert uncertain_cells(trials, 0.001) == {cell for cell, _ in trials}
    assert uncertain_cells(trials * 400, 0.05) == set()


@pytest.mark.req("B-070", "B-071", "B-074", "B-075", "B-076", "B-077", "B-079")
def test_the_spawn_delay_alone_breaks_the_cut_in_and_the_distance_repairs_it(tmp_path):
    variants = [CutIn.ORIGINAL, CutIn.UNFIXED, CutIn.FIXED]
    varied = Cross(
        scenarios=["ghost_cut_in"],
        weather=[preset("rain_0")],
        frictions=[Friction.ORIGINAL],
        cutins=variants,
    )
    batch = cross(template(), varied, seeds(0, 4))
    run(batch, tmp_path / "out")
    outcomes = read_results(tmp_path / "out").group_by("cutin").agg(pl.col("outcome").unique())
    assert dict(outcomes.iter_rows()) == {
        "original": ["completed"], "unfixed": ["collision"], "fixed": ["completed"]
    }  # fmt: skip
    found = load_grip(tmp_path / "out").variant_distances
    distance = {name: {m: d.value for m, d in ds.items()} for name, ds in found.items()}
    assert set(distance["original"].values()) == {0.0}
    for metric in ("y", "cvip"):
        assert distance["unfixed"][metric] > distance["fixed"][metric] > 0.0, metric


@pytest.mark.req("B-003")
def test_the_physical_model_reaches_the_tyres(tmp_path):
    batch = cells(1, settings=load_profile("recommended", {"grip": GripModel.PHYSICAL}))[2:]
    run(batch, tmp_path / "out")
    mu = dict(read_results(tmp_path / "out").select("friction", "mu").iter_rows())
    assert mu["original"] == pytest.approx(0.9)
    assert mu["reduced"] < 0.2  # sheet ice
