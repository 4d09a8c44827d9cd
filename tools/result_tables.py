"""Writes the tables of results in docs/ from committed results: `make tables`.

A page names a table between `<!-- results: CAMPAIGN TABLE -->` and `<!-- end -->`. What stands there is
made of docs/results/CAMPAIGN/ alone; before a campaign has been driven it says so. A test compares pages
with what this makes. docs/results/claims.md lists every claim with its test and its margin; the
pre-registration names its hash, so that a claim cannot change unseen.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import yaml

import result_envelope
import result_grip
import result_matrix
from result_texts import verdict_rows
from skidpad.evidence.channels.findings import FINDINGS as CHANNELS
from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.grip.findings import FINDINGS as GRIP
from skidpad.evidence.verdicts import Finding, judge

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results"
PLAN = RESULTS / "preregistration.yaml"
CLAIMS = RESULTS / "claims.md"
REFERENCE = "matrix-figure8"  # what others on the same seeds are held against
REMEDIES = "remedy-none"  # what remedies of the same commit are held against
OBJECTS = "objects"  # cells on objects by a campaign's own commit, where the matrix was driven again since
MATRICES = (REFERENCE, "matrix-motorway", "matrix-foreign", "matrix-pixels-two")
PAGES = ("docs/matrix.md", "docs/matrix-tables.md", "docs/grip.md", "docs/envelope-proof.md")
BLOCK = re.compile(r"(<!-- results: (\S+) (\S+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def plan() -> dict[str, Any]:
    """The pre-registration."""
    found: dict[str, Any] = yaml.safe_load(PLAN.read_text(encoding="utf-8"))
    return found


def command_of(name: str) -> list[str]:
    """The command of a campaign, in words."""
    return shlex.split(next(c["command"] for c in plan()["campaigns"] if c["name"] == name))


def claims_page() -> str:
    """Every claim, how it is tested, and its margin."""
    parts = (
        ("Driver assistance in weather", (*FINDINGS, *ACCEPTANCE)),
        ("Grip in weather", GRIP),
        ("Channels", CHANNELS),
    )
    text = (
        "# Claims\n\nWritten by `make tables` from `evidence/`. The hash of this page stands in "
        "`preregistration.yaml`.\n"
    )
    for title, findings in parts:
        text += f"\n## {title}\n| id | claim | estimand | test | margin | nature |\n"
        text += "|---|---|---|---|---|---|\n"
        text += "".join(_claim_row(f) for f in findings)
    return text


def _claim_row(f: Finding) -> str:
    cells = (f.id, f.claim, f.estimand, f.test, f.margin, f.nature)
    return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |\n"


def claims_hash() -> str:
    """SHA-256 of the page of claims."""
    return hashlib.sha256(claims_page().encode()).hexdigest()


def tables_in(text: str, folder: Path = RESULTS) -> str:
    """A page with its blocks written anew."""

    def fill(match: re.Match[str]) -> str:
        opening, name, which, _, closing = match.groups()
        return f"{opening}{block(name, which, folder / name)}{closing}"

    return BLOCK.sub(fill, text)


def block(name: str, which: str, folder: Path) -> str:
    """One table, or why there is none."""
    words = command_of(name)
    if not folder.is_dir():
        return f"Not driven yet: `skidpad {shlex.join(words)}`\n"
    tables: dict[str, Callable[[Path], str]] = {
        "adas headline": result_matrix.headline,
        "adas fatal": lambda path: result_matrix.by_weather(path, "fatal_collisions"),
        "adas vehicles": lambda path: result_matrix.by_weather(path, "crashes_vehicle"),
        "adas factors": result_matrix.factors,
        "adas claims": result_matrix.claims,
        "adas verdicts": lambda path: result_matrix.verdicts(
            [path.with_name(name) for name in MATRICES]
        ),
        "adas against": lambda path: result_matrix.against(reference_of(path), path),
        "adas envelope": result_envelope.rivals,
        "adas goals": result_envelope.goals,
        "adas sum": result_envelope.in_sum,
        "adas worse": result_envelope.worse,
        "adas routes": result_envelope.routes,
        "adas pareto": result_envelope.pareto,
        "grip completion": result_grip.completion,
        "grip claims": result_grip.claims,
        "grip thresholds": result_grip.thresholds,
        "grip threshold-claims": result_grip.threshold_verdicts,
        "grip rain": result_grip.rain_parted,
        "study claims": lambda path: study_claims(path, words[1]),
    }
    return driven(folder) + tables[f"{words[0]} {which}"](folder)


def reference_of(folder: Path) -> Path:
    """What a campaign on the same seeds is held against.

    That is what was kept with it in `objects`, else a remedy's base of the same commit, else the matrix.
    """
    if (folder / OBJECTS).is_dir():
        return folder / OBJECTS
    own, base = folder / "driven.json", folder.with_name(REMEDIES) / "driven.json"
    if not folder.name.startswith("remedy-") or not base.is_file():
        return folder.with_name(REFERENCE)
    commits = {json.loads(path.read_text(encoding="utf-8"))["commit"] for path in (own, base)}
    return folder.with_name(REMEDIES if len(commits) == 1 else REFERENCE)


def driven(folder: Path) -> str:
    """When and by what a campaign was driven."""
    told = json.loads((folder / "driven.json").read_text(encoding="utf-8"))
    on = told.get("fingerprint", "not recorded then")
    return f"Driven {told['date']} at commit {told['commit']}, {told['machine']}, fingerprint {on}.\n\n"


def study_claims(folder: Path, id: str) -> str:
    """The claims of a study."""
    from skidpad.campaign.studies.arms import STUDIES
    from skidpad.campaign.studies.study import BY_ID

    rows = pl.read_csv(folder / "rows.csv", infer_schema_length=None)
    rows = rows.with_columns(pl.col("config", "weather").cast(pl.String))
    claims = [BY_ID[claim] for claim in STUDIES[id].claims]
    return verdict_rows(judge(claims, [rows] * len(claims), astray(rows)))


def main() -> None:
    """Write all pages."""
    CLAIMS.write_text(claims_page(), encoding="utf-8")
    for page in PAGES:
        path = ROOT / page
        path.write_text(tables_in(path.read_text(encoding="utf-8")), encoding="utf-8")
    latest = (plan()["later_changes"] or [{}])[-1].get("claims", plan()["claims"])
    if latest != claims_hash():
        sys.exit(
            f"the claims are not those of {PLAN.name}: add an entry to later_changes with "
            f"claims: {claims_hash()}"
        )


if __name__ == "__main__":
    main()
