"""Every id that code, tests and pages cite can be looked up."""

import csv
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DECISIONS = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
TEXTS = ("*.py", "*.md", "*.yaml", "*.toml", "*.js", "*.css")
DECISION = re.compile(r"\b[XLMGCKRT]-[1-9]\d?\b|\bB?D-\d{2,3}\b|\bDC-\d{2}\b")
REQUIREMENT = re.compile(r"\b[ABC]-\d{3}\b")
FINDING = re.compile(r"\b[BC]?F-\d{2}[a-z]{0,2}\b")
NOT_IDS = {"F-99", "D-552"}  # the unknown finding of a test; a technical note of NASA


def listed_decisions() -> set[str]:
    headings = re.findall(r"^### (\S+) ", DECISIONS, re.MULTILINE)
    rows = re.findall(r"^\| (B?D-\d+|DC-\d+) \|", DECISIONS, re.MULTILINE)
    assert len(headings + rows) == len(set(headings + rows)), "an id is listed twice"
    return {*headings, *rows}


def listed_requirements() -> set[str]:
    with (ROOT / "docs" / "traceability" / "requirements.csv").open(encoding="utf-8") as file:
        return {row["id"] for row in csv.DictReader(file)}


def listed_findings() -> set[str]:
    claims = (ROOT / "docs" / "results" / "claims.md").read_text(encoding="utf-8")
    return set(re.findall(r"^\| ([BC]?F-\d{2}\w*) \|", claims + DECISIONS, re.MULTILINE))


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
