import re
from collections import Counter
from pathlib import Path

import pytest

from support.slow_tests import quick_tests
from traceability import DOC, marks, proof, render, states, summaries

DECISION = re.compile(r"[XLMGCKRT]-[1-9]\d?")  # the project's settled questions; not listed


def test_every_mark_names_a_requirement_or_a_decision():
    unknown = {i for i in set(marks()) - set(summaries()) if not DECISION.fullmatch(i)}
    assert not unknown


def test_every_mark_in_the_tests_is_listed():
    """Counted in the texts, in whatever place or form a mark stands there."""
    texts = [p.read_text(encoding="utf-8") for p in Path(__file__).parent.rglob("*.py")]
    calls = [ids for text in texts for ids in re.findall(r"mark\.req\(([^)]*)\)", text)]
    written = Counter(i for ids in calls for i in re.findall(r"[A-Z]+-\d+", ids))
    assert written == Counter({i: len(tests) for i, tests in marks().items()})


def test_states_name_requirements_and_exclude_each_other():
    state = states()
    assert set(state["differs"]) | set(state["not_yet"]) <= set(summaries())
    assert not set(state["differs"]) & set(state["not_yet"])
    assert [i for i, why in state["differs"].items() if "lost" not in why] == [], (
        "what a user loses"
    )


def test_what_is_not_yet_there_has_no_test_that_claims_it():
    assert not set(states()["not_yet"]) & set(marks())


@pytest.mark.parametrize(
    ("tests", "how"),
    [
        (["report/test_channels_architecture.py::test_the_page_says_what"], "by document"),
        (["report/test_matrix_report.py::test_a", "test_readme.py::test_b"], "by page"),
        (["report/test_matrix_report.py::test_a", "physics/test_grip.py::test_b"], ""),
    ],
)
def test_what_only_words_prove_is_said_to_be_proved_by_words(tests, how):
    assert proof(tests) == how


# Proved by slow tests alone, because the proof needs the real client and a world that ticks.
SLOW_ALONE = {"A-266"}


def test_make_test_touches_every_requirement():
    """Each requirement that is done has a test that is not slow; what has none stands in the list."""
    quick, state = quick_tests(), states()
    open_ones = set(state["differs"]) | set(state["not_yet"])
    done = {i: set(tests) for i, tests in marks().items() if i in set(summaries()) - open_ones}
    assert len(done) > 400
    slow = {i for i, tests in done.items() if not quick & tests}
    assert slow == SLOW_ALONE


def test_files_of_tests_have_names_of_their_own():
    names = [p.name for p in Path(__file__).parent.rglob("test_*.py")]
    assert len(names) == len(set(names)), "pytest imports test files by their base name"


def test_the_page_says_what_the_tests_say():
    if DOC.read_text(encoding="utf-8") != render():
        pytest.fail("docs/requirements.md is out of date: run `python tools/traceability.py`")
