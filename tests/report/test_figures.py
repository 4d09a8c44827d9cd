import re

import pytest
from lxml import etree

from skidpad.report.figures import Series, grouped_bars, lines, panel, scatter

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
