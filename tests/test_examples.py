"""Profiles of hypothesis: every property scales with them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from hypothesis import settings

from support.examples import PROFILES, examples

TESTS = Path(__file__).parent


@pytest.mark.parametrize(("name", "count"), [("quick", 12), ("ci", 60), ("nightly", 1200)])
def test_a_profile_scales_what_a_property_asks_for(name, count):
    before = settings().max_examples
    settings.load_profile(name)
    try:
        assert settings().deadline is None
        assert examples(60) == count
        assert examples(6) >= 5
    finally:
        settings.load_profile(next(n for n, most in PROFILES.items() if most == before))


def counts_of_examples() -> list[tuple[str, ast.expr]]:
    """Returns each file and what it gives for `max_examples`."""
    return [
        (path.name, keyword.value)
        for path in sorted(TESTS.rglob("test_*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "settings"
        for keyword in node.keywords
        if keyword.arg == "max_examples"
    ]


def test_every_property_leaves_its_count_to_the_profile():
    counts = counts_of_examples()
    assert len(counts) > 40
    fixed = {
        name for name, value in counts if getattr(getattr(value, "func", 0), "id", "") != "examples"
    }
    assert not fixed, "write max_examples=examples(N)"
