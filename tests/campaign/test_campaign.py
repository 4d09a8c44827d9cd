"""What is common to all campaigns: names, batches, stopping, resuming, retrying, the estimate."""

from collections import Counter
from dataclasses import replace

import msgspec
import pytest

from skidpad.campaign.campaign import PROBES, Campaign
from skidpad.campaign.recipes.recipe import cell_of
from skidpad.campaign.workers.worker import Finished
from skidpad.core.errors import ConfigError, OutputError
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.ledger import CAMPAIGN, read_ledger
from skidpad.recording.campaign.results import read_results
from support.toy_campaign import RECIPE, Toss


def here(jobs):
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


def tosses(n=50, **shares):
    return [Toss(cell, k, share) for k in range(n) for cell, share in shares.items()]


def runs(out):
    return Counter(read_results(out)["cell"].to_list())


def test_two_runs_of_one_name_are_refused():
    with pytest.raises(ConfigError, match="same name: a-000"):
        Campaign(RECIPE, [Toss("a", 0), Toss("a", 0, 0.7)])


@pytest.mark.req("X-9")
def test_a_cell_stops_after_whole_batches_when_enough_is_known(tmp_path):
    """Exact half-widths at 20 runs: 0.084 for 20 of 20, 0.228 for 10 of 20; at 40: 0.162."""
    campaign = Campaign(RECIPE, tosses(sure=1.0, even=0.5), until_halfwidth=0.2)
    summary = campaign.run(tmp_path / "out", here)
    assert runs(tmp_path / "out") == {"sure": 20, "even": 40}
    assert summary.runs == summary.driven == 60


@pytest.mark.req("X-9")
def test_a_campaign_that_was_killed_within_a_batch_stops_where_it_would_have(tmp_path):
    campaign = Campaign(RECIPE, tosses(sure=1.0, even=0.5), until_halfwidth=0.2)
    whole = campaign.run(tmp_path / "whole", here)

    def dying(jobs):
        for finished in here(jobs):
            if len(read_ledger(tmp_path / "part", RECIPE.entry)) == 57:
                raise KeyboardInterrupt
            yield finished

    with pytest.raises(KeyboardInterrupt):
        campaign.run(tmp_path / "part", dying)
    assert not (tmp_path / "part" / "results.parquet").exists()
    with pytest.raises(OutputError, match="--resume"):
        campaign.run(tmp_path / "part", here)
    told = []
    again = campaign.run(tmp_path / "part", here, resume=True, on_run=told.append)
    assert (again.driven, again.runs, len(told)) == (3, 60, 60)
    assert again.content_hash == whole.content_hash


@pytest.mark.req("L-7")
def test_what_crashed_has_a_row_and_is_driven_again_by_resume(tmp_path):
    def crashing(jobs):
        for job in jobs:
            yield Finished(job, failure=Outcome.CRASHED, detail="gone\n", wall_s=2.0, attempts=2)

    campaign = Campaign(RECIPE, tosses(2, even=0.5))
    summary = campaign.run(tmp_path, crashing)
    assert (summary.failed, list(summary.warnings())) == (
        2, ["2 runs crashed or timed out (gone); --resume tries again"]
    )  # fmt: skip
    table = read_results(tmp_path)
    assert table["outcome"].to_list() == ["crashed"] * 2
    assert table["heads"].to_list() == [None] * 2
    (entry, _) = read_ledger(tmp_path, RECIPE.entry)
    assert (entry.metrics, entry.error, entry.attempts, entry.timing.wall_s) == (None, "gone", 2, 2)
    assert campaign.run(tmp_path, here, resume=True).failed == 0


def test_the_identity_is_short_and_changes_with_anything_that_decides_a_run(tmp_path):
    base = Campaign(RECIPE, tosses(3, even=0.5))
    base.run(tmp_path, here)
    written = msgspec.json.decode((tmp_path / CAMPAIGN).read_bytes())
    assert written["common"] == {"cell": "even", "share": 0.5}
    assert written["varied"] == {"number": [0, 1, 2]}
    changed = [replace(t, share=0.6) if t.number == 1 else t for t in base.tasks]
    swapped = [replace(t, number=2 - t.number, cell=f"c{t.number}") for t in base.tasks]
    hashes = {Campaign(RECIPE, t).identity()["hash"] for t in (base.tasks, changed, swapped)}
    assert len(hashes) == 3


def test_an_estimate_drives_a_few_runs_spread_over_the_cells():
    drawn = []

    def drive(out, toss):
        drawn.append(toss.name)
        return RECIPE.drive(out, toss)

    found = Campaign(replace(RECIPE, drive=drive), tosses(50, a=0.5, b=0.5)).estimate()
    assert (found.runs, found.probes) == (100, PROBES)
    assert len(set(drawn)) == PROBES
    assert replace(found, cpu_s=0.6).minutes(workers=2) == pytest.approx(0.5)


def test_the_cell_of_a_run_is_its_name_without_the_number():
    assert (
        cell_of("ghost_cut_in-drops_icy_30_reduced-000001") == "ghost_cut_in-drops_icy_30_reduced"
    )


def test_further_runs_of_cells_that_moved_alike_are_driven_in_the_first_one_only(tmp_path):
    """Cells `even` and `same` toss alike, `sure` otherwise; a cell without a hash is its own."""
    moved = {"even": "m", "same": "m", "sure": "n"}
    recipe = replace(RECIPE, drive_of=lambda key: moved.get(key.cell))
    tasks = tosses(5, even=0.5, same=0.5, sure=1.0, odd=0.5)
    totals = []
    campaign = Campaign(recipe, tasks, distinct=True)
    summary = campaign.run(tmp_path / "out", here, on_total=totals.append)
    assert runs(tmp_path / "out") == {"even": 5, "same": 1, "sure": 5, "odd": 5}
    assert (summary.runs, totals) == (16, [20, 16])
    again = campaign.run(tmp_path / "out", here, resume=True)
    assert (again.driven, again.content_hash) == (0, summary.content_hash)
    with pytest.raises(ConfigError, match="exclude each other"):
        Campaign(recipe, tasks, distinct=True, until_halfwidth=0.1)
