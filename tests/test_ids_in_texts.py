"""No text that users read names a decision, requirement or finding without saying what it is."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.main import get_command

from docs_hooks import ROOT, _leaves
from skidpad.cli.main import app
from skidpad.core.settings.parts import PARTS
from skidpad.core.settings.setting import describe_settings
from support.ids import ID, bare_ids

SOURCE = ROOT / "src" / "skidpad"
REPORTS = ("report", "cockpit", "pages", "fleet", "search", "cli/output", "live")


@pytest.mark.parametrize(
    ("text", "bare"),
    [
        ("deviation of the steering command (B-144)", []),
        ("recoveries, wrong ways and departures (A-247, R-6)", []),
        ("F-08: rain slows the stack down", []),
        ("`skidpad study A-278` drives both here.", []),
        ("F-08, F-17 or noise.", ["F-08", "F-17"]),
        ("as T-3 asks", ["T-3"]),
        ("speed (A-247)", ["A-247"]),
        ("F-08 and others: docs/results/claims.md", []),
    ],
)
def test_the_rule(text: str, bare: list[str]) -> None:
    assert bare_ids(text) == bare


def test_help_says_what_its_ids_are() -> None:
    root = get_command(app)
    context = root.context_class(root, info_name="skidpad")
    texts = {}
    for path, command in _leaves(root, context, ("skidpad",)):
        texts[path] = command.help or ""
        texts |= {f"{path} {p.name}": getattr(p, "help", None) or "" for p in command.params}
    assert len(texts) > 300
    assert {name: ids for name, text in texts.items() if (ids := bare_ids(text))} == {}


def test_settings_have_a_text_beside_their_source() -> None:
    """Pages and `skidpad profiles show` write the source before the text."""
    for kind in PARTS.values():
        for name, one in describe_settings(kind).items():
            assert bare_ids(f"{one.source}: {one.text}") == [], name


def texts_in(paths: list[Path], raised: bool) -> Iterator[tuple[str, str]]:
    """Yields the texts of program code with their places; raised: those of errors alone."""
    for path in paths:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        said = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}  # docstrings
        roots = [n for n in ast.walk(tree) if isinstance(n, ast.Raise)] if raised else [tree]
        joined = {id(v) for n in ast.walk(tree) if isinstance(n, ast.JoinedStr) for v in n.values}
        for root in roots:
            for node in ast.walk(root):
                place = f"{path.relative_to(SOURCE)}:{getattr(node, 'lineno', 0)}"
                if isinstance(node, ast.JoinedStr):
                    parts = (getattr(v, "value", "") for v in node.values)
                    yield place, "".join(p if isinstance(p, str) else "x" for p in parts)
                elif (
                    isinstance(node, ast.Constant)
                    and isinstance(node.value, str)
                    and id(node) not in said | joined
                    and not ID.fullmatch(node.value)
                ):
                    yield place, node.value


def test_errors_say_what_their_ids_are() -> None:
    texts = list(texts_in(sorted(SOURCE.rglob("*.py")), raised=True))
    assert len(texts) > 500
    assert {place: ids for place, text in texts if (ids := bare_ids(text))} == {}


def test_reports_and_pages_say_what_their_ids_are() -> None:
    paths = [p for part in REPORTS for p in sorted((SOURCE / part).rglob("*.py"))]
    texts = list(texts_in(paths, raised=False))
    for kind in ("*.j2", "*.js"):
        texts += [(p.name, p.read_text("utf-8")) for p in sorted(SOURCE.rglob(kind))]
    assert len(texts) > 2000
    assert {place: ids for place, text in texts if (ids := bare_ids(text))} == {}
