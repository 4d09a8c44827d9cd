"""The page of `skidpad risk`: how probable a crash is, how sure that is, and what it hangs on."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, log
from pathlib import Path

from skidpad.core.text.wording import count_text
from skidpad.core.traffic.disturbance import actor_of_draw, name_draw, parse_disturbance
from skidpad.recording.campaign.risks import (
    RISK_RUNS,
    SCALES,
    Influence,
    Probability,
    Rate,
    Repetition,
    Risk,
    RiskFound,
    name_input,
    read_risk,
    read_risk_found,
)
from skidpad.recording.campaign.searches import Trial, read_trials
from skidpad.report.elements.figures import INK, PALETTE, Chart, Curve, canvas, curves, svg_of
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
from skidpad.report.search import law_text
from skidpad.report.search_sentences import driver_text

CRASH = (
    "A crash is a contact above 5 km/h (with a person or a two-wheeler any), or a departure with all "
    "wheels off every lane."
)
PER_LEVEL = ("subset simulation", "splitting")  # methods that --per-level narrows
AIMED = 0.45  # relative half-width, a little below the largest that determines something
SCALED = "times the probability when all values of the input are multiplied so"
INTERVALS = (
    "counting: exact; subset simulation: Student's of the logarithm over its repetitions; splitting: "
    "Cox's of a log-normal mean over its repetitions; importance sampling: normal of the logarithm"
)


def write_risk_report(out: Path) -> str:
    """Writes the page of a risk question and returns the text to print."""
    asked, found = read_risk(out), read_risk_found(out)
    write_report_page(risk_page(asked, found, read_trials(out, RISK_RUNS)), out)
    lines = [answer(asked, found), *rate_lines(asked, found)]
    return "\n".join([*lines, f"page: {out / REPORT}"])


def risk_page(asked: Risk, found: RiskFound, trials: Sequence[Trial]) -> Page:
    """Returns the page of a question and what came of it."""
    run = asked.template
    title = f"Risk: {getattr(run.course, 'title', 'scenario')}"
    subtitle = f"{driver_text(run.driver)}, {count_text(_run_count(found, trials), 'run')}"
    sections = [
        Section("Answer", [_answers(asked, found, trials)]),
        Section("Methods", _methods(found)),
        *([Section("Branches", _branches(found.splitting))] if found.splitting else []),
        Section("What it hangs on", [_inputs(asked, found)]),
        Section("Limits of this answer", [Text(_limits(asked, found))]),
    ]
    return Page(title=title, subtitle=subtitle, sections=sections)


def _run_count(found: RiskFound, trials: Sequence[Trial]) -> int:
    """Returns how many runs were driven, those of splitting included."""
    return len(trials) + sum(r.runs for r in found.splitting)


def answer(asked: Risk, found: RiskFound) -> str:
    """Returns the answer to the question `asked` from what was `found`, in one or two sentences."""
    who = driver_text(asked.template.driver)
    given = "given this exposure model"
    if found.high is not None and found.p == 0.0:
        text = (
            f"No crash of {who} was reached; counting bounds it at {found.high:.2g} per encounter"
        )
        return f"{text}, {given}."
    ends = _ends(found.low, found.high)
    if found.why_not:
        return (
            f"Not determined, as {found.why_not}. The best guess for a crash of {who} is {found.p:.2g} "
            f"{ends} per encounter, {given}.{_advice(asked, found)}"
        )
    word = "Illustrative: a" if asked.assumptions else "A"
    return (
        f"{word} crash of {who} has a probability of {found.p:.2g} {ends} per encounter, {given}."
    )


def _advice(asked: Risk, found: RiskFound) -> str:
    """Returns a sentence on how many runs of a level would narrow the method that is too wide, or ""."""
    wide = next((e for e in found.probabilities if e.method in found.why_not and e.p > 0.0), None)
    if wide is None or wide.high is None or wide.method not in PER_LEVEL:
        return ""
    factor = (log(wide.high / wide.p) / log(1.0 + AIMED)) ** 2
    wanted = 50 * ceil(asked.per_level * factor / 50)
    return f" About --per-level {wanted} would narrow it enough."


def rate_lines(asked: Risk, found: RiskFound) -> list[str]:
    """Returns the answer per hour and per 100 km, where the exposure says how often encounters happen."""
    rates = (("hour", asked.per_hour), ("100 km", asked.per_100km))
    return [_rate_text(unit, rate, found) for unit, rate in rates if rate is not None]


def _rate_text(unit: str, rate: Rate, found: RiskFound) -> str:
    """Returns a sentence with the crashes per `unit` and their interval, at the rate of encounters."""
    times = rate.value
    ends = _ends(found.low * times, None if found.high is None else found.high * times)
    return f"Per {unit}, with {times:g} encounters: {found.p * times:.2g} crashes {ends}."


def _ends(low: float, high: float | None) -> str:
    """Returns an interval as text; high: None where there is no upper end."""
    return f"[{low:.2g}, {'no end' if high is None else f'{high:.2g}'}]"


def _answers(asked: Risk, found: RiskFound, trials: Sequence[Trial]) -> Answers:
    """Returns the answers at the head of the page: probability, kinds of crash, cost in runs."""
    lines = rate_lines(asked, found)
    if asked.assumptions:
        lines += [f"Inputs without a source: {', '.join(asked.assumptions)}."]
    kinds = [f"{kind}: {share:.0%} of the probability" for kind, share in found.kinds.items()]
    brute = brute_force_runs(found)
    cost = ""
    if brute is not None:
        about = float(f"{brute:.2g}")
        cost = (
            f"Counting alone would need about {about:,.0f} runs for the same interval (calculated)."
        )
    return Answers([
        Answer("How probable is a crash?", answer(asked, found), lines, _estimates(found)),
        Answer("What happens then?", kinds[0] if kinds else "No crash was reached.", kinds[1:]),
        Answer("What did it cost?", f"{count_text(_run_count(found, trials), 'run')}. {cost}".strip()),
    ])  # fmt: skip


def brute_force_runs(found: RiskFound) -> float | None:
    """Returns how many independent draws would give an interval as narrow as the one found.

    None without an upper end or a crash. By the normal approximation of a share:
    n = (1 - p) / p (1.96 / w)^2 with the relative half-width w.
    """
    if not found.high or found.p <= 0.0:
        return None
    w = found.high / found.p - 1.0
    return (1.0 - found.p) / found.p * (1.96 / w) ** 2 if w > 0.0 else None


def _estimates(found: RiskFound) -> Figure | None:
    """Returns the figure of each method's probability and interval, log axis; None without a crash."""
    ones = [e for e in found.probabilities if e.p > 0.0]
    if not ones:
        return None
    with canvas(height=0.7 + 0.45 * len(ones)) as (figure, (axes,)):
        for k, e in enumerate(reversed(ones)):
            low, high = max(e.low, 1e-12), e.high if e.high is not None else 1.0
            axes.plot([low, high], [k, k], color=PALETTE[0], linewidth=2)
            axes.plot([e.p], [k], "o", color=INK)
        axes.set_yticks(range(len(ones)), [e.method for e in reversed(ones)])
        axes.set_xscale("log")
        axes.set_ylim(-0.6, len(ones) - 0.4)
        axes.set_xlabel("probability of a crash per encounter")
        return Figure(svg_of(figure), "Each method with its 95 % interval.")


def _methods(found: RiskFound) -> list[Block]:
    """Returns the table of methods, and a text on subset simulation where it has levels."""
    blocks: list[Block] = [table(METHODS, found.probabilities, "by each method")]
    if found.levels:
        events = ", ".join(f"{level:.2f}" for level in found.levels)
        least = min(found.ancestors)
        sampling = "counting tells" if found.splitting else "importance sampling tells"
        blocks += [
            Text(
                f"Subset simulation went through margins {events} (first repetition). Its failures stem "
                f"from at least {least} different first samples in each repetition; {sampling} "
                f"as much as {found.effective:.0f} failures of equal weight."
            )
        ]
    return blocks


def _branches(repetitions: Sequence[Repetition]) -> list[Block]:
    """Returns how far branches diverge, and what each repetition of splitting went through."""
    note = (
        "Few ancestors mean that the failures of a repetition have one past in common. The interval "
        "comes from the repetitions, which are independent of each other."
    )
    rows = table(REPETITIONS, repetitions, "repetitions of splitting", note)
    apart = mean_distances(repetitions)
    if not apart:
        return [rows]
    seconds, metres = zip(*apart, strict=True)
    line = Curve("distance", seconds, metres, style={"marker": "o"})
    picture = Figure(
        curves([Chart([line], "s since the branch", "distance, m")], height=2.6),
        "How far the disturbed vehicle of a branch is from where it was in the drive that was left, "
        "mean over all branches that were still driven.",
    )
    return [picture, rows]


def mean_distances(repetitions: Sequence[Repetition]) -> list[tuple[int, float]]:
    """Returns the mean distance of branches in m by s since the branch, over all repetitions."""
    found = []
    for k in range(max(len(r.apart) for r in repetitions)):
        ones = [r.apart[k] for r in repetitions if len(r.apart) > k]
        count = sum(n for n, _ in ones)
        found.append((k, sum(n * distance for n, distance in ones) / count))
    return found


def _levels(r: Repetition) -> Cell:
    """Returns a cell with the levels of a repetition; a dash without any."""
    return Cell(", ".join(f"{level:.2f}" for level in r.levels) or "-", len(r.levels))


def _half_width(e: Probability) -> float | None:
    """Returns the relative half-width of an estimate; None for 0 or without an upper end."""
    return None if e.p == 0.0 or e.high is None else e.high / e.p - 1.0


TWO_DIGITS = Format(".2g")
METHODS: tuple[Column[Probability], ...] = (
    Column("method", lambda e: e.method),
    Column("probability", lambda e: e.p, "per encounter", format=TWO_DIGITS),
    Column("95 % interval", lambda e: _ends(e.low, e.high), INTERVALS),
    Column(
        "half-width", _half_width, "upper end over the estimate, less 1",
        format=Format(".0%", absent="-"),
    ),
    Column("runs", lambda e: e.runs, "what the method builds on included"),
    Column("simulated h", lambda e: e.simulated_s / 3600.0, format=Format(".1f")),
)  # fmt: skip
REPETITIONS: tuple[Column[Repetition], ...] = (
    Column("repetition", lambda r: r.number + 1),
    Column("probability", lambda r: r.p, "its own, unbiased estimate", format=TWO_DIGITS),
    Column("levels", _levels, "margins under which its rounds went on"),
    Column("failing", lambda r: r.failing, "drives of its end that fail"),
    Column("ancestors", lambda r: r.ancestors, "different first drives from which these stem"),
    Column("runs", lambda r: r.runs),
)


def _inputs(asked: Risk, found: RiskFound) -> Table:
    """Returns the table of inputs: distribution, source, factor on the probability per scaling."""
    columns = [
        ("input", ""),
        ("distribution", ""),
        ("source", "where it was read"),
        *((f"x {scale:g}", SCALED) for scale in SCALES),
    ]
    by_name = {i.name: i for i in found.influences}
    rows = [
        [
            Cell(v.name),
            Cell(law_text(v)),
            Cell(v.source or "assumption"),
            *_influence_cells(by_name.get(v.name)),
        ]
        for v in asked.space.variables
        if not actor_of_draw(v.name)
    ]
    for one in map(parse_disturbance, getattr(asked.template.course, "disturb", ())):
        law = f"acceleration: sigma {one.sigma:g} m/s², correlated over {one.tau:g} s"
        cells = [
            Cell(name_input(name_draw(one.actor, 0))),
            Cell(law),
            Cell(one.source or "assumption"),
        ]
        rows.append([*cells, *_influence_cells(None)])
    for unit, rate in (("hour", asked.per_hour), ("100 km", asked.per_100km)):
        if rate is not None:
            name, source = Cell(f"encounters per {unit}"), Cell(rate.source or "assumption")
            scales = [Cell(f"{scale:g}", scale) for scale in SCALES]
            rows.append([name, Cell(f"{rate.value:g}"), source, *scales])
    note = (
        "The last columns say how many times as probable a crash is when all values of an input are "
        "multiplied so. A dash: these runs cannot tell; drive again with other values."
    )
    return Table(columns, rows, caption="the exposure model, and what hangs on it", note=note)


def _influence_cells(one: Influence | None) -> list[Cell]:
    """Returns a cell per scale with the factor on the probability, a dash where it is unknown."""
    if one is None:
        return [Cell("-") for _ in SCALES]
    return [
        Cell("-", hint=one.why_not, kind="muted")
        if factor is None
        else Cell(f"{factor:.2g}", factor)
        for factor in one.factors
    ]


def _limits(asked: Risk, found: RiskFound) -> str:
    """Returns the text on what the answer holds for and what it misses."""
    run = asked.template
    noise = (
        "Sensor noise is drawn anew in each run."
        if "seed" in asked.space.names
        else f"Sensor noise is that of seed {run.seed} in every run; --vary seed=1:1000000 draws it."
    )
    faults = "" if not found.faults else f" {count_text(found.faults, 'run')} could not be driven."
    return (
        f"{CRASH} The answer holds for encounters that vary as the table says and not otherwise; inputs "
        "are independent of each other. Two methods agree when the interval of their ratio contains 1 "
        "and lies within 0.5 to 2, each with a half-width of at most 50 %; the interval of the answer "
        f"holds those of both. Failures in a region that no repetition entered are missed. {noise}"
        f"{faults}\n\nWeather {run.weather.name}, profile {run.settings.profile}, "
        f"at most {run.duration:g} s a run."
    )
