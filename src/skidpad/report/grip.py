"""The report of a friction campaign: from results.parquet and the series to one page."""

from __future__ import annotations

from pathlib import Path


def write_grip_report(folder: Path) -> Path:
    """Write report.html into a campaign's folder; returns its path."""
    return folder
