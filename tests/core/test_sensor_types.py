"""Readings of further sensors have the type that their reader asks for, or are refused in a sentence."""

from __future__ import annotations

import ast
from pathlib import Path
from types import SimpleNamespace

import pytest

from skidpad.core.errors import StackError
from skidpad.core.frames import GnssFix
from skidpad.core.sensor_types import read_sensor

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "skidpad"


def test_a_reading_of_another_kind_is_refused_by_name() -> None:
    frame = SimpleNamespace(extra={"air": 4.5, "place": GnssFix(48.0, 11.0, 500.0)})
    assert read_sensor(frame, "air", float) == 4.5
    assert read_sensor(frame, "place", GnssFix).altitude == 500.0
    with pytest.raises(StackError, match="sensor 'air' must read GnssFix, got float"):
        read_sensor(frame, "air", GnssFix)
    with pytest.raises(StackError, match="sensor 'rain' was not asked for"):
        read_sensor(frame, "rain", int)


def reads_extra(node: ast.AST) -> bool:
    """Tells whether a node takes one reading out of `.extra`: `[id]`, `.get`, `.items`, `.values`."""
    if isinstance(node, ast.Subscript):
        return isinstance(node.value, ast.Attribute) and node.value.attr == "extra"
    if isinstance(node, ast.Attribute) and node.attr in ("get", "items", "values", "pop"):
        return isinstance(node.value, ast.Attribute) and node.value.attr == "extra"
    return False


def test_readings_are_taken_out_of_a_frame_by_the_typed_accessor_alone() -> None:
    found = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if ".extra" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if reads_extra(node)
    }
    assert found == {"core/sensor_types.py"}
