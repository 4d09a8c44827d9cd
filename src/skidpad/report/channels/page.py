"""The report of a monitored drive: from a monitor's output folder to one page (C-17, C-106)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from skidpad import __version__
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.recording.hazards.records import HazardRecord
from skidpad.report.channels import figures, tables
from skidpad.report.channels.data import MonitoredDrive, load_drive
from skidpad.report.channels.worlds import worlds_replay
from skidpad.report.elements.page import (
    Answer,
    Answers,
    Block,
    Card,
    Cards,
    Figure,
    Number,
    Numbers,
    Page,
    Section,
    Text,
    words,
    write_report_page,
)
from skidpad.report.elements.tables import table

CARDS = 20  # of one hazard, the worst ones
REPLAYS = 12  # worlds of the worst hazards are drawn; the others are listed
LEAD = """Indicators compare what the channels of one car report, ten times a second, and nothing else: no \
map, no raw sensor and no ground truth. One means full support for the claim, zero a concern. \
Grey stretches could not be evaluated, which is never counted as good.

Hazards come from rules over these indicators and the risk of each channel's plan in every channel's world."""
MEANING = {
    HazardType.INCONSISTENT_LOCALISATION: "the channels' ego positions jump or drift apart",
    HazardType.EGO_TAILGATING: "a channel's plan risks running into the vehicle ahead",
    HazardType.EGO_TAILGATED: "a channel predicts the vehicle behind to run into the ego",
    HazardType.CROSSING_OBJECT: "plans change at once while a conflict is predicted",
    HazardType.CONFLICTING_PATHS: "the channels want to drive different ways",
    HazardType.STUCK_VEHICLE: "hardly anything changes for long",
    HazardType.UNSEEN_BY_A_CHANNEL: "a vehicle too near, which another channel does not report",
}


def write_drive_report(folder: Path) -> Path:
    """Writes report.html into a monitor's output folder; returns its path."""
    return write_report_page(drive_page(load_drive(folder)), folder)


def drive_page(drive: MonitoredDrive) -> Page:
    """Returns the report page of a monitored drive."""
    sections = [
        Section(
            "What happened", [*_warnings(drive), _answers(drive), _headline(drive), Text(LEAD)]
        ),
        Section("Timeline", _timeline(drive)),
        Section("Hazards", _hazards(drive)),
        Section("Safety case", [tables.safety_case_tree(drive)]),
        Section("Indicators", tables.indicators(drive)),
        Section("Risk", figures.risk(drive)),
        Section("Computing time", [*tables.timing(drive), *figures.timing(drive)]),
        Section("What could not be used", tables.losses(drive)),
    ]
    return Page(
        title="Channels under watch",
        subtitle=_subtitle(drive),
        facts=_facts(drive),
        sections=sections,
    )


def _subtitle(drive: MonitoredDrive) -> str:
    """Returns the drive's title, route or name, and its channels as text."""
    words = drive.context
    where = words.get("title") or words.get("route") or drive.name
    return f"{where}: {', '.join(drive.channels)}"


def _facts(drive: MonitoredDrive) -> list[tuple[str, str]]:
    """Returns names and values of the facts on the drive, with at most 8 short entries of its context."""
    s = drive.summary
    facts = [
        ("rules", s["rules"]),
        ("forms", s["forms"]),
        ("identifier", s.get("identifier", "rules")),
        ("cycles", f"{s['cycles']}"),
        ("Skidpad", __version__),
    ]
    return facts + [(k, v) for k, v in sorted(drive.context.items()) if len(v) < 60][:8]


def _warnings(drive: MonitoredDrive) -> list[Block]:
    """Returns a warning that lists the losses of the recording by kind; empty where there were none."""
    lost = {k: v for k, v in drive.summary["losses"].items() if v}
    if not lost:
        return []
    told = ", ".join(f"{words(k)}: {v}" for k, v in lost.items())
    return [Text(f"The recording was not read in full ({told}).", tone="warning")]


def _answers(drive: MonitoredDrive) -> Answers:
    """Returns the answers to what was found, what was worst, and how sure that is."""
    scored = [r for r in drive.records if not _candidate(r.type.value)]
    counts = Counter(r.type for r in scored)
    told = ", ".join(f"{n} of {tables.NAMES[h].lower()}" for h, n in counts.most_common())
    minutes = drive.summary["seconds"] / 60.0
    found = f"{len(scored)} hazards in {minutes:.1f} min" + (f": {told}." if told else ".")
    worst = min(scored, key=_severity, default=None)
    audit = drive.summary["indicators"]
    missing = sum(a["not_evaluated_cycles"] for a in audit)
    share = 100.0 * missing / max(1, len(audit) * drive.summary["cycles"])
    items = [Answer("Was anything hazardous?", found)]
    if worst is not None:
        score = worst.extremes.get("safety_score")
        at = "" if score is None else f", safety score {score:.2f}"
        name = tables.NAMES[worst.type]
        items.append(Answer("What was the worst?", f"{name} at {worst.t_start:.1f} s{at}."))
    sure = (
        f"Rules on what the channels themselves report; {share:.0f} % of the indicators' values could "
        "not be evaluated, which is never counted as good."
    )
    return Answers([*items, Answer("How sure is that?", sure)])


def _headline(drive: MonitoredDrive) -> Numbers:
    """Returns the head numbers of a drive: minutes, hazards, violations, and agreement where it is known."""
    s = drive.summary
    scored = sum(not _candidate(e["name"]) for e in s["hazards"])
    minutes = s["seconds"] / 60.0
    items = [
        Number(f"{minutes:.1f} min", "watched", f"{s['cycles']} cycles of 0.1 s"),
        Number(f"{scored}", "hazards", f"{len(s['hazards']) - scored} candidates beside them"),
        Number(f"{len(s['violations'])}", "violations", "repeats within 2 s count once"),
    ]
    agreement = drive.traces(Indicator.AGREEMENT)
    if agreement:
        values = np.concatenate([trace.value for trace in agreement])
        if np.isfinite(values).any():
            items.append(
                Number(
                    f"{np.nanmean(values):.2f}",
                    "agreement of the channels",
                    f"least {np.nanmin(values):.2f}; 1 is full",
                )
            )
    return Numbers(items)


def _candidate(name: str) -> bool:
    """Returns True when the hazard type of this name is a candidate, not one of the first three types."""
    return HazardType(name) not in tuple(HazardType)[:3]


def _timeline(drive: MonitoredDrive) -> list[Block]:
    """Returns one figure of the indicators with a threshold over the drive."""
    return [
        Figure(
            figures.drive_timeline(drive),
            "Indicators with a threshold, the worst of all channels or pairs, and the safety score. "
            "Blue: values (least to greatest within a stretch); dashed: threshold; orange below: "
            "violated; grey: not evaluated; orange bands: hazards, without candidates.",
        )
    ]


def _hazards(drive: MonitoredDrive) -> list[Block]:
    """Returns the list of hazards and cards per type, the most severe first; a sentence if none."""
    if not drive.records:
        return [Text("The rules found no hazard in this drive.")]
    order = sorted(drive.records, key=_severity)
    drawn = {r.id for r in order[:REPLAYS]}
    scored = [r for r in drive.records if not _candidate(r.type.value)]
    blocks: list[Block] = [table(tables.HAZARD_COLUMNS, scored, "All hazards")] if scored else []
    for hazard in HazardType:
        records = [r for r in drive.records if r.type is hazard]
        if records:
            records.sort(key=_severity)
            cards = [
                hazard_card(r, r.id in drawn, drive.searches.get(r.id, ())) for r in records[:CARDS]
            ]
            blocks.append(Cards(tables.NAMES[hazard], cards, open=records[0].id in drawn))
            if len(records) > CARDS:
                left = len(records) - CARDS
                blocks.append(Text(f"{left} more, in hazards.jsonl.", tone="note"))
    if len(drive.records) > REPLAYS:
        blocks.append(
            Text(
                f"Worlds are drawn for the {REPLAYS} worst hazards; `skidpad hazards export` writes "
                "any of them as a scenario.",
                tone="note",
            )
        )
    return blocks


def _severity(record: HazardRecord) -> tuple[bool, float]:
    """Returns a sort key: scored hazards first, then by the least safety score, 1 where unknown."""
    return _candidate(record.type.value), record.extremes.get("safety_score", 1.0)


def hazard_card(record: HazardRecord, drawn: bool, searched: Sequence[str] = ()) -> Card:
    """Returns the card of a hazard: facts, objects involved and, if `drawn`, the channels' worlds.

    searched: sentences of a search around the hazard.
    """
    duration = record.t_end - record.t_start
    facts = [
        ("rule fired", f"{record.count} cycles in {duration:.1f} s"),
        ("channels", ", ".join(record.involved) or "all"),
        ("driving", record.driving or "not recorded"),
    ]
    facts += [(words(k), f"{v:.2f}") for k, v in record.extremes.items() if k in SHOWN]
    chain = [MEANING[record.type].capitalize() + "."]
    chain += [
        f"Object {'' if o.id is None else o.id} of {o.channel} at ({o.x:.1f}, {o.y:.1f}) m."
        for o in record.objects
    ]
    if "assumed" in record.flags:
        chain.append("No objects were paired between the channels, so their agreement is assumed.")
    if "cut" in record.flags:
        chain.append("The record is cut: the drive or the record's limit ended it.")
    chain += searched
    return Card(
        title=f"{tables.NAMES[record.type]} at {record.t_start:.1f} s",
        subtitle=f"{record.id}, rules {record.profile}",
        tags=record.flags,
        facts=facts,
        chain=chain,
        worlds=worlds_replay(record) if drawn else None,
    )


SHOWN = (
    "safety_score", "gap_signed", "comfort_least", "comfort_driving", "location_variance",
    "shift_short", "shift_long", "cross_path", "ego_trajectory",
)  # fmt: skip
