"""One quantity has one name: on pages, in the terminal and in the docs, from one list in code."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.campaign.quantities import NAMES, QUANTITIES, heading_of
from skidpad.recording.campaign.results import definitions_of
from skidpad.report.matrix.data import load_matrix
from skidpad.report.matrix.page import build_page, write_report
from support.matrix_drawn import write_drawn_campaign
from support.report_page import read_page

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src/skidpad"
LIST = SOURCE / "recording/campaign/quantities.py"
PUBLISHED = re.compile(r"publish|the sources?['’]?s? (call|own)", re.IGNORECASE)
CLAIMS = SOURCE / "evidence/drive"  # words of the sources, as they stand behind an id
QUOTED = {"Lane centring cuts lane invasions."}
# pages that quote: requirements and decisions as they were written, ids of claims with their words
NOT_OURS = ("requirements.md", "decisions.md", "traceability/", "results/docs-run")
OTHERS = re.compile(
    "|".join(
        r"\b" + r"(?:e?s)?[ -]".join(map(re.escape, other.split())) + r"(?:e?s)?\b"
        for q in QUANTITIES
        for other in q.others
    ),
    re.IGNORECASE,
)


def other_names(text: str) -> list[str]:
    """The names in a text that its quantities must not have, outside words on what was published."""
    for quote in QUOTED:
        text = text.replace(quote, "").replace(quote[0].lower() + quote[1:].rstrip("."), "")
    sentences = re.split(r"(?<=[.!?])\s+|\n", text)
    return [
        f"{m.group()!r} in {s.strip()[:120]!r}"
        for s in sentences
        if not PUBLISHED.search(s)
        for m in OTHERS.finditer(s)
    ]


def strings(path: Path) -> list[tuple[int, str]]:
    """Texts in a module that can be printed: no docstring of a module, class or function but a command's."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            is_command = SOURCE / "cli" in path.parents and isinstance(node, ast.FunctionDef)
            if not is_command:
                skipped.add(body[0].value)
        if isinstance(node, ast.JoinedStr):
            skipped.update(node.values)
    found = []
    for node in ast.walk(tree):
        if node in skipped:
            continue
        if isinstance(node, ast.JoinedStr):
            parts = [v.value if isinstance(v, ast.Constant) else "{}" for v in node.values]
            found.append((node.lineno, "".join(map(str, parts))))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.append((node.lineno, node.value))
    return found


def test_the_list_names_each_column_once_and_only_columns_that_are_there():
    columns = [c for q in QUANTITIES for c in q.columns]
    assert len(columns) == len(set(columns)) == len(NAMES)
    assert len({q.name for q in QUANTITIES}) == len(QUANTITIES)
    known = {name for name, _, _ in definitions_of(Metrics)} | {"crashes"}
    assert set(columns) <= known
    assert not [q.name for q in QUANTITIES if other_names(q.name)]


def test_the_test_finds_another_name_and_lets_published_ones_pass():
    assert other_names("Fatal collisions per run") == [
        "'Fatal collisions' in 'Fatal collisions per run'"
    ]
    assert all(
        map(other_names, ("average-speed, km/h", "radar FPR, %", "departures from the road"))
    )
    assert not other_names("The published tables call it a fatal collision.")
    assert not other_names("fatal_collisions > 0.1"), "a column keeps its name"
    assert not other_names("Lane centring cuts lane invasions.")


@pytest.mark.parametrize("folder", sorted(p.name for p in SOURCE.iterdir() if p.is_dir()))
def test_no_text_in_the_code_has_another_name_for_a_quantity(folder):
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text}"
        for path in sorted((SOURCE / folder).rglob("*.py"))
        if path != LIST
        for line, words in strings(path)
        for text in other_names(words)
    ]
    assert not found, "\n".join(found)


def test_no_page_of_the_docs_has_another_name_for_a_quantity():
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    found = [
        f"{path.relative_to(ROOT)}: {text}"
        for path in pages
        if not any(part in path.as_posix() for part in NOT_OURS)
        for text in other_names(path.read_text(encoding="utf-8"))
    ]
    assert not found, "\n".join(found)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A campaign of ten seeds, and its page as text."""
    folder = tmp_path_factory.mktemp("named")
    write_drawn_campaign(folder, seeds=10)
    return folder


def test_the_page_of_the_matrix_has_one_name_for_each_quantity(campaign):
    html = read_page(write_report(campaign))
    html = re.sub(r"<style.*?</style>|<script.*?</script>", "", html, flags=re.DOTALL)
    text = re.sub(r"\s*\n\s*", "\n", re.sub(r"<[^>]+>", "\n", html))
    assert all(name in text for name in ("Interventions per run", "mean distance error"))
    assert not other_names(text), "\n".join(other_names(text))


def test_tables_of_the_matrix_are_headed_by_the_name_of_their_quantity(campaign):
    sections = {s.title: s.blocks for s in build_page(load_matrix(campaign)).sections}
    captions = [b.caption for blocks in sections.values() for b in blocks if b.kind == "table"]
    for column in ("road_departures", "fatal_collisions", "fatal_first", "lane_invasions"):
        assert any(c.lower().startswith(f"{NAMES[column]} per run") for c in captions), column
    for column in ("dropout_pct", "mean_error_m", "radar_fpr_pct", "mean_speed_kmh"):
        assert any(c.lower().startswith(f"{NAMES[column]}, ") for c in captions), column
    rows = [row[0].text for row in sections["All metrics"][0].rows]
    assert rows.count("interventions") == 1
    assert len(rows) == len(set(rows)), "two rows have the same name"


def test_verdicts_speak_of_quantities_by_name_with_their_unit(campaign):
    blocks = [b for s in build_page(load_matrix(campaign)).sections for b in s.blocks]
    told = " ".join(b.numbers for b in blocks if b.kind == "verdict")
    assert "interventions, configuration 0 minus configuration 3" in told
    assert "mean speed in km/h, configuration 2 minus configuration 1" in told
    assert not [c for c in NAMES if "_" in c and re.search(rf"\b{c}\b", told)]
    assert heading_of("fatal_per_100_km") == "interventions per 100 km"
    assert heading_of("some_column_m") == "some_column_m"


def test_the_terminal_compares_interventions_of_older_results_too(campaign):
    told = CliRunner().invoke(app, ["compare", str(campaign), str(campaign)])
    assert told.exit_code == 0, told.output
    assert re.search(r"\binterventions\b", told.output)
    assert "fatal_collisions" not in told.output
    rows = pl.read_parquet(campaign / "results.parquet")
    assert rows["interventions"].null_count() == len(rows), "what it shows is the published column"
