"""Ids of decisions, requirements and findings: where they are listed, and whether a text explains them."""

from __future__ import annotations

import csv
import re
from html import unescape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DECISIONS = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
DECISION = re.compile(r"\b[XLMGCKRT]-[1-9]\d?\b|\bB?D-\d{2,3}\b|\bDC-\d{2}\b")
REQUIREMENT = re.compile(r"\b[ABC]-\d{3}\b")
FINDING = re.compile(r"\b[BC]?F-\d{2}[a-z]{0,2}\b")
ID = re.compile(r"\b(?:[A-DFGKLMRTX]|BD|DC|BF|CF)-\d{1,3}[a-z]{0,2}\b")
CODE = re.compile(r"`[^`]*`")  # commands, where an id is an argument
PAGES = ("docs/results/claims.md", "docs/decisions.md", "docs/requirements.md")
WORD = re.compile(r"[A-Za-z]{2,}")


def bare_ids(text: str) -> list[str]:
    """Returns the ids in a text that neither stand in brackets behind words nor before them.

    A text that names the page where its ids are explained has none.
    """
    text = CODE.sub("", text)
    if any(page in text for page in PAGES):
        return []
    return [m[0] for m in ID.finditer(text) if not is_told(text, m)]


def is_told(text: str, found: re.Match[str]) -> bool:
    """Tells whether an id stands in brackets behind three words, or right before three of them."""
    before, after = text[: found.start()], text[found.end() :]
    opened = before.rfind("(")
    if opened > before.rfind(")") and ")" in after:
        return len(WORD.findall(ID.sub("", before[:opened]))) >= 3
    said = re.match(r"[:,] (.*)", after, re.DOTALL)
    return said is not None and len(WORD.findall(ID.sub("", said[1]))) >= 3


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


CUT = re.compile(r"<(script|style|svg)\b.*?</\1>", re.DOTALL)
LINK = re.compile(r"<a\b[^>]*>.*?</a>", re.DOTALL)
CELLS = re.compile(r"</(?:td|th|dt)>\s*<(?:td|th|dd)\b[^>]*>")
STAMP = re.compile(
    r'</code><span class="stamp">[^<]*</span></header><h4>'
)  # a verdict before its claim
INLINE = re.compile(r"</?(?:b|i|em|strong|span|small|code|sub|sup)\b[^>]*>")
COMMAND = re.compile(r"<code\b[^>]*>skidpad [^<]*</code>")  # where an id is an argument
TAG = re.compile(r"<[^>]+>")


def texts_of(page: str) -> list[str]:
    """Returns the texts of an HTML page by block; cells of a row are one text, links are left out."""
    page = STAMP.sub(": ", LINK.sub(" ", CUT.sub(" ", page)))
    page = INLINE.sub("", CELLS.sub(": ", COMMAND.sub(" ", page)))
    return [text for part in TAG.split(page) if (text := " ".join(unescape(part).split()))]


def texts_in_script(page: str) -> list[str]:
    """Returns the texts in the script of a NiceGUI page, as JSON; paths of SVG have no words."""
    return [text for text in page.split('"') if " " in text and WORD.search(text)]


def listed_ids() -> set[str]:
    """Returns every id that a page explains."""
    return listed_decisions() | listed_requirements() | listed_findings()


def check_ids(texts: list[str]) -> None:
    """Asserts that every id in the texts stands beside its sentence, and that a page explains it."""
    assert sum(map(len, texts)) > 100
    bare = {text: ids for text in texts if (ids := bare_ids(text))}
    assert bare == {}, bare
    assert {m for text in texts for m in ID.findall(text)} <= listed_ids()
