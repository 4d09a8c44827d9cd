"""The report of a matrix campaign: from results.parquet and the run folders to one page."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import polars as pl

from skidpad import __version__
from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS
from skidpad.evidence.verdicts import judge
from skidpad.recording.files import read_parquet
from skidpad.recording.ledger import CAMPAIGN, fingerprints, latest, read_ledger
from skidpad.recording.results import TIMING, definitions, results_hash
from skidpad.report import matrix_figures, matrix_tables
from skidpad.report.crashes import crash_sections
from skidpad.report.matrix_data import FAILED, Matrix, load_matrix
from skidpad.report.page import (
    Block,
    Code,
    Definitions,
    Number,
    Numbers,
    Page,
    Section,
    Text,
    write_page,
)
from skidpad.report.verdicts import verdict_blocks

REPORT = "report.html"
LEAD = """Each row below is a set of driving functions, each column a weather. A cell was driven with \
every seed; seeds are common to all cells, so differences between cells are paired. A fatal collision \
is a contact that started the recovery supervisor, or a wrong-way correction.

Intervals are 95 %: exact Poisson for counts, or a bootstrap over runs where counts vary more than \
Poisson or there are ten or more seeds. Published numbers stand beside ours in italics. They come from \
one run per cell on another simulator and another map: they are there to compare, and nothing here was \
tuned to meet them."""


def write_report(folder: Path) -> Path:
    """Write report.html into a campaign's folder; returns its path."""
    matrix = load_matrix(folder)
    path = folder / REPORT
    write_page(build_page(matrix, folder), path)
    return path


def build_page(matrix: Matrix, folder: Path) -> Page:
    """All sections in the order in which a reader asks."""
    crashes = crash_sections(matrix, folder)
    sections = [
        Section("What happened", [*_warnings(matrix), _headline(matrix), Text(LEAD)]),
        Section("Collisions", matrix_tables.collisions(matrix) + matrix_figures.collisions(matrix)),
        Section("Findings of the sources, judged", _verdicts(matrix)),
        Section(
            "Lane keeping and perception",
            matrix_tables.others(matrix) + matrix_figures.others(matrix),
        ),
        Section("One step at a time", matrix_tables.pairs(matrix)),
        Section("Every crash", crashes),
        Section("All metrics", matrix_tables.per_weather(matrix)),
        Section("Definitions", [_definitions()]),
        Section("Configuration and versions", _provenance(matrix, folder)),
    ]
    return Page(
        title="Driver assistance in weather",
        subtitle=matrix.subtitle,
        facts=matrix.facts(),
        sections=[s for s in sections if s.blocks],
    )


def _warnings(matrix: Matrix) -> list[Block]:
    blocks: list[Block] = []
    failed = matrix.results.filter(pl.col("outcome").is_in(FAILED))
    if len(failed):
        names = ", ".join(
            f"{c} in {w}, seed {s}"
            for c, w, s in failed.select("config", "weather", "seed").head(5).iter_rows()
        )
        blocks.append(
            Text(
                f"{len(failed)} of {len(matrix.results)} runs did not finish ({names}); "
                "they are in no denominator.",
                tone="warning",
            )
        )
    if matrix.same_weather:
        pairs = "; ".join(
            f"configuration {c}: {' = '.join(group)}" for c, group in matrix.same_weather
        )
        blocks.append(
            Text(
                f"Identical drives, because weather cannot act here ({pairs}). "
                "They count once in totals.",
                tone="warning",
            )
        )
    return blocks


def _headline(matrix: Matrix) -> Numbers:
    t = matrix.counted
    km = float(t["distance_km"].sum())
    fatal = int(t["fatal_collisions"].sum())
    return Numbers(
        [
            Number(
                f"{len(matrix.results)}",
                "runs",
                f"{matrix.results['seed'].n_unique()} seeds per cell",
            ),
            Number(
                f"{km:,.0f} km",
                "driven",
                f"{float(t['duration_s'].sum()) / 3600:.1f} h of simulated time",
            ),
            Number(
                f"{fatal}", "fatal collisions", f"{100 * fatal / km:.1f} per 100 km" if km else ""
            ),
            Number(
                f"{int(t['collisions_vehicle'].sum())}",
                "with vehicles",
                f"{int(t['rear_ended'].sum())} of them struck from behind",
            ),
            Number(
                f"{int(t['collisions_static'].sum())}",
                "with barriers",
                f"{int(t['bend_exits'].sum())} in bends without a lead",
            ),
        ]
    )


def _verdicts(matrix: Matrix) -> list[Block]:
    claims = (*FINDINGS, *ACCEPTANCE)
    judged = judge(claims, [None if f.study else matrix.results for f in claims])
    intro = Text(
        "Each claim, its test and its margin were written down before results of the matrix were "
        "seen. One rule is not blind: that a margin comes before significance, so that a difference "
        "below its margin supports nothing, is shared by all reports and was settled after results "
        "of the friction campaign had been seen. "
        "A claim whose two sides are the same drive is marked by construction; one that needs runs "
        "of its own can be tested with `skidpad study ID`."
    )
    return [intro, *verdict_blocks(judged)]


def _definitions() -> Definitions:
    return Definitions(
        [(name, _unit(name), f"{meaning} ({source})") for name, meaning, source in definitions()]
    )


UNITS = {"_m": "m", "_m2": "m²", "_s": "s", "_kmh": "km/h", "_km": "km", "_pct": "%"}


def _unit(name: str) -> str:
    return next((unit for end, unit in UNITS.items() if name.endswith(end)), "")


def _provenance(matrix: Matrix, folder: Path) -> list[Block]:
    timing, _ = read_parquet(folder / TIMING)
    timing = timing.filter(pl.col("rtf") > 0.0)
    prints = fingerprints(latest(read_ledger(folder)))
    lines = [
        f"Skidpad {__version__}, results hash {results_hash(matrix.results)}.",
        f"Machine fingerprints: {', '.join(sorted(prints)) or 'none'}.",
    ]
    if len(timing):
        wall, rtf = timing["wall_s"].to_numpy(), timing["rtf"].to_numpy()
        lines.append(
            f"Wall time per run: median {np.median(wall):.1f} s; real-time factor: median "
            f"{np.median(rtf):.1f}, least {rtf.min():.1f}."
        )
    campaign = (folder / CAMPAIGN).read_bytes() if (folder / CAMPAIGN).exists() else b"{}"
    first = msgspec.json.decode(campaign).get("cells", [{}])[0]
    return [
        Text(" ".join(lines)),
        Code(
            "Resolved configuration of the first cell",
            msgspec.json.format(msgspec.json.encode(first).decode(), indent=2),
        ),
    ]
