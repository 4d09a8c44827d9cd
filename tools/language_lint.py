"""Counts breaches of the language rules in `src`, README and `docs`, and lets no count grow.

    python tools/language_lint.py            the counts; exit status 1 when one is above its limit
    python tools/language_lint.py --list     every breach with its place
    python tools/language_lint.py --write    lower the limits to today's counts

The limits stand in `tools/language_limits.json`. They are the debt of names and sentences that were
written before the rules; a change may pay some of it back and may not add to it.
"""

from __future__ import annotations

import ast
import io
import json
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "skidpad"
LIMITS = Path(__file__).with_name("language_limits.json")
PARTICIPLE = "function named by a bare participle"
PERSON = "part of the program spoken of as a person"
THEATRE = "word of theatre or masonry in a name"
SHORT = "first docstring line of four words or fewer"
PAGE = "word for a person on a page of docs or in README"
RULES = (PARTICIPLE, PERSON, THEATRE, SHORT, PAGE)

_IRREGULAR = (
    "asked begun bound bought broken brought built caught chosen come cut done drawn driven fed felt "
    "fit flown found given gone grown heard held hidden kept known laid led left lent lost made meant "
    "met paid put said seen sent set shown shut spent split spoken spread struck sunk swept taken told "
    "thrown torn understood woken won worn written"
)  # fmt: skip
IRREGULAR = frozenset(re.findall(r"\w+", _IRREGULAR))
NOT_PARTICIPLES = frozenset({"bed", "embed", "exceed", "feed", "need", "seed", "speed", "shed"})
EXCEPTIONS = {  # names that read like a breach and are none, each with its reason
    "left": "a direction, beside `right`",
    "put": "the verb, as in `Queue.put`",
    "fit": "the verb, as in scikit-learn",
    "cut": "the verb",
}
PERSONS = re.compile(r"\b(who|whoever|somebody|nobody|anybody)\b", re.IGNORECASE)
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.DOTALL | re.MULTILINE)
THEATRE_WORDS = frozenset(
    {
        "cast",
        "crew",
        "crowd",
        "desk",
        "house",
        "player",
        "room",
        "stage",
        "studio",
        "telling",
        "troupe",
    }
)


class Breach(NamedTuple):
    """One place that breaks a rule."""

    rule: str
    line: int
    text: str


def find_breaches(source: str) -> Iterator[Breach]:
    """Yields every breach in the text of a module."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield from _in_definition(node)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and PERSONS.search(token.string):
            yield Breach(PERSON, token.start[0], token.string.strip())
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Module)):
            text = ast.get_docstring(node) or ""
            for match in PERSONS.finditer(text):
                line = getattr(node, "lineno", 1)
                yield Breach(PERSON, line, text[max(match.start() - 30, 0) : match.end() + 30])


def _in_definition(node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> Iterator[Breach]:
    words: list[str] = re.findall(r"[A-Z]?[a-z]+", node.name)
    if not isinstance(node, ast.ClassDef) and len(words) == 1 and _is_participle(words[0]):
        yield Breach(PARTICIPLE, node.lineno, node.name)
    if THEATRE_WORDS & {w.lower() for w in words}:
        yield Breach(THEATRE, node.lineno, node.name)
    first = (ast.get_docstring(node) or "").split("\n")[0]
    if not node.name.startswith("_") and first and len(first.split()) <= 4:
        yield Breach(SHORT, node.lineno, f"{node.name}: {first}")


def _is_participle(word: str) -> bool:
    if word in EXCEPTIONS:
        return False
    regular = word.endswith("ed") and len(word) > 4 and word not in NOT_PARTICIPLES
    return regular or word in IRREGULAR


def find_page_breaches(text: str) -> Iterator[Breach]:
    """Yields every banned word in the prose and tables of a page; code is left out."""
    text = CODE.sub(lambda code: "\n" * code[0].count("\n"), text)
    for number, line in enumerate(text.splitlines(), 1):
        for match in PERSONS.finditer(line):
            yield Breach(PAGE, number, line[max(match.start() - 30, 0) : match.end() + 30])


def all_breaches() -> Iterator[tuple[Path, Breach]]:
    """Yields every breach in the code, then in README and the pages of `docs`, with its file."""
    for path in sorted(SOURCE.rglob("*.py")):
        if not path.name.endswith("_pb2.py"):
            for breach in find_breaches(path.read_text(encoding="utf-8")):
                yield path, breach
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for breach in find_page_breaches(path.read_text(encoding="utf-8")):
            yield path, breach


def main(arguments: list[str]) -> int:
    """Prints the counts beside their limits. Returns 1 when one is above its limit."""
    counts = dict.fromkeys(RULES, 0)
    for path, breach in all_breaches():
        counts[breach.rule] += 1
        if "--list" in arguments:
            print(f"{path.relative_to(ROOT)}:{breach.line}: {breach.rule}: {breach.text!r}")
    if "--write" in arguments:
        LIMITS.write_text(json.dumps(counts, indent=2) + "\n", encoding="utf-8")
    limits: dict[str, int] = json.loads(LIMITS.read_text(encoding="utf-8"))
    over = [rule for rule in RULES if counts[rule] > limits[rule]]
    for rule in RULES:
        print(f"{counts[rule]:5} of at most {limits[rule]:5}  {rule}")
    for rule in over:
        print(f"language: '{rule}' grew; see --list, and the glossary for the field's words")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
