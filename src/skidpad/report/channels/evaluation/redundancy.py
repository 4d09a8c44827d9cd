"""Whether redundancy pays: the same seeds driven by one channel and by the arbiter (decision C-9)."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from skidpad.evidence.channels.redundancy import (
    EVENTS,
    Difference,
    DriverRow,
    compare_drivers,
    differences,
)
from skidpad.evidence.statistics import interval_text, p_text, rate_text
from skidpad.recording.channels.drives import read_outcomes
from skidpad.report.elements.page import Block, Cell, Text
from skidpad.report.elements.tables import Column, Format, table

TITLES = {
    "collisions": "collisions",
    "collisions_struck": "of these, hit by the ego",
    "red_lights_run": "red lights run",
    "stalls": "stalls",
}


def redundancy(folder: Path) -> list[Block]:
    """Outcomes per driver, and each channel alone less the arbiter at equal seeds."""
    outcomes = read_outcomes([folder])
    drivers = compare_drivers(outcomes)
    if len(drivers) < 2 or not drivers[0].segments:
        return [
            Text(
                "Not shown: it needs the same seeds driven by the arbiter and by a channel alone "
                "(`skidpad channels drive --drive-by NAME` into a folder below this one).",
                tone="note",
            )
        ]
    columns = [
        Column[DriverRow]("driven by", lambda d: d.drive_by),
        Column[DriverRow]("segments", lambda d: d.segments, "driven by all"),
        Column[DriverRow]("hours", lambda d: d.hours, format=Format(".2f")),
        Column[DriverRow]("km", lambda d: d.km, format=Format(".1f")),
        *(
            Column(TITLES[event], partial(_rate, event), "count, rate per hour below")
            for event in EVENTS
        ),
    ]
    return [
        table(columns, drivers, "Outcomes by driver, on the seeds that all have driven"),
        Text(" ".join(map(_sentence, differences(outcomes)))),
    ]


def _rate(event: str, driver: DriverRow) -> Cell:
    """Returns a cell with a driver's number of events and, as note, their rate per segment or hour."""
    rate = driver.rates[event]
    return Cell(str(rate.events), float(rate.events), note=rate_text(rate, "segment", "h"))


def _sentence(d: Difference) -> str:
    """Returns a sentence on the paired difference per segment: interval, p value, number of pairs."""
    c = d.pairs
    return (
        f"{d.drive_by} alone less the arbiter, {TITLES[d.event]} per segment: {c.mean:+.3g} "
        f"({interval_text(c.interval, c.n, 'pair')}, {p_text(c.p)}, {c.n} pairs)."
    )
