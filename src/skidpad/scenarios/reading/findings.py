"""What a scenario file is found to have wrong: every finding with file, line and element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from skidpad.core.errors import FileError


class Kind(str, Enum):
    """How serious a finding is."""

    ERROR = "error"  # cannot mean anything
    UNSUPPORTED = "unsupported"  # sound, but unknown here; `ignore_unsupported` leaves it out
    SCHEMA = "schema"  # the published schema says otherwise, the meaning is clear all the same
    NOTE = "note"  # sound, and without effect here


HARMLESS = frozenset((Kind.SCHEMA, Kind.NOTE))


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing, and where it is."""

    file: str
    line: int
    element: str
    what: str
    kind: Kind = Kind.ERROR

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}, <{self.element}>: {self.what}"


class Fault(FileError):
    """A finding on its way to the list."""

    def __init__(self, finding: Finding) -> None:
        self.finding = finding
        super().__init__(str(finding))


class ScenarioError(FileError):
    """A file that cannot be played; `findings` are all reasons, in the order of lines."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(str(f) for f in findings))
