"""The list of slow tests names tests that there are."""

from __future__ import annotations

import re
from pathlib import Path

from support.slow_tests import SlowTests, function_of, is_slow, slow_functions

TESTS = Path(__file__).parent


def test_parameters_and_the_folder_do_not_matter() -> None:
    assert function_of("tests/roads/test_maps.py::test_a[x::y]") == "roads/test_maps.py::test_a"
    assert not is_slow("tests/test_slow_tests.py::test_parameters_and_the_folder_do_not_matter")


def test_every_slow_test_exists() -> None:
    for name in slow_functions():
        file, function = name.split("::")[0], name.split("::")[-1]
        text = (TESTS / file).read_text(encoding="utf-8")
        assert re.search(rf"def {function}\b", text), name


def test_only_what_takes_long_is_written(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("support.slow_tests.LIST", tmp_path / "slow_tests.txt")
    seen = SlowTests()
    for nodeid, seconds in (("a.py::t[1]", 1.5), ("a.py::t[2]", 1.0), ("b.py::u", 0.5)):
        seen.pytest_runtest_logreport(type("Report", (), {"nodeid": nodeid, "duration": seconds}))
    seen.pytest_sessionfinish()
    text = (tmp_path / "slow_tests.txt").read_text()
    assert text.splitlines()[1:] == ["2.5 a.py::t"]
