"""What the page of changes says of a release, in errors per drive."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from skidpad.fleet.site.reports import effect_text


@pytest.mark.parametrize(
    ("looks", "text"),
    [
        ([], "not measured yet"),
        ([{"mean": -1.89, "drives": 9}, {"mean": -1.39, "drives": 59}],
         "1.39 fewer errors per drive, over 59 drives"),
        ([{"mean": 1.95, "drives": 1}], "1.95 more errors per drive, over 1 drive"),
        ([{"mean": 0.0, "drives": 4}], "as many errors per drive as before, over 4 drives"),
    ],
)  # fmt: skip
def test_a_release_says_what_its_last_look_measured(looks, text):
    events = [SimpleNamespace(detail=d) for d in [{"stage": 0}, *looks, {"reason": "done"}]]
    assert effect_text(SimpleNamespace(events=events)) == text
