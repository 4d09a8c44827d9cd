"""Who may do what, written down by hand from the roles of the source and not read from the table."""

from __future__ import annotations

import pytest

from skidpad.fleet.words import RIGHTS, Action

# m: manufacturer, o: operator, t: teleoperator, a: authority, r: researcher, v: vehicle
EXPECTED = {
    Action.REPORT: "v",
    Action.READ_HAZARDS: "mov",
    Action.EXPORT_SCENARIO: "mo",
    Action.READ_TRENDS: "mo",
    Action.ANALYSE: "mo",
    Action.TRIAGE: "mo",
    Action.READ_ALERTS: "ot",
    Action.ANSWER_ALERTS: "ot",
    Action.GUIDE: "t",
    Action.RECEIVE_ORDERS: "v",
    Action.RECEIVE_UPDATES: "v",
    Action.CHANGE: "m",
    Action.READ_CHANGES: "m",
    Action.READ_PLACES: "moa",
    Action.READ_RESEARCH: "r",
    Action.READ_SAFETY_CASE: "moa",
    Action.VISIT: "motar",
}


@pytest.mark.req("C-195")
@pytest.mark.parametrize("action", EXPECTED)
def test_each_role_has_the_rights_that_its_work_needs_and_no_others(action: Action) -> None:
    assert {role.value[0] for role in RIGHTS[action]} == set(EXPECTED[action])


def test_every_right_stands_in_the_table() -> None:
    assert set(EXPECTED) == set(Action) == set(RIGHTS)
