"""The blocks of README and docs run as printed, the long ones with smaller values."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import docs_run

PAGES = [p for p in docs_run.pages() if list(docs_run.blocks_of(p))]


def name_of(page: Path) -> str:
    return page.relative_to(docs_run.ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_blocks_of_a_page_run(page: Path, tmp_path: Path) -> None:
    docs_run.prepare(tmp_path)
    for block in docs_run.blocks_of(page):
        if block.is_run:
            docs_run.run_block(block, tmp_path, quick=True)


def test_every_block_of_a_page_ends() -> None:
    """An open block swallows the text behind it, as it did with three sections of channels.md."""
    for page in docs_run.pages():
        fences = re.findall(r"^```", page.read_text(encoding="utf-8"), re.MULTILINE)
        assert len(fences) % 2 == 0, page.name


def test_a_block_without_a_language_holds_no_command() -> None:
    """Else it would be run by nobody."""
    for page in docs_run.pages():
        text = page.read_text(encoding="utf-8")
        for line, above in zip(text.splitlines()[1:], text.splitlines(), strict=False):
            if above.strip() in ("```", "```sh", "```bash"):
                assert not line.startswith(("skidpad ", "$ ")), f"{page.name}: {line}"


def block(text: str, word: str | None = None, note: str = "") -> docs_run.Block:
    return docs_run.Block("a.md", 1, "console", text, word, note)


def test_commands_go_on_and_what_is_printed_stands_apart() -> None:
    script, printed = docs_run.split_console("$ a \\\n  b\nsaid\n$ pip install x\n$ c\n")
    assert script == "a \\\n  b\nc"
    assert printed == ["said"]


def test_a_smaller_value_must_be_in_the_block() -> None:
    assert block("$ a --n 9\n", "quick", "--n 9 => --n 1").script(quick=True)[0] == "a --n 1"
    assert block("$ a --n 9\n", "quick", "--n 9 => --n 1").script(quick=False)[0] == "a --n 9"
    with pytest.raises(ValueError, match="no '--m 9' to change"):
        block("$ a --n 9\n", "quick", "--m 9 => --m 1").script(quick=True)


def test_a_block_with_a_title_is_a_file(tmp_path: Path) -> None:
    page = docs_run.ROOT / "docs" / "tutorials" / "own-scenario.md"
    (scenario,) = (b for b in docs_run.blocks_of(page) if b.title)
    assert docs_run.run_block(scenario, tmp_path, quick=True) == 0.0
    assert (tmp_path / "cut_in.xosc").read_text().startswith("<?xml")


@pytest.mark.parametrize("text", ["$ false\n", "$ echo a\nb\n"])
def test_a_block_that_does_otherwise_fails(text: str, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=r"a\.md, block 1"):
        docs_run.run_block(block(text), tmp_path, quick=True)


def test_what_a_block_leaves_running_is_ended(tmp_path: Path) -> None:
    docs_run.run_block(block("$ (sleep 3; touch late) &\n"), tmp_path, quick=True)
    assert not (tmp_path / "late").exists()
