"""No list of words is typed twice: options name the enum that the program itself works with."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "skidpad"
# two settings of which both are ideal or measured, each with a meaning of its own
ALIKE = {frozenset({"ideal", "wheel_speeds"})}


def find_words(text: str) -> dict[str, frozenset[str]]:
    """Returns the words of each enum of a module by its name, without enums of numbers."""
    found = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ClassDef) and any("Enum" in ast.unparse(b) for b in node.bases):
            values = [s.value for s in node.body if isinstance(s, ast.Assign)]
            words = [v.value for v in values if isinstance(v, ast.Constant)]
            if words and all(isinstance(word, str) for word in words):
                found[node.name] = frozenset(words)
    return found


def test_no_two_enums_hold_the_same_words() -> None:
    places: defaultdict[frozenset[str], list[str]] = defaultdict(list)
    for path in PACKAGE.rglob("*.py"):
        for name, words in find_words(path.read_text(encoding="utf-8")).items():
            places[words].append(f"{path.relative_to(PACKAGE)}: {name}")
    assert len(places) > 40
    twice = {words: where for words, where in places.items() if len(where) > 1}
    assert set(twice) == ALIKE, twice


def test_the_words_of_options_load_nothing_heavy() -> None:
    """The modules of commands that name such an enum are imported for every help text."""
    modules = (
        "cli.channels.monitor",
        "cli.channels.hazards",
        "cli.runs.export",
        "cli.runs.compare",
    )
    imports = "; ".join(f"import skidpad.{name}" for name in modules)
    heavy = "('numpy', 'numba', 'polars', 'scipy')"
    code = f"import sys; {imports}; print([m for m in {heavy} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"
