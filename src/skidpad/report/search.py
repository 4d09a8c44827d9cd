"""The page of a search: what fails, how it could have been avoided, and how well the space was covered."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import ks_2samp

from skidpad.core.maths.space import Choice, Normal, Variable
from skidpad.core.text.wording import count_text
from skidpad.recording.campaign.searches import (
    Findings,
    Search,
    Trial,
    distinct_failures,
    failure_folder,
    read_findings,
    read_hazard,
    read_search,
    read_trials,
)
from skidpad.report.elements.figures import INK, PALETTE, canvas, svg_of
from skidpad.report.elements.page import (
    REPORT,
    Answer,
    Answers,
    Block,
    Cell,
    Figure,
    Page,
    Section,
    Table,
    Text,
    write_report_page,
)
from skidpad.report.elements.tables import Column, Format, table
from skidpad.report.search_sentences import (
    driver_text,
    group_sentence,
    hazard_sentences,
    judges_text,
)

VARIED_SCENE = (
    "The scene holds what one channel saw. EgoSpeed (m/s) and EgoAhead (m) are where and how fast the ego "
    "begins, OthersPace is how fast all others go their recorded ways; they do not react to the ego."
)
LISTED = 20  # failures in the table


def write_search_report(out: Path) -> str:
    """Writes the page of a search and returns the text to print."""
    search, trials, findings = read_search(out), read_trials(out), read_findings(out)
    write_report_page(search_page(out, search, trials, findings), out)
    hazard = read_hazard(out)
    lines = [answer(search, trials, findings)]
    lines += [] if hazard is None else hazard_sentences(hazard)
    lines += [group_sentence(g) for g in findings.groups]
    lines += [f"page: {out / REPORT}"]
    if findings.groups:
        first = failure_folder(out, findings.groups[0].failures[0].number)
        lines += [f"Next: skidpad replay {first}"]
    return "\n".join(lines)


def search_page(out: Path, search: Search, trials: Sequence[Trial], findings: Findings) -> Page:
    """Returns the page of a search."""
    sections = [
        Section("Answer", [_answers(search, trials, findings)]),
        Section("Failures", _failures(out, search, trials, findings)),
        Section("Coverage", _coverage(search, trials)),
        Section("What was searched", [_variables(search, trials), Text(_method(search), "note")]),
    ]
    hazard = read_hazard(out)
    if hazard is not None:
        told = [Text(sentence) for sentence in hazard_sentences(hazard)]
        sections.insert(1, Section("The hazard", [*told, Text(VARIED_SCENE, "note")]))
    course = search.template.course
    title = f"Search: {getattr(course, 'title', 'scenario')}"
    run = search.template
    subtitle = f"{driver_text(run.driver)}, {count_text(search.budget, 'run')}"
    return Page(title=title, subtitle=subtitle, sections=sections)


def answer(search: Search, trials: Sequence[Trial], findings: Findings) -> str:
    """Returns the answer in one or two sentences; trials: at least one."""
    failing = [t for t in trials if t.is_failure]
    driver, runs = driver_text(search.template.driver), count_text(len(trials), "run")
    if not failing:
        nearest = min(trials, key=lambda t: t.margin)
        near = "nothing came near"
        if nearest.min_gap_m is not None:
            near = f"the nearest came to a gap of {nearest.min_gap_m:.1f} m"
        return f"No failure of {driver} in {runs}; {near}. This is no proof that there is none."
    different = distinct_failures(failing)
    avoided = [t for t in different if t.is_avoidable]
    known = f"{len(avoided)} of the {len(different)} that differ could have been avoided"
    kinds = f", of {count_text(len(findings.groups), 'kind')}" if avoided else ""
    return (
        f"{count_text(len(failing), 'failure')} of {driver} in {runs}, the first in run "
        f"{failing[0].number + 1}. {known}{kinds}: {judges_text(different)}."
    )


def _value(value: float | str) -> str:
    """Returns a number with four digits as text; text stays as it is."""
    return value if isinstance(value, str) else f"{value:.4g}"


def _answers(search: Search, trials: Sequence[Trial], findings: Findings) -> Answers:
    """Returns the answers at the head of the page: where it fails, and what was not counted."""
    unavoidable = [t for t in distinct_failures(trials) if not t.is_avoidable]
    faults = [t for t in trials if t.fault]
    items = [
        Answer(
            "Where does it fail?",
            answer(search, trials, findings),
            [group_sentence(g) for g in findings.groups],
            _progress(trials),
        ),
        Answer(
            "What was not counted?",
            f"{count_text(len(unavoidable), 'failure')} that neither the reference driver nor braking or "
            f"steering from the same state avoids, and {count_text(len(faults), 'run')} that could not be "
            "driven.",
            sorted({t.fault for t in faults})[:5],
        ),
    ]
    return Answers(items)


def _failures(
    out: Path, search: Search, trials: Sequence[Trial], findings: Findings
) -> list[Block]:
    """Returns the failures by group and those that are not avoidable; a sentence without any."""
    blocks: list[Block] = []
    for group in findings.groups:
        blocks += [Text(group_sentence(group), "lead")]
        blocks += [_failure_table(out, search, group.failures, group.kind)]
    hard = [t for t in distinct_failures(trials) if not t.is_avoidable]
    if hard:
        blocks += [
            Text(
                "The reference driver touches something or leaves the road in these as well, and neither "
                "braking nor steering from the same state would have been enough, so they say nothing "
                "against the driver that was searched.",
                "note",
            ),
            _failure_table(out, search, hard, "not avoidable"),
        ]
    return blocks or [Text("There is none to show.")]


def _failure_table(out: Path, search: Search, failures: Sequence[Trial], caption: str) -> Table:
    """Returns the table of the LISTED likeliest failures; out: folder of the search, for links."""
    likelihood = {t.number: search.space.likelihood(t.values) for t in failures}
    columns: list[Column[Trial]] = [
        Column("run", partial(_run, out), "number in the search; a link where the run is kept"),
        Column(
            "contact", lambda t: t.contact_kmh, "larger delta-v of the two, else closing speed", "km/h",
            Format(".1f", absent="-"),
        ),
        Column(
            "at", lambda t: t.contact_s if t.departed_s is None else t.departed_s,
            "of the contact, or of the departure", "s", Format(".2f", absent="-"),
        ),
        Column(
            "reference", _reference_cell,
            "what the reference driver came to with the same values: least gap, m",
        ),
        Column(
            "bound", lambda t: t.bound or "nothing",
            "what avoids it from the state in which it could be known first: see docs/search.md",
        ),
        Column(
            "likelihood", lambda t: likelihood[t.number],
            "density of the values beside that of the likeliest ones", format=Format(".3g"),
        ),
        Column("values", _values, "of what varied"),
    ]  # fmt: skip
    ranked = sorted(failures, key=lambda t: -likelihood[t.number])[:LISTED]
    rest = f"{len(failures)} failures; the likeliest {LISTED} are listed, all in trials.jsonl."
    return table(columns, ranked, caption, rest if len(failures) > LISTED else "")


def _run(out: Path, trial: Trial) -> Cell:
    """Returns a cell with a run's number, and a link to its report where its folder is kept."""
    folder = failure_folder(out, trial.number)
    href = folder.relative_to(out).as_posix() + f"/{REPORT}" if folder.is_dir() else ""
    return Cell(str(trial.number + 1), trial.number, href=href)


def _values(trial: Trial) -> str:
    """Returns the values of a run as text."""
    return ", ".join(f"{name} {_value(v)}" for name, v in trial.values.items())


def _reference_cell(trial: Trial) -> Cell:
    """Returns a cell on what the reference driver came to with a failure's values: event or gap in m."""
    reference = trial.reference
    if reference is None or reference.fault:
        return Cell("not driven", -2.0)
    if reference.departed_s is not None:
        return Cell("leaves the road", -1.5)
    if reference.contact_kmh is not None:
        return Cell(f"contact, {reference.contact_kmh:.1f} km/h", -1.0)
    gap = reference.min_gap_m
    return Cell("-") if gap is None else Cell(f"{gap:.2f}", gap)


def _progress(trials: Sequence[Trial]) -> Figure:
    """Returns the figure of every run's margin in turn, failures marked."""
    margins = np.array([t.margin for t in trials])
    bad = np.array([t.is_failure for t in trials])
    with canvas(height=2.8) as (figure, (axes,)):
        at = np.arange(1, len(trials) + 1)
        axes.scatter(at[~bad], margins[~bad], s=6, color=PALETTE[5], label="no failure")
        axes.scatter(at[bad], margins[bad], s=14, color=PALETTE[1], marker="x", label="failure")
        axes.plot(
            at, np.minimum.accumulate(margins), color=INK, linewidth=1.0, label="least so far"
        )
        axes.axhline(0.0, color=INK, linewidth=0.6)
        axes.set_xlabel("run")
        axes.set_ylabel("margin")
        figure.legend(loc="outside upper center", ncols=3)
        return Figure(
            svg_of(figure),
            "Margin of each run: 2 without conflict, 1 to 2 by gap, TTC and braking, 0 to 1 a contact "
            "below 5 km/h, at most 0 a failure.",
        )


def influence(search: Search, trials: Sequence[Trial]) -> dict[str, float]:
    """Returns how far the coordinates of failures and of other runs differ, by variable: 0 to 1.

    It is the largest difference of the two distribution functions (Kolmogorov and Smirnov); 0 where
    there is no failure or nothing else.
    """
    bad = np.array([t.is_failure for t in trials])
    unit = np.array([t.unit for t in trials])
    if not bad.any() or bad.all():
        return dict.fromkeys(search.space.names, 0.0)
    return {
        name: float(ks_2samp(unit[bad, k], unit[~bad, k]).statistic)
        for k, name in enumerate(search.space.names)
    }


def _coverage(search: Search, trials: Sequence[Trial]) -> list[Block]:
    """Returns the figure of all runs over the most influential variable and up to three others."""
    ranked = sorted(influence(search, trials).items(), key=lambda item: -item[1])
    names = [name for name, _ in ranked]
    pairs = [(names[0], n) for n in names[1:4]] or [(names[0], names[0])]
    with canvas(width=8.4, height=3.0, columns=len(pairs)) as (figure, axes):
        for axis, (x, y) in zip(axes, pairs, strict=True):
            _draw_pair(axis, search, trials, x, y)
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
        picture = svg_of(figure)
    caption = "Every run by its values; where failures differ most from other runs comes first."
    return [Figure(picture, caption)]


def _draw_pair(axis, search: Search, trials: Sequence[Trial], x: str, y: str) -> None:  # type: ignore[no-untyped-def]
    """Draws all runs over two variables on one axis, failures apart from the others."""
    for bad, marker, colour, label in (
        (False, ".", PALETTE[5], "no failure"),
        (True, "x", PALETTE[1], "failure"),
    ):
        chosen = [t for t in trials if t.is_failure is bad]
        axis.scatter(
            [_place(search, x, t) for t in chosen], [_place(search, y, t) for t in chosen],
            marker=marker, s=12, color=colour, label=label, linewidths=0.8,
        )  # fmt: skip
    for name, set_label, set_ticks in (
        (x, axis.set_xlabel, axis.set_xticks),
        (y, axis.set_ylabel, axis.set_yticks),
    ):
        set_label(name)
        law = _variable(search, name).law
        if isinstance(law, Choice):
            set_ticks(range(len(law.words)), law.words)


def _variable(search: Search, name: str) -> Variable:
    """Returns the search's variable of this name; it must be there."""
    return next(v for v in search.space.variables if v.name == name)


def _place(search: Search, name: str, trial: Trial) -> float:
    """Returns a trial's value of a variable as a coordinate: the index of a word, else the number."""
    value, law = trial.values[name], _variable(search, name).law
    return float(law.words.index(str(value))) if isinstance(law, Choice) else float(value)


def _variables(search: Search, trials: Sequence[Trial]) -> Table:
    """Returns the table of variables with distribution, source and influence from 0 to 1."""
    shares = influence(search, trials)
    columns: list[Column[Variable]] = [
        Column("variable", lambda v: v.name, "parameter of the scenario, weather, or a field of the weather"),
        Column("distribution", law_text, "values are drawn as likely as it says"),
        Column("source", lambda v: v.source or "assumption", "where it was read"),
        Column(
            "influence", lambda v: shares[v.name],
            "largest difference of the distributions of failures and other runs, 0 to 1",
            format=Format(".2f"),
        ),
    ]  # fmt: skip
    return table(columns, search.space.variables, "what varied")


def law_text(variable: Variable) -> str:
    """Returns the distribution of a variable in words."""
    law = variable.law
    if isinstance(law, Choice):
        weights = law.weights or (1.0,) * len(law.words)
        return ", ".join(
            f"{w} ({x / sum(weights):.0%})" for w, x in zip(law.words, weights, strict=True)
        )
    ends = [f"{end:g}" for end in law.range]
    if isinstance(law, Normal):
        name = "log-normal" if law.is_log else "normal"
        cut = "" if (law.low, law.high) == (None, None) else f", within {ends[0]} to {ends[1]}"
        return f"{name}, mean {law.mean:g}, sigma {law.sigma:g}{cut}"
    return f"{ends[0]} to {ends[1]}, uniform"


def _method(search: Search) -> str:
    """Returns the text on method, seeds and weather, and on what counts as a failure."""
    run = search.template
    return (
        f"Method {search.method}, objective {search.objective}, seed {search.seed}; "
        f"weather {run.weather.name}, noise seed {run.seed}, "
        f"at most {run.duration:g} s a run. A failure is a contact above 5 km/h (with a person or a "
        "two-wheeler any), or a departure with all wheels off every lane. The same seed finds the same."
    )
