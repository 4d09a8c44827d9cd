"""The demo in small: real drives, real service, and the outcome that the vehicles' reports decide."""

from __future__ import annotations

import pytest

from skidpad.cli.fleet_demo import PLAN, SEED, Demo, drive, enrolled, play, rule_sets, serving
from skidpad.evidence.channels.hazards import Profile
from skidpad.fleet.loop.plan import Plan
from skidpad.fleet.updates.payloads import PayloadKind, settings_of_content


def test_the_rule_sets_of_the_demo_are_valid_and_differ():
    sets = rule_sets()
    assert len(set(sets.values())) == 3
    settings = {name: settings_of_content(PayloadKind.RULES, c) for name, c in sets.items()}
    assert {name: s.profile for name, s in settings.items()} == {
        "published": Profile.AS_PRINTED,
        "tracked": Profile.TRACKED,
        "looser": Profile.TRACKED,
    }
    assert {name: len(s.rules) for name, s in settings.items()} == {
        "published": 6, "tracked": 7, "looser": 7,
    }  # fmt: skip
    assert Plan(**{**PLAN, "stages": tuple(PLAN["stages"])}).alpha_of_look == 0.025


@pytest.mark.slow
@pytest.mark.req("C-176", "C-178", "C-190", "C-191", "C-192")
def test_the_demo_takes_back_the_bad_update_and_decides_by_what_was_driven(tmp_path):
    """Four vehicles, ten seconds each; every drive has a seed of its own."""
    maker, _, cars = enrolled(tmp_path, 4)
    said: list[str] = []
    with serving(tmp_path / "data", 0) as address:
        demo = Demo(
            tmp_path, address, maker, cars, 10.0, lambda jobs: [drive(j) for j in jobs], said.append
        )
        good, bad = play(demo)
        told = [demo.call(c.token, "GET", "/api/v1/updates/assignment").json() for c in cars]
    means = [[e["detail"] for e in r["events"] if e["what"] == "looked"][-1] for r in (good, bad)]
    assert means[0]["mean"] < means[1]["mean"], said
    assert bad["ended"] == "reverted", said
    for release, last in zip((good, bad), means, strict=True):
        expected = {"advance": "completed", "revert": "reverted"}[last["decision"]]
        assert release["ended"] == expected
    stands = good["payload"] if good["ended"] == "completed" else ""
    assert bad["before"] == stands
    assert {t["payload"] for t in told} == {stands}
    assert demo.next_seed - SEED == sum(car.drives for car in cars)  # no seed twice
