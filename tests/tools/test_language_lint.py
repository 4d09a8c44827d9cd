"""The lint of language counts each breach once, and its limits are not above what there is."""

from __future__ import annotations

import json

import pytest

from language_lint import (
    EXCEPTIONS,
    IRREGULAR,
    LIMITS,
    PAGE,
    PARTICIPLE,
    PERSON,
    RULES,
    SHORT,
    THEATRE,
    find_breaches,
    find_page_breaches,
)

FINE = '''
def load_map(name):
    """Returns the map of that name from the bundled ones."""


def is_kept(value):
    """Returns whether the value is kept in the cache."""


def feed(decoder, data):
    """Gives the decoder more bytes to work on."""
'''


def test_plain_names_and_sentences_are_fine() -> None:
    assert not list(find_breaches(FINE))


@pytest.mark.parametrize(
    ("source", "rule"),
    [
        ('def kept(x):\n    """Returns what is kept of it."""\n', PARTICIPLE),
        ('def opened(x):\n    """Returns the file at that place."""\n', PARTICIPLE),
        ('class Crew:\n    """Holds the channels of one vehicle."""\n', THEATRE),
        ('def read_map(x):\n    """As it is."""\n', SHORT),
        ('def read_map(x):\n    """Returns the map for whoever asks."""\n', PERSON),
        ("x = 1  # nobody reads it\n", PERSON),
    ],
)
def test_each_breach_is_found_once(source: str, rule: str) -> None:
    assert [b.rule for b in find_breaches(source)] == [rule]


def test_words_of_a_page_are_found_outside_of_code() -> None:
    page = "# A page\n`who` and\n```console\n$ whoami who\n```\n| Nobody | stops |\n"
    (breach,) = find_page_breaches(page)
    assert (breach.rule, breach.line) == (PAGE, 6)


@pytest.mark.parametrize("name", EXCEPTIONS)
def test_every_exception_has_its_reason_and_is_needed(name: str) -> None:
    assert EXCEPTIONS[name]
    assert name in IRREGULAR
    assert not list(
        find_breaches(f'def {name}(x):\n    """Returns what comes of it, as it is."""\n')
    )


def test_every_rule_has_a_limit() -> None:
    assert set(json.loads(LIMITS.read_text(encoding="utf-8"))) == set(RULES)
