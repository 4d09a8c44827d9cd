"""Which versions are tried beside those that tests run with."""

from __future__ import annotations

import re
from pathlib import Path

import versions_check

PROJECT = (Path(__file__).resolve().parents[2] / "pyproject.toml").read_text(encoding="utf-8")


def test_every_dependency_is_tried_with_the_least_version_that_it_allows():
    pinned = versions_check.oldest_versions(PROJECT)
    (block,) = re.findall(r"^dependencies = \[\n(.*?)^\]", PROJECT, re.DOTALL | re.MULTILINE)
    assert len(pinned) == len(block.strip().splitlines()) >= 19
    assert "numpy==1.26" in pinned
    assert versions_check.oldest_versions('dependencies = [\n    "a-b>=1.2.3",\n]\n') == [
        "a-b==1.2.3"
    ]


def test_pythons_are_those_that_the_project_takes_the_oldest_first():
    low, high = re.search(r'requires-python = ">=3\.(\d+),<3\.(\d+)"', PROJECT).groups()
    assert tuple(range(int(low), int(high))) == versions_check.MINORS
    found = versions_check.pythons()
    assert found
    order = [int(re.search(r"3\.(\d+)", python).group(1)) for python in found]
    assert order == sorted(set(order))


def test_ci_tries_both():
    root = Path(__file__).resolve().parents[2]
    assert "make versions-check" in (root / ".ci" / "run").read_text(encoding="utf-8")
