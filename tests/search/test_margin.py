"""The margin falls towards failure, whatever the objective: property tests over what a run came to."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.vocabulary import ActorKind
from skidpad.evidence.drive.severity import LIGHT_BELOW, Contact
from skidpad.evidence.pairs import Pair
from skidpad.search import margin
from skidpad.search.margin import OBJECTIVES, _margin

number = st.one_of(st.none(), st.floats(0.0, 1e3))


def pair(gap, ttc, drac):
    return Pair("ego", "other", gap, ttc, None, drac, None, None)


def contact(speed, kind=ActorKind.CAR):
    return Contact(tick=3, actor=1, other="other", kind=kind, delta_v=speed, v_closing=speed)


@given(number, number, number, st.sampled_from(sorted(OBJECTIVES)))
def test_runs_without_contact_lie_between_one_and_two(gap, ttc, drac, objective):
    found = _margin(None, False, OBJECTIVES[objective]([pair(gap, ttc, drac)]))
    assert 1.0 <= found <= 2.0


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3), st.sampled_from(["combined", "gap"]))
def test_a_smaller_gap_is_never_better(a, b, objective):
    near, far = sorted((a, b))
    share = OBJECTIVES[objective]
    assert share([pair(near, 3.0, 2.0)]) <= share([pair(far, 3.0, 2.0)])


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3), st.sampled_from(["combined", "ttc"]))
def test_a_shorter_ttc_is_never_better(a, b, objective):
    near, far = sorted((a, b))
    share = OBJECTIVES[objective]
    assert share([pair(3.0, near, 2.0)]) <= share([pair(3.0, far, 2.0)])


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3), st.sampled_from(["combined", "braking"]))
def test_harder_braking_is_never_better(a, b, objective):
    less, more = sorted((a, b))
    share = OBJECTIVES[objective]
    assert share([pair(3.0, 3.0, more)]) <= share([pair(3.0, 3.0, less)])


@given(st.floats(0.0, 60.0), st.floats(0.0, 60.0), st.floats(0.0, 1.0))
def test_a_harder_contact_is_never_better_and_a_failure_is_at_most_zero(a, b, share):
    light, hard = sorted((a, b))
    assert _margin(contact(hard), False, share) <= _margin(contact(light), False, share)
    assert (_margin(contact(hard), False, share) <= 0.0) == (hard > LIGHT_BELOW)
    assert _margin(contact(light), False, share) <= 1.0


@given(st.floats(0.0, 60.0), st.floats(0.0, 1.0))
def test_a_person_is_always_a_failure_and_so_is_a_departure(speed, share):
    assert _margin(contact(speed, ActorKind.PEDESTRIAN), False, share) <= 0.0
    assert _margin(contact(speed, ActorKind.BICYCLE), False, share) <= 0.0
    assert _margin(None, True, share) <= 0.0


def test_no_conflict_is_two_by_every_objective():
    for share in OBJECTIVES.values():
        assert _margin(None, False, share([])) == margin.NO_CONFLICT
        assert share([pair(5.0, 2.0, 4.0)]) == pytest.approx(0.5)
