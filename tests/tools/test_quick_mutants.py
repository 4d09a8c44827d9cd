"""The mutants that quick tests notice: drawn, applied, judged and counted on a small tree."""

from __future__ import annotations

import ast
from textwrap import dedent

import pytest

import quick_mutants
from mutants import find_mutants

SOURCE = dedent('''
    """A text of 2 words."""

    from numba import kernel

    LIMIT: int = 3


    def clip(x: int, least: int = 0) -> int:
        """Returns x < 3 cut off."""
        if x < LIMIT and not x == 1:
            print(f"{x + 1}")
            return x * 2
        raise ValueError("é")


    @kernel
    def compiled(x):
        return x + 1
''')


def test_each_change_is_a_module_that_differs_in_one_place():
    found = find_mutants(SOURCE)
    changes = {(m.old, m.new) for m in found}
    assert ("x < LIMIT", "(x <= LIMIT)") in changes
    assert ("x == 1", "(x != 1)") in changes
    assert ("not x == 1", "(x == 1)") in changes
    assert ("return x * 2", "return None") in changes
    assert ('raise ValueError("é")', "pass") in changes
    whole = ast.dump(ast.parse(SOURCE))
    for mutant in found:
        assert ast.dump(ast.parse(mutant.apply(SOURCE))) != whole


def test_texts_declarations_and_kernels_are_left_alone():
    olds = {m.old for m in find_mutants(SOURCE)}
    lines = {m.line for m in find_mutants(SOURCE)}
    assert "x + 1" not in olds  # within a text, and in a kernel
    assert lines == {11, 12, 13, 14}


@pytest.fixture
def tree(tmp_path):
    """A project with one package, a quick test, a slow one, and one that fails without any change."""
    package = tmp_path / "src" / "skidpad" / "roads"
    package.mkdir(parents=True)
    for name in ("__init__.py", "pytest_plugin.py"):  # pytest loads this one where it is installed
        (package.parent / name).write_text("")
    (package / "__init__.py").write_text("")
    (package / "width.py").write_text(
        "def widen(x):\n    return x + 1\n\n\ndef narrow(x):\n    return x - 1\n\n\n"
        "def idle():\n    return 5\n"
    )
    tests = tmp_path / "tests" / "roads"
    tests.mkdir(parents=True)
    (tests / "test_width.py").write_text(
        dedent("""
            import pytest

            from skidpad.roads.width import narrow, widen


            def test_broken():
                assert False


            def test_widen():
                assert widen(1) == 2


            @pytest.mark.slow
            def test_narrow():
                assert narrow(1) == 0
        """)
    )
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow: takes long\n")
    (tmp_path / "conftest.py").write_text(
        "from hypothesis import settings\nsettings.register_profile('quick')\n"
    )
    (tmp_path / "tools").mkdir()
    for name in ("quick_mutants.py", "mutants.py", "dated_lines.py", "nightly.py"):
        (tmp_path / "tools" / name).write_text((quick_mutants.ROOT / "tools" / name).read_text())
    return tmp_path


def test_a_mutant_is_noticed_by_the_quick_tests_by_the_slow_ones_or_by_none(tree):
    file = tree / "src" / "skidpad" / "roads" / "width.py"
    text = file.read_text()
    by_line = {m.line: m for m in find_mutants(text) if not m.new.startswith("return")}
    found = {line: quick_mutants.judge(tree, "roads", file, m) for line, m in by_line.items()}
    test = "tests/roads/test_width.py::test_"
    assert found[2] == {"quick": f"{test}widen", "slow": ""}
    assert found[6] == {"quick": "", "slow": f"{test}narrow"}
    assert found[10] == {"quick": "", "slow": ""}
    assert file.read_text() == text


def test_the_share_counts_what_any_test_noticed():
    made = {"when": "2026-01-02T00:00:00", "commit": "abc"}
    judged = [
        {"package": "core", "quick": "tests/a", "slow": ""} | made,
        {"package": "core", "quick": "limit", "slow": "tests/a"} | made,
        {"package": "core", "quick": "", "slow": "limit"} | made,
        {"package": "roads", "quick": "", "slow": ""} | made,
    ]
    rows = {
        r["package"]: (r["mutants"], r["quick"], r["full"], r["share"])
        for r in quick_mutants.make_rows(judged)
    }
    assert rows == {"core": (3, 1, 2, "0.500"), "roads": (1, 0, 0, ""), "all": (4, 1, 2, "0.500")}


def test_draws_are_the_same_each_time_and_touch_no_kernel():
    root = quick_mutants.ROOT
    files = quick_mutants.list_files(root)
    assert len(files) == 20
    assert not any("@kernel" in f.read_text() for every in files.values() for f in every)
    drawn = quick_mutants.draw(root, 1)
    assert drawn == quick_mutants.draw(root, 2)[: len(drawn)]
    assert {package for package, *_ in drawn} == set(files)
