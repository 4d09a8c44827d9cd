"""Every id that code, tests and pages cite can be looked up."""

import csv
import re
from pathlib import Path

import pytest

from support.ids import (
    DECISION,
    FINDING,
    REQUIREMENT,
    listed_decisions,
    listed_findings,
    listed_requirements,
)

ROOT = Path(__file__).resolve().parents[1]
TEXTS = ("*.py", "*.md", "*.yaml", "*.toml", "*.js", "*.css")
NOT_IDS = {"F-99", "D-552"}  # the unknown finding of a test; a technical note of NASA


def cited(pattern: re.Pattern[str]) -> dict[str, str]:
    """Ids that match `pattern`, each with a file that cites it."""
    found: dict[str, str] = {}
    for folder in ("src", "tests", "docs", "tools", "examples"):
        for kind in TEXTS:
            for path in sorted((ROOT / folder).rglob(kind)):
                for i in pattern.findall(path.read_text(encoding="utf-8")):
                    found.setdefault(i, str(path.relative_to(ROOT)))
    return found


@pytest.mark.parametrize(
    ("pattern", "listed"),
    [
        (DECISION, listed_decisions),
        (REQUIREMENT, listed_requirements),
        (FINDING, listed_findings),
    ],
)
def test_every_cited_id_can_be_looked_up(pattern, listed):
    known = listed()
    unknown = {i: where for i, where in cited(pattern).items() if i not in known | NOT_IDS}
    assert not unknown, "ids that no page explains (docs/decisions.md, docs/traceability, claims)"


def test_no_summary_of_a_requirement_is_cut():
    with (ROOT / "docs" / "traceability" / "requirements.csv").open(encoding="utf-8") as file:
        cut = [row["id"] for row in csv.DictReader(file) if row["summary"].endswith("...")]
    assert not cut
