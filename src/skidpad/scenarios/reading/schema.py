"""Validation by the XML schemas of OpenSCENARIO, as the `scenariogeneration` package installs them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.metadata import distribution
from pathlib import Path

from lxml import etree

from skidpad.scenarios.reading.findings import Finding, Kind

FILES = {  # by minor revision; 0.9 has no schema that its files follow
    "0": "OpenSCENARIO_1_0.xsd",
    "1": "OpenSCENARIO_1_1.xsd",
    "2": "OpenSCENARIO_1_2.xsd",
    "3": "OpenSCENARIO_1_3_1.xsd",
}
INSTALLER = "scenariogeneration"


def schema_file(minor: str) -> Path:
    """Returns the path of the installed schema of OpenSCENARIO 1.`minor`."""
    installed = distribution(INSTALLER)
    found = next(f for f in installed.files or () if Path(f).name == FILES[minor])
    return Path(str(installed.locate_file(found)))


@cache
def schema(minor: str) -> etree.XMLSchema | None:
    """Returns the schema of OpenSCENARIO 1.`minor`, ready to validate; None where there is none."""
    return etree.XMLSchema(etree.parse(str(schema_file(minor)))) if minor in FILES else None


def violations(root: etree._Element, file: str, minor: str) -> list[Finding]:
    """Returns what the schema has against a document; [] where there is no schema.

    file: its name, for the findings.
    """
    rules = schema(minor)
    if rules is None or rules.validate(root):
        return []
    messages: Iterable[etree._LogEntry] = rules.error_log  # type: ignore[assignment]
    return [
        Finding(file, int(e.line), _element(e.message), e.message, Kind.SCHEMA) for e in messages
    ]


def _element(message: str) -> str:
    """Returns the first quoted word of a message, its element; "OpenSCENARIO" where there is none."""
    parts = message.split("'")
    return parts[1] if len(parts) > 1 else "OpenSCENARIO"
