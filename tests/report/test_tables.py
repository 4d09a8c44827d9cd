import csv
import io
from dataclasses import dataclass

import pytest

from skidpad.evidence.statistics import Interval
from skidpad.report.elements.page import Cell
from skidpad.report.elements.tables import Column, Format, Quantity, number, table


@dataclass(frozen=True)
class Drive:
    name: str
    crashes: int
    rate: Quantity


DRIVES = [
    Drive("dry", 3, Quantity(value=1.5, interval=Interval(0.31, 4.4), remark="n = 2", published=2)),
    Drive('ice, "thin"', 0, Quantity(value=None, published=7, doubted=True)),
]
COLUMNS = (
    Column[Drive]("drive", lambda d: d.name),
    Column[Drive]("crashes", lambda d: d.crashes, "of the ego"),
    Column[Drive]("rate", lambda d: d.rate, "per run", unit="1/h", format=Format(".2f", ".1f", "no run")),
    Column[Drive]("link", lambda d: Cell("see", href=d.name)),
)  # fmt: skip


def test_a_column_makes_heading_definition_and_cell():
    made = table(COLUMNS, DRIVES, "Drives")
    assert list(made.columns)[1:3] == [("crashes", "of the ego"), ("rate, 1/h", "per run")]
    first, second = made.rows
    assert [c.text for c in first] == ["dry", "3", "1.50", "see"]
    assert first[2].note.split("\n") == ["0.3 to 4.4, n = 2", "published 2"]
    assert second[2].text == "no run"
    assert second[2].note == "published 7 ?"


def test_the_csv_holds_every_number_with_its_limits_and_the_published_value():
    rows = list(csv.reader(io.StringIO(table(COLUMNS, DRIVES).csv())))
    assert rows == [
        ["drive", "crashes", "rate, 1/h", "rate, 1/h: low", "rate, 1/h: high",
         "rate, 1/h: published", "link"],
        ["dry", "3", "1.5", "0.31", "4.4", "2", "see"],
        ["ice, \"thin\"", "0", "", "", "", "7", "see"],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.0, "3"), (0.5, "0.50"), (-12.345, "-12.35"), (123.4, "123"), (1e9, "1000000000")],
)
def test_digits_follow_the_size(value, text):
    assert number(value) == text


def test_a_published_value_has_no_more_digits_than_can_be_compared():
    drive = Drive("dry", 0, Quantity(value=55.77, published=33.5512))
    assert table(COLUMNS, [drive]).rows[0][2].note == "published 33.55"
    assert table(COLUMNS, [drive]).rows[0][2].published == 33.5512
