"""Readings of further sensors have the type that their reader asks for, or are refused in a sentence."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from skidpad.core.errors import StackError
from skidpad.core.frames import GnssFix
from skidpad.core.sensor_types import read_sensor


def test_a_reading_of_another_kind_is_refused_by_name() -> None:
    frame = SimpleNamespace(extra={"air": 4.5, "place": GnssFix(48.0, 11.0, 500.0)})
    assert read_sensor(frame, "air", float) == 4.5
    assert read_sensor(frame, "place", GnssFix).altitude == 500.0
    with pytest.raises(StackError, match="sensor 'air' must read GnssFix, got float"):
        read_sensor(frame, "air", GnssFix)
    with pytest.raises(StackError, match="sensor 'rain' was not asked for"):
        read_sensor(frame, "rain", int)
