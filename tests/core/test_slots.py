"""A frozen dataclass with filled slots is what Python's own is, made faster."""

from __future__ import annotations

import copy
import pickle
from dataclasses import FrozenInstanceError, asdict, dataclass, field, fields, replace
from inspect import signature

import pytest

from skidpad.core.geometry import Pose
from skidpad.core.objects.slots import fill_slots
from skidpad.core.states import StackReport


@dataclass(frozen=True, slots=True)
class Plain:
    x: float
    name: str = "a"
    more: dict[str, int] = field(default_factory=dict)


@fill_slots
@dataclass(frozen=True, slots=True)
class Filled:
    x: float
    name: str = "a"
    more: dict[str, int] = field(default_factory=dict)


@pytest.mark.parametrize("words", [{}, {"name": "b"}, {"more": {"c": 1}}])
def test_values_are_those_of_pythons_own(words):
    assert asdict(Filled(1.0, **words)) == asdict(Plain(1.0, **words))
    assert [f.name for f in fields(Filled)] == [f.name for f in fields(Plain)]
    assert list(signature(Filled).parameters) == list(signature(Plain).parameters)


def test_each_value_has_its_own_default():
    one, other = Filled(1.0), Filled(1.0)
    assert one == other
    assert one.more is not other.more


def test_missing_and_unknown_fields_are_refused():
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'x'"):
        Filled()  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="unexpected keyword argument 'y'"):
        Filled(1.0, y=2)  # type: ignore[call-arg]


def test_values_stay_frozen_and_travel():
    pose = Pose(1.0, 2.0, yaw=0.5)
    with pytest.raises(FrozenInstanceError):
        pose.x = 3.0  # type: ignore[misc]
    assert replace(pose, x=3.0) == Pose(3.0, 2.0, yaw=0.5)
    assert hash(pose) == hash(copy.copy(pose))
    report = StackReport(distance=4.0)
    assert pickle.loads(pickle.dumps(report)) == report
