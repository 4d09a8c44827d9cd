"""Constants outside the stack matter too: changed by 10 %, a named test fails (M-14).

A constant without such a test stands in SURVIVORS with the reason.
"""

from __future__ import annotations

from enum import Enum
from importlib import import_module
from pathlib import Path

import pytest

from support.guards import Guard, survivors_of

RECOVERY, METRICS = "simulation/test_recovery.py", "evidence/drive/test_metrics.py"
MANNER = "evidence/drive/test_manner.py"
PHASES = f"{RECOVERY}::test_a_contact_runs_through_all_phases_with_their_times"
STEER = f"{RECOVERY}::test_reversing_steers_by_the_printed_formula"
CLEAR = f"{RECOVERY}::test_the_ego_is_put_behind_whatever_stands_ahead"
GUARDS = (
    Guard("simulation.recovery", PHASES, "BRAKE_TIME REVERSE_TIME REVERSE_THROTTLE LIFT"),
    Guard("simulation.recovery", STEER, "REVERSE_STEER_GAIN REVERSE_STEER_MAX"),
    Guard("simulation.clear_place", CLEAR, "CLEAR_AHEAD CLEAR_ASIDE SHIFT_BACK"),
    Guard(
        "simulation.clear_place",
        f"{RECOVERY}::test_the_search_ends_after_four_shifts_and_says_so",
        "SHIFTS",
    ),
    Guard(
        "simulation.recovery",
        f"{RECOVERY}::test_contacts_in_the_cool_down_start_nothing",
        "COOL_DOWN",
    ),
    Guard(
        "simulation.recovery",
        f"{RECOVERY}::test_more_than_120_degrees_is_wrong_way",
        "WRONG_WAY_DOT",
    ),
    Guard(
        "simulation.clear_place",
        f"{RECOVERY}::test_a_car_on_the_bridge_obstructs_nobody",
        "LEVEL",
    ),
    Guard(
        "simulation.recovery",
        f"{RECOVERY}::test_standing_at_a_red_light_is_no_reason_to_be_moved",
        "LIGHT_REACH",
    ),
    Guard(
        "simulation.recovery",
        f"{RECOVERY}::test_a_second_on_the_pavement_with_all_wheels_is_a_departure",
        "OFF_ROAD_TIME",
    ),
    Guard(
        "simulation.recovery",
        f"{RECOVERY}::test_more_than_three_metres_beyond_the_edge_is_a_departure_at_once",
        "OFF_ROAD_LIMIT",
    ),
    Guard(
        "evidence.drive.collisions",
        f"{METRICS}::test_leaving_a_bend_without_a_lead_is_its_own_category",
        "BEND_RADIUS",
        (80.0, 450.0),  # the roads of the test have radii of 90 and 400 m
    ),
    Guard(
        "evidence.drive.manner",
        f"{MANNER}::test_a_surge_is_pulling_away_just_before_emergency_braking",
        "SURGE_TIME",
    ),
    Guard(
        "evidence.drive.manner",
        f"{MANNER}::test_a_surge_is_pulling_away_just_before_emergency_braking",
        "SURGE_THROTTLE",
        (0.19, 0.51),
    ),
    Guard("evidence.drive.manner", f"{MANNER}::test_braking_for_nothing_has_nobody_near", "NEAR",
          (36.0, 101.0)),
    Guard(
        "evidence.drive.manner",
        f"{MANNER}::test_a_slide_is_moving_elsewhere_than_one_points",
        "SPIN_ANGLE",
    ),
    Guard(
        "evidence.drive.manner",
        f"{MANNER}::test_a_second_hit_comes_within_three_seconds_of_a_relocation",
        "COOL_DOWN",
    ),
)  # fmt: skip
SURVIVORS = {
    "simulation.recovery.GRACE": "a default of the settings, read when the class is made; its effect "
    "is tested by test_the_grace_puts_the_stuck_detector_off",
    "simulation.clear_place.MARGIN": "room around the ego's own box; a car that touches it is tested, the "
    "width of the gap is ours",
    "evidence.drive.collisions.LOOK_BACK": "how much history a crash card tells",
    "evidence.drive.collisions.JUST_BEFORE": "the stretch in which bend, lead and brake are looked for",
    "evidence.drive.collisions.RECOVERY_LAG": "backends report a contact at most a few ticks late",
    "evidence.drive.collisions.BEHIND": "30 deg more or less: nobody is hit from exactly there",
    "evidence.drive.collisions.CHAIN_TIME": "tested by test_what_follows_soon_and_near_is_no_first, "
    "with limits of whole ticks",
    "evidence.drive.collisions.CHAIN_WAY": "as CHAIN_TIME",
    "evidence.drive.manner.SPIN_SPEED": "below it the angle of sliding is noise",
    "evidence.drive.manner.CALM": "a generous pause after a hit",
    "evidence.drive.manner.JERK_OVER": "a smoothing length; the jerk of known motions is tested",
}
CASES = [(g, constant) for g in GUARDS for constant in g.constants.split()]


@pytest.mark.slow
@pytest.mark.req("M-14")
@pytest.mark.parametrize(
    ("guard", "constant"), CASES, ids=[f"{g.module}.{constant}" for g, constant in CASES]
)
def test_a_changed_constant_outside_the_stack_is_noticed(
    guard: Guard, constant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not survivors_of(guard, constant, monkeypatch), guard.test


@pytest.mark.req("M-14")
@pytest.mark.parametrize("module", sorted({g.module for g in GUARDS}))
def test_every_number_outside_the_stack_is_guarded_or_listed_with_a_reason(module: str) -> None:
    loaded = import_module(f"skidpad.{module}")
    own = Path(str(loaded.__file__)).read_text(encoding="utf-8")
    numbers = {
        f"{module}.{name}"
        for name, value in vars(loaded).items()
        if name.isupper()
        and f"\n{name} = " in own
        and isinstance(value, (int, float))
        and not isinstance(value, Enum)
    }
    guarded = {f"{g.module}.{c}" for g, c in CASES}
    listed = {name for name in SURVIVORS if name.rpartition(".")[0] == module}
    assert numbers - guarded == listed
