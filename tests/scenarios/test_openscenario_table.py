"""The coverage table of the docs is that of the code."""

from __future__ import annotations

from openscenario_coverage import Support, coverage
from openscenario_table import PAGE, marked_tests, page


def test_the_page_says_what_the_code_knows():
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text, "python tools/openscenario_table.py writes it anew"


def test_an_element_that_is_noted_alone_is_not_supported():
    support = {row.element: row.support for row in coverage()}
    only_noted = set(marked_tests("osc_noted")) - set(marked_tests())
    assert {"AnimationAction", "SetMonitorAction"} <= only_noted
    assert {support[element] for element in only_noted} == {Support.NO}


def test_marks_name_elements_of_the_standard_that_are_known():
    known = {row.element for row in coverage() if row.support is not Support.NO}
    assert set(marked_tests()) <= known
