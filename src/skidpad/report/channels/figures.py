"""Figures of the report of a monitored drive."""

from __future__ import annotations

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.indicators.catalogue import AnyIndicator, Bound, Indicator
from skidpad.evidence.channels.timing import BUDGET_MS, MODULES, time_by_objects
from skidpad.report.channels.data import MonitoredDrive, Trace
from skidpad.report.elements.figures import Chart, Curve, curves, lines
from skidpad.report.elements.page import Block, Figure, Text, words
from skidpad.report.elements.timeline import Mark, Strip, timelines

MARGIN = 5.0  # s around a hazard that are not hazard-free
TIME_BINS = 300
QUANTILES = (0.5, 0.9, 0.99)


def drive_timeline(drive: MonitoredDrive) -> str:
    """Returns an SVG strip per indicator with a threshold, and the safety score: the worst of all pairs."""
    strips = [
        strip
        for indicator, entry in drive.thresholds.items()
        if entry.threshold is not None or indicator is Indicator.SAFETY_SCORE
        for strip in [_strip(drive, indicator)]
        if strip is not None
    ]
    t = drive.table["t"]
    scored = {h.value for h in SCORED_HAZARDS}  # candidates would cover everything
    marks = [
        Mark(e["t_start"], e["t_end"], e["name"])
        for e in drive.summary["hazards"]
        if e["name"] in scored
    ]
    return timelines(strips, marks, float(t.min()), float(t.max()))  # type: ignore[arg-type]


def _strip(drive: MonitoredDrive, indicator: AnyIndicator) -> Strip | None:
    """Returns an indicator's strip of its worst value over time; None where it has no trace."""
    traces = drive.traces(indicator)
    if not traces:
        return None
    entry = drive.thresholds[indicator]
    upper = entry.bound is Bound.UPPER
    value = _worst(traces, upper)
    events = sum(e["name"] == indicator.value for e in drive.summary["violations"])
    return Strip(
        label=_label(indicator),
        t=traces[0].t,
        value=value,
        alarm=np.any([trace.violated for trace in traces], axis=0),
        high=0.3 if upper else 1.0,
        threshold=entry.threshold,
        note=f"{events} violations" if entry.threshold is not None else "",
    )


def _label(indicator: AnyIndicator) -> str:
    """Returns the short label of an indicator for the timeline."""
    name = words(indicator.value)
    return name.replace("object motion prediction", "motion").replace(" planned", "")


def _worst(traces: list[Trace], upper: bool) -> NDArray[np.float64]:
    """Returns (n,) the worst known value per cycle, largest for an upper bound, else least; or nan."""
    values = np.array([trace.value for trace in traces])
    known = np.isfinite(values).any(axis=0)
    fill = -np.inf if upper else np.inf
    filled = np.where(np.isfinite(values), values, fill)
    worst: NDArray[np.float64] = filled.max(axis=0) if upper else filled.min(axis=0)
    return np.where(known, worst, np.nan)


def risk(drive: MonitoredDrive) -> list[Block]:
    """Returns figure and quantiles of the plan's risk in hazard-free driving (C-8); a note without any."""
    scores = drive.traces(Indicator.SAFETY_SCORE)
    free = {t.subject: values for t in scores if (values := _free_risk(drive, t)).size}
    if not free:
        return [Text("No cycle was free of hazards and had a risk.", tone="note")]
    cumulated = []
    for name, values in free.items():
        share = np.arange(1, values.size + 1) / values.size
        thin = slice(None, None, max(1, values.size // 200))
        cumulated.append((name, values[thin], share[thin]))
    return [
        Figure(
            lines(cumulated, "risk of the plan in the worst world", "share of cycles"),
            f"Risk in driving without hazards ({MARGIN:g} s around each left out), cumulated: what "
            "the rules must tell from a hazard.",
        ),
        Text("; ".join(_quantiles(*one) for one in free.items()) + "." + _risk_behind(drive)),
    ]


def _free_risk(drive: MonitoredDrive, trace: Trace) -> NDArray[np.float64]:
    """Returns the sorted known risks (1 less the score) of cycles more than MARGIN s from every hazard."""
    near = np.zeros(trace.t.size, dtype=bool)
    for e in drive.summary["hazards"]:
        near |= (trace.t >= e["t_start"] - MARGIN) & (trace.t <= e["t_end"] + MARGIN)
    value: NDArray[np.float64] = 1.0 - trace.value
    return np.sort(value[~near & np.isfinite(value)])


def _quantiles(name: str, risks: NDArray[np.float64]) -> str:
    """Returns a sentence with quantiles of the risks and the share of them above 0.2 in %."""
    q = ", ".join(f"{np.quantile(risks, p):.2f}" for p in QUANTILES)
    above = 100.0 * (risks > 0.2).mean()
    return f"{name}: median, 90 % and 99 % of {risks.size} cycles: {q}; above 0.2 in {above:.1f} %"


def _risk_behind(drive: MonitoredDrive) -> str:
    """Returns a sentence on the mean share of risk behind, per subject; "" where no value is known."""
    means = [
        f"{trace.subject} {np.nanmean(trace.value):.2f}"
        for trace in drive.traces(Indicator.RISK_BEHIND_SHARE)
        if np.isfinite(trace.value).any()
    ]
    if not means:
        return ""
    told = ", ".join(means)
    return f" Mean share of the risk that objects behind add, where there is risk: {told}."


def timing(drive: MonitoredDrive) -> list[Block]:
    """Returns figures of time per module over the drive (C-236) and by objects (C-238); or nothing."""
    if drive.timing is None:
        return []
    by_objects = time_by_objects(drive.timing)
    objects = by_objects["objects"].to_list()
    curves = [(words(m), objects, by_objects[m].to_list()) for m in ("total", *MODULES)]
    return [
        Figure(
            _over_time(drive.timing),
            f"Processor time per cycle over the drive, the greatest within each stretch; the budget "
            f"is {BUDGET_MS:g} ms.",
        ),
        Figure(
            lines(curves, "objects of all channels together", "mean, ms"),
            "Processor time against the number of objects.",
        ),
    ]


def _over_time(timing: pl.DataFrame) -> str:
    """Returns an SVG of the peak time in ms of each module over the drive in s."""
    seconds = (timing["cycle"].to_numpy() - timing["cycle"][0]) * 0.1
    bins = np.minimum((seconds / max(seconds[-1], 0.1) * TIME_BINS).astype(int), TIME_BINS - 1)
    peaks = []
    for module in ("total", *MODULES):
        peak = np.full(TIME_BINS, np.nan)
        np.fmax.at(peak, bins, timing[module].to_numpy())
        at = np.flatnonzero(np.isfinite(peak))
        x = at * seconds[-1] / TIME_BINS
        peaks.append(Curve(words(module), x, peak[at], style={"linewidth": 1.0}))
    return curves([Chart(peaks, "s", "ms", log=True)], height=3.6)
