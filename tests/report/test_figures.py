import re

import pytest
from lxml import etree

from skidpad.report.elements.figures import (
    INK,
    PALETTE,
    Series,
    cut_note,
    grouped_bars,
    lines,
    panel,
    points_with_intervals,
    scatter,
)
from support.svg_values import bars, texts

BARS = [
    Series("a", [1.0, None, 3.0], [0.5, None, 2.0], [2.0, None, 5.0], [1.5, 2.0, None]),
    Series("b", [2.0, 2.0, 2.0]),
]


@pytest.mark.parametrize(
    "svg",
    [
        grouped_bars(["x", "y", "z"], BARS, "collisions"),
        scatter([("one", [1, 2], [3, 4])], "dropout", "collisions"),
        panel(["x", "y", "z"], [("error", BARS[0]), ("speed", BARS[1])]),
        lines([("one", [1, 2], [3, 4]), ("two", [1, 2], [4, 4])], "wetness", "ratio"),
    ],
)
def test_charts_are_whole_svg_elements_that_scale(svg):
    root = etree.fromstring(svg)
    assert root.tag.endswith("svg")
    assert root.get("width") is None
    assert root.get("viewBox")
    assert not re.search(r'href="http', svg)


def test_the_same_numbers_give_the_same_bytes():
    assert grouped_bars(["x", "y", "z"], BARS, "c") == grouped_bars(["x", "y", "z"], BARS, "c")


def test_ids_are_whole_and_belong_to_one_chart():
    one = grouped_bars(["x", "y", "z"], BARS, "collisions")
    two = grouped_bars(["x", "y", "z"], BARS[:1], "collisions")
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in (one, two)]
    assert not ids[0] & ids[1]
    for svg, known in zip((one, two), ids, strict=True):
        used = set(re.findall(r'(?:url\(#|href="#)([^")]+)', svg))
        assert used
        assert used <= known


WIDE = Series("rain", [1.0, 2.0], [0.5, 0.0], [1.5, 30.0])
NARROW = Series("rain", [1.0, 2.0], [0.5, 0.0], [1.5, 3.0])


def marks(svg):
    """How many marks have a colour of the palette or are of ink, as arrows of bars are."""
    uses = re.findall(r"<use [^>]*style=\"([^\"]*)", svg)
    return sum(any(f"fill: {colour}" in style for colour in (*PALETTE, INK)) for style in uses)


@pytest.mark.parametrize("series", [[WIDE], [WIDE, NARROW]])
def test_an_interval_that_the_axis_cuts_ends_in_an_arrow_and_the_caption_says_so(series):
    whole = [NARROW] * len(series)
    for draw in (
        lambda s: points_with_intervals(["a", "b"], s, "crashes"),
        lambda s: grouped_bars(["a", "b"], s, "crashes"),
    ):
        assert marks(draw(series)) == marks(draw(whole)) + 1
    assert cut_note(series) == " An arrow at the edge: the interval goes on beyond the axis."
    assert cut_note(whole) == ""


def test_bars_stand_apart_whatever_the_widest_interval_is():
    wide, narrow = (
        bars(grouped_bars(["a", "b"], [s], "crashes"), PALETTE[0]) for s in (WIDE, NARROW)
    )
    assert wide == pytest.approx([1.0, 2.0], abs=1e-3)
    assert narrow == pytest.approx([1.0, 2.0], abs=1e-3)
    numbers = [
        float(t) for t, *_ in texts(grouped_bars(["a", "b"], [WIDE], "n")) if t[:1].isdigit()
    ]
    assert max(numbers) <= 8.0, "four times the largest estimate"


def test_a_difference_that_goes_beyond_the_axis_to_the_left_has_its_arrow_there():
    cut = Series("rain", [1.0], [-9.0], [1.5])
    whole = Series("rain", [1.0], [-1.0], [1.5])
    drawn = [marks(points_with_intervals(["a"], [s], "d", origin=0.0)) for s in (cut, whole)]
    assert drawn[0] == drawn[1] + 1
