"""Who drives in the background: natural drivers, and the risky ones with their weights."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis.strategies import floats

from skidpad.campaign.bench.headways import QUANTILES, field_sources
from skidpad.core.vocabulary import Headways, Stratum
from skidpad.simulation.world.traffic.mobil import B_SAFE, GAP_CLEAR, is_safe
from skidpad.simulation.world.traffic.state import TRAIT
from skidpad.simulation.world.traffic.variety import (
    GAP_LAYERS,
    HEADWAY_LAYERS,
    risky_character,
    tail_draw,
    vary,
)

IDS = range(4000)


def traits(stratum: Stratum) -> np.ndarray:
    found = np.zeros(len(IDS), dtype=TRAIT)
    found["factor"] = found["a_max"] = 1.0
    found["room"], found["imposed"], found["eager"] = GAP_CLEAR, B_SAFE, 1.0
    vary(found, IDS, 7, stratum)
    return found


TAIL = 0.1


@pytest.mark.parametrize("layers", [HEADWAY_LAYERS, GAP_LAYERS])
@given(which=floats(0.0, 1.0, exclude_max=True), where=floats(0.0, 1.0, exclude_max=True))
def test_no_weight_exceeds_what_the_share_of_natural_draws_allows(layers, which, where):
    u, weight = tail_draw(layers, which, where)
    assert 0.0 <= u < 1.0
    assert 0.0 < weight <= 2.0
    assert (weight < 1.0) == (u < TAIL)
    assert sum(share for _, share in layers) == 1.0


@pytest.mark.req("C-2")
def test_weighted_risky_drivers_are_natural_ones():
    """By a second route: the weighted mean of what was drawn is that of the natural stratum."""
    natural, risky = traits(Stratum.NATURAL), traits(Stratum.RISKY)
    characters = [risky_character(7, i) for i in IDS]
    weights = np.array([c.of_headway for c in characters])
    assert weights.mean() == pytest.approx(1.0, abs=0.06)
    short = [np.mean(t["headway"] < 0.587) for t in (natural, risky)]  # a tenth of the natural
    assert short[0] == pytest.approx(TAIL, abs=0.02)
    assert short[1] == pytest.approx(0.5 * TAIL + 0.5, abs=0.03)
    mean = np.average(risky["headway"], weights=weights)
    assert mean == pytest.approx(natural["headway"].mean(), abs=0.03)
    assert np.average(risky["headway"] < 0.587, weights=weights) == pytest.approx(TAIL, abs=0.02)


@pytest.mark.req("C-2")
def test_cut_ins_weigh_up_to_the_published_gaps():
    """Median 9.57 m, 51.8 % below 10 m; the tails reach below what natural drivers leave."""
    risky = traits(Stratum.RISKY)
    weights = np.array([risky_character(7, i).of_gap for i in IDS])
    assert np.average(risky["room"] < 9.57, weights=weights) == pytest.approx(0.5, abs=0.03)
    assert np.average(risky["room"] < 10.0, weights=weights) == pytest.approx(0.518, abs=0.03)
    assert np.mean(risky["room"] < GAP_CLEAR) > 0.4


def test_natural_drivers_change_lanes_as_before():
    natural = traits(Stratum.NATURAL)
    for name, value in (("room", GAP_CLEAR), ("imposed", B_SAFE), ("eager", 1.0)):
        assert set(natural[name]) == {value}


def test_who_accepts_less_room_enters_where_others_do_not():
    assert not is_safe(0.0, 0.0, 50.0, 3.0, B_SAFE, GAP_CLEAR)
    assert is_safe(0.0, 0.0, 50.0, 3.0, B_SAFE, 2.0)
    assert not is_safe(0.0, -4.0, 50.0, 30.0, B_SAFE, GAP_CLEAR)
    assert is_safe(0.0, -4.0, 50.0, 30.0, 8.0, GAP_CLEAR)


@pytest.mark.parametrize(("count", "tolerance"), [(4000, 0.01), (60, 0.08)])
def test_headways_of_the_field_are_those_of_the_sources_to_fit(count, tolerance):
    """Sixty drivers of a run stand for the whole distribution."""
    found = np.zeros(count, dtype=TRAIT)
    vary(found, range(count), 7, headways=Headways.FIELD)
    assert found["is_exact"].all()
    for source in field_sources():
        if source.role == "fit":
            name = "headway" if source.road == "motorway" else "headway_town"
            field = [source.distribution().value(q) for q in QUANTILES]
            assert np.quantile(found[name], QUANTILES) == pytest.approx(field, rel=tolerance)
