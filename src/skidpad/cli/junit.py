"""Verdicts as JUnit XML, for CI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path


def write_junit(path: Path, suite: str, failures: Mapping[str, Sequence[str]]) -> None:
    """One case per name; a sentence for everything that is wrong in it."""
    from lxml import etree

    from skidpad.recording.files import write_bytes

    failed = str(sum(bool(by) for by in failures.values()))
    root = etree.Element("testsuite", name=suite, tests=str(len(failures)), failures=failed)
    for name, by in failures.items():
        kind = suite.replace(" ", ".")
        case = etree.SubElement(root, "testcase", classname=kind, name=name)
        for sentence in by:
            etree.SubElement(case, "failure", message=sentence)
    write_bytes(path, etree.tostring(root, xml_declaration=True, encoding="utf-8"))
