"""A car on its side is told in the cockpit and counts as a crash in a campaign's standing."""

from types import SimpleNamespace

import pytest

from skidpad.cockpit.hud import list_events
from skidpad.cockpit.replay import told_of
from skidpad.cockpit.watching import Key, Line, has_crashed
from skidpad.core.vocabulary import Supervision
from skidpad.recording.run.events import RolledOver


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


def test_a_replay_marks_the_egos_roll_over_as_a_crash():
    assert told_of(RolledOver(30, 0)) == ("crash", "rolled over")
    assert told_of(RolledOver(30, 1)) is None


@pytest.mark.parametrize(
    ("outcome", "crashed"), [("completed", False), ("collision", True), ("roll_over", True)]
)
def test_a_run_that_ended_on_its_side_has_crashed(outcome, crashed):
    assert has_crashed(Line(run="a", key=Key(outcome=outcome))) is crashed
