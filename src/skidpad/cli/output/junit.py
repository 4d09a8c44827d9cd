"""Verdicts as JUnit XML, for CI."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from skidpad.evidence.play_verdicts import PlayVerdict

if TYPE_CHECKING:
    from skidpad.report.play.runs import PlayRun

TAGS = {
    PlayVerdict.ERROR: "error",
    PlayVerdict.NOT_JUDGED: "skipped",
    PlayVerdict.VOID: "failure",  # JUnit knows no void, and a run that proves nothing is no pass
}


def write_junit(path: Path, suite: str, failures: Mapping[str, Sequence[str]]) -> None:
    """Writes a JUnit file with one case per name, and a failure for everything that is wrong in it."""
    cases = [(name, [("failure", said) for said in by]) for name, by in failures.items()]
    _write(path, suite, cases)


def write_verdicts(
    path: Path, suite: str, runs: Iterable[PlayRun], rules: Sequence[str] = ()
) -> None:
    """Writes a JUnit file with one case per run and rule that it was judged by.

    rules: those of the user, for runs that were judged by none.
    """
    _write(path, suite, [case for run in runs for case in _cases(run, rules)])


def _cases(run: PlayRun, rules: Sequence[str]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Returns the JUnit cases of a run, one per rule: its name, and tag and text of failures."""
    by_rule = run.judged.failed or dict.fromkeys(rules, "") or {"played": ""}
    tag = TAGS.get(run.verdict)
    if tag is not None:
        said = f"{run.verdict.value}: {'; '.join(run.judged.reasons)}"
        return [(f"{run.name}: {rule}", [(tag, said)]) for rule in by_rule]
    return [
        (f"{run.name}: {rule}", [("failure", said)] if said else [])
        for rule, said in by_rule.items()
    ]


def _write(path: Path, suite: str, cases: Sequence[tuple[str, list[tuple[str, str]]]]) -> None:
    """Writes the cases as one JUnit test suite to the path."""
    from lxml import etree

    from skidpad.recording.files import write_bytes

    kind = suite.replace(" ", ".")
    root = etree.Element("testsuite", name=suite, tests=str(len(cases)))
    for plural, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        n = sum(any(t == tag for t, _ in by) for _, by in cases)
        if n or tag == "failure":
            root.set(plural, str(n))
    for name, by in cases:
        case = etree.SubElement(root, "testcase", classname=kind, name=name)
        for tag, sentence in by:
            etree.SubElement(case, tag, message=sentence)
    write_bytes(path, etree.tostring(root, xml_declaration=True, encoding="utf-8"))
