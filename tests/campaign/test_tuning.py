"""The choice of the scenarios' values can be repeated, with seeds that no report uses (X-8)."""

import pytest

from scenario_tuning import RECIPE, SEEDS, Candidate, candidates, summary, trials
from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.matrix import FIRST_SEED
from skidpad.campaign.workers.worker import Finished
from skidpad.recording.campaign.results import read_results
from skidpad.scenarios.shipped import NAMES, find_shipped
from skidpad.scenarios.variation import CUT_IN, CutIn, variant_parameters

FEW = SEEDS[:3]


def here(jobs):
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


@pytest.mark.req("X-8")
def test_no_report_can_reach_a_tuning_seed():
    assert min(SEEDS) >= 900_000 > FIRST_SEED + 100


@pytest.mark.req("X-8", "B-074")
@pytest.mark.parametrize("name", NAMES)
def test_what_ships_is_one_of_the_candidates(name):
    nominal = dict(find_shipped(name).parameters)
    if name == CUT_IN:
        nominal |= variant_parameters(CutIn.FIXED)
    near = [
        all(nominal[k] == pytest.approx(v, abs=0.05) for k, v in c.values.items())
        for c in candidates(name)
    ]
    assert any(near)


@pytest.mark.req("B-070", "B-074", "B-075", "B-076", "B-078")
def test_the_delay_breaks_the_cut_in_and_the_shorter_distance_repairs_it(tmp_path):
    tried = [
        Candidate(CUT_IN, {"MergeDistance": variant_parameters(cutin)["MergeDistance"]}, cutin)
        for cutin in CutIn
    ]
    Campaign(RECIPE, trials(tried, FEW)).run(tmp_path / "out", here)
    rows = summary(read_results(tmp_path / "out"))
    shares = dict(rows.select("cutin", "completed").iter_rows())
    assert shares == {"original": 1.0, "unfixed": 0.0, "fixed": 1.0}
