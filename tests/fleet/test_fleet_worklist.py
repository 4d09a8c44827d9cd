"""Recurring hazards as a ranked list: by alarms times precision, with period and trend."""

from __future__ import annotations

import pytest

from fleet_world import packed, record
from skidpad.core.vocabulary import HazardType
from skidpad.fleet.insight.worklist import rank_work
from skidpad.fleet.site.dashboard import work_text


def test_many_alarms_that_are_rarely_true_stand_below_few_that_often_are(world):
    world.clock.now = 20_000 * 86_400.0
    close = [record(k) for k in range(6)]
    lost = [record(10 + k, hazard=HazardType.INCONSISTENT_LOCALISATION) for k in range(2)]
    ids = world.send("red-1", packed(*close[:4], *lost), "batch-key-1").json()["ids"]
    world.clock.now += 2 * 86_400.0
    ids += world.send("red-1", packed(*close[4:]), "batch-key-2").json()["ids"]
    clusters = [
        {"id": "a", "type": "ego_tailgating", "members": ids[:4] + ids[6:]},
        {"id": "b", "type": "inconsistent_localisation", "members": ids[4:6]},
    ]
    who = world.accounts["red operator"].principal
    with world.fleet.engine.connect() as connection:
        first, second = rank_work(connection, who, clusters)
        foreign = world.accounts["blue operator"].principal
        assert rank_work(connection, foreign, clusters) == []
    assert (first.cluster["id"], second.cluster["id"]) == ("b", "a")
    assert first.likely_true == pytest.approx(2 * 102 / 195)  # the rules "practical"
    assert second.likely_true == pytest.approx(6 * 3 / 672)
    assert (second.earlier, second.later) == (4, 2)
    assert "2024-10-04 to 2024-10-06, 4 in the first half, 2 in the second" in work_text(second)
    assert work_text(first).startswith("about 1.0 likely true (52 % [45, 59] of 195 alarms)")
