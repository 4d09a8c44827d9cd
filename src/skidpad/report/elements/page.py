"""The self-contained HTML page: blocks in, one file out. It knows no metric and no campaign."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2
import msgspec
from markupsafe import Markup, escape

from skidpad.recording.files import write_bytes

REPORT = "report.html"
_CODE_OR_QUANTITY = re.compile(r"(?P<code>`[^`]+`)|(?<=\d) (?=(?:%|km/h|km|mm|m|s)(?!\w))")


@dataclass(frozen=True, slots=True)
class Cell:
    """A table cell: what is shown, what it sorts by, how it is marked and explained."""

    text: str
    sort: float | str | None = None
    note: str = ""  # small lines below, such as an interval
    heat: float | None = None  # 0..1, shade of the background
    kind: str = ""  # "good", "bad", "muted", "published"
    href: str = ""
    hint: str = ""  # shown on hover and read by screen readers
    limits: tuple[float, float] | None = None  # of the interval that the note tells
    published: float | None = None  # value of the source, told in the note too


@dataclass(frozen=True, slots=True)
class Table:
    """A sortable table. Columns are (heading, hint)."""

    columns: Sequence[tuple[str, str]]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    note: str = ""
    sortable: bool = True
    folded: bool = False  # away until asked for, under its caption
    kind: str = "table"

    def csv(self) -> str:
        """Returns the table as CSV; beside a column with intervals or published values, columns of those."""
        columns = [
            (heading, [row[k] for row in self.rows]) for k, (heading, _) in enumerate(self.columns)
        ]
        out = io.StringIO()
        rows = zip(*(part for column in columns for part in _csv_columns(*column)), strict=True)
        csv.writer(out).writerows(rows)
        return out.getvalue()

    def file_name(self) -> str:
        """Returns the file name of the table's CSV, made of its caption, or table.csv."""
        return (anchor(self.caption) or "table") + ".csv"

    def csv_uri(self) -> str:
        """Returns the CSV as a data URI, the target of a link."""
        return "data:text/csv;charset=utf-8," + quote(self.csv())


def _csv_columns(heading: str, cells: Sequence[Cell]) -> Iterator[list[Any]]:
    """Yields the CSV columns of a table column, heading first: values, then limits and published."""
    numeric = any(c.sort is not None for c in cells)
    yield [heading, *(c.sort if numeric else c.text for c in cells)]
    if any(c.limits for c in cells):
        for end, name in enumerate(("low", "high")):
            yield [f"{heading}: {name}", *(c.limits[end] if c.limits else None for c in cells)]
    if any(c.published is not None for c in cells):
        yield [f"{heading}: published", *(c.published for c in cells)]


@dataclass(frozen=True, slots=True)
class Figure:
    """An inline SVG with its caption."""

    svg: str
    caption: str
    kind: str = "figure"


@dataclass(frozen=True, slots=True)
class Text:
    """Paragraphs of plain text; blank lines part them."""

    text: str
    tone: str = ""  # "lead", "warning", "note"
    kind: str = "text"


@dataclass(frozen=True, slots=True)
class Answer:
    """A question with the sentence that answers it, what follows from it, and a picture."""

    question: str
    sentence: str
    lines: Sequence[str] = ()
    figure: Figure | None = None


@dataclass(frozen=True, slots=True)
class Answers:
    """What a reader asks first."""

    items: Sequence[Answer]
    kind: str = "answers"


@dataclass(frozen=True, slots=True)
class Number:
    """A headline number with its meaning."""

    value: str
    label: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class Numbers:
    """A row of headline numbers."""

    items: Sequence[Number]
    kind: str = "numbers"


@dataclass(frozen=True, slots=True)
class Verdict:
    """A claim and what the data say of it in one plain sentence; the numbers are folded away."""

    id: str
    claim: str
    verdict: str
    plain: str
    numbers: str
    detail: str = ""
    kind: str = "verdict"


@dataclass(frozen=True, slots=True)
class Image:
    """A picture as a data URI."""

    uri: str
    caption: str


@dataclass(frozen=True, slots=True)
class Event:
    """One line of a card's timeline."""

    time: str
    text: str
    is_wrong: bool = False  # what was measured and what was true differ


@dataclass(frozen=True, slots=True)
class Card:
    """One crash or run: its cause in a sentence, facts, timeline, pictures, replay, charts."""

    title: str
    subtitle: str = ""
    cause: str = ""  # one sentence that is read first
    tags: Sequence[str] = ()
    facts: Sequence[tuple[str, str]] = ()
    chain: Sequence[str] = ()
    events: Sequence[Event] = ()  # in order of time
    images: Sequence[Image] = ()
    replay: Any = None  # see assets/replay.js for its shape
    worlds: Any = None  # see assets/worlds.js
    charts: Sequence[Figure] = ()
    id: str = ""  # for links to it
    kind: str = "card"


@dataclass(frozen=True, slots=True)
class Cards:
    """Several cards under one heading, folded away until asked for."""

    title: str
    cards: Sequence[Card]
    open: bool = False
    link: str = ""  # where there is more, called `note`
    note: str = ""
    kind: str = "cards"


@dataclass(frozen=True, slots=True)
class Montage:
    """Many small pictures side by side, folded away until asked for."""

    title: str
    images: Sequence[Image]
    kind: str = "montage"


@dataclass(frozen=True, slots=True)
class Definitions:
    """Terms and what they mean."""

    items: Sequence[tuple[str, str, str]]  # name, unit, definition
    kind: str = "definitions"  # folded away until asked for


@dataclass(frozen=True, slots=True)
class Node:
    """A claim in a tree, with what stands for and against it."""

    title: str
    state: str = ""  # "supported", "challenged", "no evidence", or empty
    text: str = ""
    lines: Sequence[str] = ()
    children: Sequence[Node] = ()
    open: bool = True


@dataclass(frozen=True, slots=True)
class Tree:
    """Claims that rest on claims."""

    root: Node
    kind: str = "tree"


@dataclass(frozen=True, slots=True)
class Code:
    """Text as it stands in a file."""

    title: str
    text: str
    kind: str = "code"


Block = (
    Answers
    | Table
    | Figure
    | Text
    | Numbers
    | Verdict
    | Cards
    | Card
    | Montage
    | Definitions
    | Code
    | Tree
)


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page with an entry in its table of contents."""

    title: str
    blocks: Sequence[Block]
    id: str = ""

    @property
    def anchor(self) -> str:
        """Returns the section's identifier for links: its id, else made of its title."""
        return self.id or anchor(self.title)


@dataclass(frozen=True, slots=True)
class Page:
    """A report as a sequence of sections."""

    title: str
    subtitle: str
    sections: Sequence[Section]
    facts: Sequence[tuple[str, str]] = field(default=())  # seeds, versions, hashes


def render(page: Page) -> str:
    """Returns the page as one HTML document that needs no network; empty sections are left out."""
    return _template().render(
        page=page,
        sections=[s for s in page.sections if s.blocks],
        css=_asset("page.css"),
        script="".join(_asset(name) for name in ("page.js", "replay.js", "worlds.js")),
    )


def words(name: str) -> str:
    """Returns an identifier as it is read, with spaces for underscores."""
    return name.replace("_", " ")


def anchor(text: str) -> str:
    """Returns text as name of a place or file: lower case, "-" for all but letters and digits."""
    return "".join(c if c.isalnum() else "-" for c in text.lower()).strip("-")


def write_report_page(page: Page, folder: Path) -> Path:
    """Writes the page to report.html in `folder` and returns its path."""
    path = folder / REPORT
    write_page(page, path)
    return path


def write_page(page: Page, path: Path) -> None:
    """Writes the page to `path`; an earlier one is replaced only by a complete one."""
    write_bytes(path, render(page).encode("utf-8", "backslashreplace"))


def _asset(name: str) -> str:
    """Returns the text of a file in the report's assets."""
    return files("skidpad.report").joinpath("assets").joinpath(name).read_text(encoding="utf-8")


def _prose(text: str) -> Markup:
    """Returns escaped text as HTML in which what stands between backticks is code."""
    found = re.sub(
        r"`(--[^`]{,20})`", r'<code class="option">\1</code>', str(escape(_join_units(text)))
    )
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", found))


def _join_units(value: Any) -> Any:
    """Returns plain text with no-break spaces between numbers and units, but in code; else the value."""
    if type(value) is not str:
        return value  # a number, or markup such as a drawing
    return _CODE_OR_QUANTITY.sub(lambda m: m[0] if m["code"] else "\u00a0", value)


@cache
def _template() -> jinja2.Template:
    """Returns the HTML template of a page, with escaping on and strict about names."""
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_join_units,
    )
    environment.filters["prose"] = _prose
    environment.policies["json.dumps_function"] = lambda value, **_: msgspec.json.encode(
        value
    ).decode()
    return environment.from_string(_asset("page.html.j2"))
