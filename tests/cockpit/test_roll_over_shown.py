"""A car on its side is told in the cockpit and counts as a crash in a campaign's standing."""

from types import SimpleNamespace

import pytest

from skidpad.cockpit.hud import list_events
from skidpad.cockpit.watching import Key, Line, has_crashed
from skidpad.core.vocabulary import Supervision


def moment(*rolled):
    truth = SimpleNamespace(
        contacts=(), invasions=(), rolled=rolled, table=SimpleNamespace(names=("ego", "lorry"))
    )
    return SimpleNamespace(
        truth=truth,
        frame=SimpleNamespace(supervision=Supervision.NONE),
        action=SimpleNamespace(relocate=None),
    )


def test_the_cockpit_says_which_vehicle_rolled_over():
    assert list_events(moment()) == []
    assert list_events(moment(0, 1)) == ["ego rolled over", "lorry rolled over"]


@pytest.mark.parametrize(
    ("outcome", "crashed"), [("completed", False), ("collision", True), ("roll_over", True)]
)
def test_a_run_that_ended_on_its_side_has_crashed(outcome, crashed):
    assert has_crashed(Line(run="a", key=Key(outcome=outcome))) is crashed
