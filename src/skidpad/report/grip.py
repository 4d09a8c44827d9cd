"""The report of a friction campaign: from results.parquet and the series to one page."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import polars as pl

from skidpad import __version__
from skidpad.evidence.grip.findings import FINDINGS
from skidpad.evidence.grip.study import Pair, completion, completion_p
from skidpad.evidence.verdicts import judge
from skidpad.recording.files import read_parquet
from skidpad.recording.grip import GRIP, GripEntry, GripMetrics
from skidpad.recording.ledger import common_configuration, fingerprints, latest, read_ledger
from skidpad.recording.logfiles import TICKS, read_log
from skidpad.recording.results import TIMING, definitions_of
from skidpad.report import grip_figures, grip_tables
from skidpad.report.grip_data import GripCampaign, load_grip, scenario_title
from skidpad.report.grip_rain import rain_tables
from skidpad.report.page import (
    Block,
    Card,
    Cards,
    Code,
    Definitions,
    Number,
    Numbers,
    Page,
    Section,
    Text,
    write_page,
)
from skidpad.report.replay import replay
from skidpad.report.verdicts import verdict_blocks
from skidpad.roads.bundled import load_map

REPORT, RUNS, STOPPING = "report.html", "runs", "stopping.parquet"
LEAD = """Every run was driven twice with the same seed: once with the weather only seen, and once with \
tyres that feel it, those of the ego and of every other vehicle. Seeds are common to all cells, so that \
differences are paired.

Completion is the share of runs without an accident of the ego. Runs in which the scenario never happened \
count in it, as in the published numbers, and are left out in the columns "if triggered". Intervals are \
95 %: exact for shares, bootstrap over runs for means. Published numbers stand beside ours in small print; \
they come from another simulator, another driver and other scenario files, and nothing here was tuned to \
meet them."""
MODEL = """The statistical ratio of the study multiplies the friction of a dry road, 0.9. It puts heavy \
rain at 0.27, below packed snow (0.34) and far below what braking tests measure on wet roads (0.63 to \
0.72); `--model physical` follows measurements."""


def write_grip_report(folder: Path) -> Path:
    """Write report.html into a campaign's folder; returns its path."""
    campaign = load_grip(folder)
    path = folder / REPORT
    write_page(build_page(campaign, folder), path)
    return path


def build_page(campaign: GripCampaign, folder: Path) -> Page:
    """All sections in the order in which a reader asks."""
    both = campaign.both
    sections = [
        Section(
            "What happened", [*_warnings(campaign), _headline(campaign), Text(LEAD), Text(MODEL)]
        ),
        Section("Completion and score", grip_tables.completion_tables(campaign)),
        Section("Findings of the source, judged", _verdicts(campaign)),
        Section("What changes besides", grip_tables.change_tables(campaign) if both else []),
        Section("Rain on the lens and rain on the road", rain_tables(campaign)),
        Section("Series over time", grip_figures.both_modes(campaign) if both else []),
        Section("Across weathers", grip_figures.across_weathers(campaign)),
        Section("Trajectories of the cut-in", grip_figures.trajectories(campaign)),
        Section("The cut-in and the spawn delay", grip_tables.variant_table(campaign)),
        Section("Distances between series", grip_tables.distance_tables(campaign) if both else []),
        Section("Replays", _replays(campaign, folder)),
        Section("Stopping distances", grip_tables.stopping_table(_stopping(folder))),
        Section("Definitions", [_definitions()]),
        Section("Configuration and versions", _provenance(campaign, folder)),
    ]
    return Page(
        title="Grip in weather",
        subtitle=_subtitle(campaign),
        facts=_facts(campaign),
        sections=[s for s in sections if s.blocks],
    )


def _subtitle(campaign: GripCampaign) -> str:
    r = campaign.results
    return (
        f"{r['scenario'].n_unique()} scenarios in {r['weather'].n_unique()} weathers, friction "
        f"{' and '.join(sorted(r['friction'].unique().to_list()))}, {r['seed'].n_unique()} repeats."
    )


def _facts(campaign: GripCampaign) -> list[tuple[str, str]]:
    columns = ("controller", "sensors", "model", "version")
    return [
        (c, ", ".join(sorted(map(str, campaign.results[c].unique().to_list())))) for c in columns
    ]


def _warnings(campaign: GripCampaign) -> list[Block]:
    blocks: list[Block] = []
    missing = len(campaign.results) - len(campaign.finished)
    if missing:
        counts = campaign.results["outcome"].value_counts().sort("outcome").iter_rows()
        told = ", ".join(f"{n} {outcome}" for outcome, n in counts)
        text = f"{missing} of {len(campaign.results)} runs are in no denominator ({told})."
        blocks.append(Text(text, tone="warning"))
    same = [f"{scenario_title(s)} in {w}" for (s, w), p in campaign.pairs.items() if p.identical]
    if same:
        text = f"Identical drives with both frictions, as the ratio is 1: {', '.join(same)}."
        blocks.append(Text(text, tone="note"))
    return blocks


def _headline(campaign: GripCampaign) -> Numbers:
    t = campaign.finished.filter(pl.col("cutin") == "fixed")
    items = [
        Number(
            f"{len(campaign.results)}", "runs", f"{campaign.results['seed'].n_unique()} per cell"
        )
    ]
    for friction in ("original", "reduced"):
        runs = t.filter(pl.col("friction") == friction)
        share = completion(runs)
        if share.value is not None:
            low, high = share.interval
            note = f"95 % {100 * low:.1f} to {100 * high:.1f}"
            items.append(
                Number(f"{100 * share.value:.1f} %", f"completed, {friction} friction", note)
            )
    changed = sum(1 for p in campaign.pairs.values() if len(p.common) and _changed(p))
    items.append(Number(f"{changed}", "cells with another outcome", f"of {len(campaign.pairs)}"))
    lost = t.filter(pl.col("friction") == "reduced")["loss_of_control_npc"].mean()
    if lost is not None:
        items.append(
            Number(f"{100 * float(lost):.0f} %", "others out of control", "with reduced friction")  # type: ignore[arg-type]
        )
    return Numbers(items)


def _changed(pair: Pair) -> bool:
    return completion_p(pair) < 0.05


def _verdicts(campaign: GripCampaign) -> list[Block]:
    table = campaign.with_delays() if campaign.both else campaign.results
    judged = judge(FINDINGS, [table for _ in FINDINGS])
    intro = Text(
        "Claims are the source's. Tests and margins were written after a trial of three seeds had been "
        "seen, and two rules for verdicts were settled after 65; they are not blind. The other "
        "variants of the cut-in are runs of their own: --cutin original,unfixed,fixed."
    )
    return [intro, *verdict_blocks(judged)]


def _replays(campaign: GripCampaign, folder: Path) -> list[Block]:
    """The median and the worst run of each cell, as far as their logs were kept."""
    blocks: list[Block] = []
    for (scenario, weather), pair in campaign.pairs.items():
        cards = []
        for friction in ("original", "reduced"):
            if friction == "reduced" and pair.identical:
                continue
            runs = pair.side(friction).drop_nulls("min_cvip_m")
            order = runs.sort("completion", "min_cvip_m", "seed")
            if not len(order):
                continue
            chosen = {"worst": order.row(0, named=True)}
            chosen["median"] = order.row(len(order) // 2, named=True)
            for role, row in chosen.items():
                card = _card(folder, row, role)
                cards += [card] if card is not None else []
        if cards:
            blocks.append(Cards(f"{scenario_title(scenario)}, {weather}", cards))
    return blocks


def _card(folder: Path, row: dict[str, object], role: str) -> Card | None:
    drops = "-drops" if row["overlay"] else ""
    name = f"{row['scenario']}{drops}_{row['weather']}_{row['friction']}-{row['seed']:06d}"
    run = folder / RUNS / name
    if not (run / TICKS).exists():
        return None
    log = read_log(run)
    gaps = np.hypot(
        log.actors.x[:, 1:] - log.actors.x[:, :1], log.actors.y[:, 1:] - log.actors.y[:, :1]
    ).min(axis=1)
    at = len(log) - 1 if log.contacts else int(np.argmin(gaps))
    impact = row["impact_kmh"]
    facts = [("least distance of centres", f"{row['min_cvip_m']:.2f} m")]
    if impact is not None:
        facts.append(("closing speed", f"{impact:.0f} km/h"))
    return Card(
        title=f"{row['friction']} friction, {role} run: {row['outcome']}",
        subtitle=f"{name}, around {log.t[at]:.1f} s",
        facts=facts,
        replay=replay(log, load_map(log.header.map), at),
    )


def _stopping(folder: Path) -> pl.DataFrame:
    path = folder / STOPPING
    return read_parquet(path)[0] if path.exists() else pl.DataFrame()


UNITS = {"_m": "m", "_s": "s", "_kmh": "km/h", "_deg": "deg", "_deg_s": "deg/s"}


def _definitions() -> Definitions:
    items = []
    for name, meaning, source in definitions_of(GripMetrics):
        ends = [end for end in UNITS if name.endswith(end)]
        unit = UNITS[max(ends, key=len)] if ends else ""
        items.append((name, unit, f"{meaning} ({source})"))
    return Definitions(items)


def _provenance(campaign: GripCampaign, folder: Path) -> list[Block]:
    timing, _ = read_parquet(folder / TIMING)
    timing = timing.filter(pl.col("cpu_s") > 0.0)
    prints = fingerprints(latest(read_ledger(folder, GripEntry)))
    lines = [
        f"Skidpad {__version__}, results hash {GRIP.hash(campaign.all_runs)}.",
        f"Machine fingerprints: {', '.join(sorted(prints)) or 'none'}.",
    ]
    if len(timing):
        lines.append(f"CPU time per run: median {float(np.median(timing['cpu_s'])):.2f} s.")
    common = msgspec.json.encode(common_configuration(folder)).decode()
    text = msgspec.json.format(common, indent=2)
    return [Text(" ".join(lines)), Code("Resolved configuration common to all runs", text)]
