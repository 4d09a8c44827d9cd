"""The page of scenarios that were played: OUT/report.html, of one run as of a folder of files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from skidpad.core.text.wording import count_text
from skidpad.evidence.encounters import DISTANCE, TIME
from skidpad.evidence.play_verdicts import Counterpart, PlayVerdict
from skidpad.recording.run.log_files import read_log
from skidpad.report.crashes.cards import Found
from skidpad.report.crashes.page import contact_cards, find_contacts
from skidpad.report.elements.page import (
    Answer,
    Answers,
    Block,
    Cards,
    Cell,
    Definitions,
    Page,
    Section,
    Table,
    Text,
    write_page,
    write_report_page,
)
from skidpad.report.elements.readings import READING_COLUMNS, reading_rows
from skidpad.report.elements.tables import Column, Format, table
from skidpad.report.play.cards import run_anchor, run_card, run_title
from skidpad.report.play.runs import (
    Played,
    PlayRun,
    find_road,
    kmh_of,
    load_played,
    write_results_csv,
)

CARDS = "cards"  # folder of the runs that have a page of their own
BAD = 5  # reasons at the top
INLINE = 24  # runs with their card in the page
LARGE = 99  # s of TTC, m/s^2 of deceleration: beyond it a number says no more
KINDS = {
    PlayVerdict.PASSED: "good",
    PlayVerdict.FAILED: "bad",
    PlayVerdict.VOID: "bad",
    PlayVerdict.NOT_JUDGED: "muted",
    PlayVerdict.ERROR: "bad",
}
ONE = {
    PlayVerdict.PASSED: "The run passed.",
    PlayVerdict.FAILED: "The run failed.",
    PlayVerdict.VOID: "The run is void: it proves nothing.",
    PlayVerdict.NOT_JUDGED: "The run was not judged.",
    PlayVerdict.ERROR: "There is no complete run.",
}
ORDER = (
    PlayVerdict.ERROR,
    PlayVerdict.FAILED,
    PlayVerdict.VOID,
    PlayVerdict.NOT_JUDGED,
    PlayVerdict.PASSED,
)
MEANINGS = [
    ("passed", "", "The criterion is met, and the interaction that the file stages took place."),
    ("failed", "", "The criterion is not met."),
    (
        "void",
        "",
        (
            "The interaction did not take place, so the run proves nothing: an event that moves a "
            f"partner never began, or no partner came into play within {TIME:g} s or "
            f"{DISTANCE:g} m. A partner that crosses earlier or later is not in play, however near "
            "it stands."
        ),
    ),
    ("not judged", "", "There is no criterion."),
    ("error", "", "The file cannot be played, the stack failed, or the run did not reach its end."),
    (
        "gap",
        "m",
        "Bumper to bumper, while one of the two has the other in its way; least over the run.",
    ),
    ("TTC", "s", "Time to collision: the gap over the closing speed; least over the run."),
    (
        "required deceleration",
        "m/s²",
        (
            "Constant deceleration of the follower that avoids the contact, with the lead's own "
            "acceleration (Jansson 2005); largest over the run."
        ),
    ),
    ("speed at contact", "km/h", "Closing speed of the first contact."),
]


def write_play_report(out: Path) -> tuple[Played, Path]:
    """Judges the runs of a folder and writes results.csv and report.html; returns runs and page's path."""
    played = load_played(out)
    write_results_csv(played)
    return played, write_report_page(build_page(played), out)


def build_page(played: Played) -> Page:
    """Returns the page of judged runs; writes pages of the runs beyond INLINE beside it."""
    runs = in_order(played.runs)
    title = runs[0].scenario if len(runs) == 1 else f"{count_text(len(runs), 'run')} of scenarios"
    links = _links(played, runs)
    sections = [
        Section("Verdict", [_answers(played), *_matrix(runs, links)]),
        Section("Runs", [_runs_table(runs, links)]),
        Section("Counterparts", _counterparts(runs)),
        Section("Run by run", _cards(played, runs)),
        Section("Readings", _readings(runs)),
        Section("Crashes", _crashes(played, runs)),
        Section("Definitions", [Definitions(MEANINGS)]),
    ]
    return Page(title, answer(played), sections)


def in_order(runs: Iterable[PlayRun]) -> list[PlayRun]:
    """Returns the runs by verdict as in ORDER, those that need a look first, then by name."""
    return sorted(runs, key=lambda run: (ORDER.index(run.verdict), run.name))


def answer(played: Played) -> str:
    """Returns how many runs passed, in one sentence."""
    counts = Counter(run.verdict for run in played.runs)
    n = len(played.runs)
    if n == 1:
        return ONE[played.runs[0].verdict]
    rest = [f"{counts[v]} {_word(v)}" for v in ORDER if counts[v] and v is not PlayVerdict.PASSED]
    told = f"{counts[PlayVerdict.PASSED]} of {n} runs passed"
    return f"{told}; {', '.join(rest)}." if rest else f"{told}."


def _word(verdict: PlayVerdict) -> str:
    """Returns a verdict as the word for a sentence."""
    return "in error" if verdict is PlayVerdict.ERROR else verdict.value


def criterion(played: Played) -> str:
    """Returns by what the runs were judged, in one sentence."""
    known = list(dict.fromkeys(r.judged.criterion for r in played.runs if r.judged.criterion))
    if not known:
        return "No run came to its end, so none was judged."
    if len(known) == 1:
        return f"Criterion: {known[0]}."
    return f"{len(known)} criteria, named with each run: {'; '.join(known[:4])}."


def _answers(played: Played) -> Answers:
    """Returns the answers at the head of the page; what went wrong is told where a run is bad."""
    items = [
        Answer("Did it pass?", answer(played)),
        Answer("By which criterion?", criterion(played)),
    ]
    bad = in_order(played.bad)
    if bad:
        told = [f"{run.scenario}: {'; '.join(run.judged.reasons)}" for run in bad[:BAD]]
        more = [f"{len(bad) - BAD} more in the table below."] if len(bad) > BAD else []
        sentence = f"{count_text(len(bad), 'run')} failed, proved nothing or broke off."
        items.append(Answer("What went wrong?", sentence, [*told, *more]))
    return Answers(items)


def _links(played: Played, runs: Sequence[PlayRun]) -> dict[str, str]:
    """Writes a page of its own for each run beyond INLINE; returns where the card of each run stands."""
    links = {run.name: f"#{run_anchor(run)}" for run in runs[:INLINE]}
    for run in runs[INLINE:]:
        name = f"{run_anchor(run)}.html"
        card = run_card(run, played.out)
        section = Section(run_title(run), [card])
        write_page(Page(run.scenario, run.name, [section]), played.out / CARDS / name)
        links[run.name] = f"{CARDS}/{name}"
    return links


def _cards(played: Played, runs: Sequence[PlayRun]) -> list[Block]:
    """Returns the cards of the first INLINE runs, open for a bad verdict or a run alone."""
    blocks: list[Block] = []
    if len(runs) > INLINE:
        text = f"The {INLINE} runs that need a look most. The others are linked from the table."
        blocks.append(Text(text, tone="note"))
    for run in runs[:INLINE]:
        card = run_card(run, played.out)
        opened = not run.verdict.is_good or len(runs) == 1
        blocks.append(Cards(run_title(run), [card], open=opened))
    return blocks


def _matrix(runs: Sequence[PlayRun], links: dict[str, str]) -> list[Block]:
    """Returns the table of scenario by weather, the worst seed in each cell; empty for a single run."""
    columns = list(dict.fromkeys(_outside(run) for run in runs if run.weather))
    if len(runs) < 2 or not columns:
        return []
    worst: dict[tuple[str, str], PlayRun] = {}
    for run in runs:  # the worst first
        worst.setdefault((run.scenario, _outside(run)), run)
    rows = [
        [Cell(name), *(_verdict_cell(worst.get((name, c)), links) for c in columns)]
        for name in sorted({run.scenario for run in runs if run.weather})
    ]
    heads = [("scenario", ""), *((c, "") for c in columns)]
    note = "Of several seeds the worst one stands here."
    return [Table(heads, rows, "Scenario by weather", note if _seeds(runs) > 1 else "")]


def _seeds(runs: Sequence[PlayRun]) -> int:
    """Returns the number of different known seeds."""
    return len({run.seed for run in runs if run.seed is not None})


def _outside(run: PlayRun) -> str:
    """Returns the run's weather, with its friction where that is "original"."""
    return f"{run.weather}, {run.friction} friction" if run.friction == "original" else run.weather


def _verdict_cell(run: PlayRun | None, links: dict[str, str]) -> Cell:
    """Returns a cell with a run's verdict, least TTC in s and gap in m; "not driven" for None."""
    if run is None:
        return Cell("not driven", kind="muted")
    numbers = []
    if (ttc := run.least("min_ttc_s")) is not None:
        numbers.append(f"TTC {ttc:.2f} s")
    if (gap := run.least("min_gap_m")) is not None:
        numbers.append(f"gap {gap:.1f} m")
    return Cell(
        run.verdict.value, sort=ORDER.index(run.verdict), note=", ".join(numbers),
        kind=KINDS[run.verdict], href=links[run.name], hint="; ".join(run.judged.reasons),
    )  # fmt: skip


def _runs_table(runs: Sequence[PlayRun], links: dict[str, str]) -> Table:
    """Returns the table of runs, in the order given, with a column of seeds where there are several."""
    columns: list[Column[PlayRun]] = [
        Column("scenario", lambda r: Cell(r.scenario, href=links[r.name])),
        Column("weather", _outside),
        Column("seed", lambda r: r.seed, format=Format("d")),
        Column("verdict", _plain_verdict),
        *MEASURES,
        Column("touched", lambda r: r.contact[1] if r.contact else None, format=Format(absent="-")),
        Column("time", lambda r: r.duration, unit="s", format=Format(".1f", absent="-")),
    ]
    if _seeds(runs) < 2:
        columns = [c for c in columns if c.title != "seed"]
    caption = "All runs, those that need a look first" if len(runs) > 1 else ""
    return table(columns, runs, caption)


def _plain_verdict(run: PlayRun) -> Cell:
    """Returns a cell with the run's verdict, its reasons as hint."""
    return Cell(run.verdict.value, kind=KINDS[run.verdict], hint="; ".join(run.judged.reasons))


def _format_bounded(value: float | None, spec: str) -> Cell:
    """Returns a number as a cell, one from LARGE on as ">99"; a dash for None."""
    if value is None:
        return Cell("-", kind="muted")
    return Cell(format(value, spec) if value < LARGE else f">{LARGE}", sort=value)


MEASURES: list[Column[PlayRun]] = [
    Column("least gap", lambda r: r.least("min_gap_m"), unit="m", format=Format(".1f", absent="-")),
    Column("least TTC", lambda r: _format_bounded(r.least("min_ttc_s"), ".2f"), unit="s"),
    Column(
        "required deceleration", lambda r: _format_bounded(r.most("max_required_mps2"), ".1f"),
        unit="m/s²",
    ),
    Column(
        "speed at contact", lambda r: kmh_of(r.contact and r.contact[2]), unit="km/h",
        format=Format(".0f", absent="-"),
    ),
]  # fmt: skip
Of = tuple[PlayRun, Counterpart]


def _counterparts(runs: Sequence[PlayRun]) -> list[Block]:
    """Returns the table of the ego and each other actor; empty where no run has another."""
    rows = [(run, other) for run in runs for other in run.others]
    if not rows:
        return []
    note = (
        "A partner is moved by an event of the file. In play: the two came within "
        f"{TIME:g} s or {DISTANCE:g} m of an interaction. Numbers are with the ego."
    )
    return [table(COUNTERPARTS, rows, "The ego and each other actor", note)]


COUNTERPARTS: list[Column[Of]] = [
    Column("scenario", lambda o: o[0].scenario),
    Column("weather", lambda o: _outside(o[0])),
    Column("actor", lambda o: o[1].name),
    Column("partner", lambda o: "yes" if o[1].staged else "no"),
    Column("in play", lambda o: Cell("yes" if o[1].encounter.met else "no")),
    Column("least distance", lambda o: o[1].encounter.distance, unit="m", format=Format(".1f")),
    Column("least gap", lambda o: o[1].pair.min_gap_m, unit="m", format=Format(".1f", absent="-")),
    Column("least TTC", lambda o: _format_bounded(o[1].pair.min_ttc_s, ".2f"), unit="s"),
    Column("least PET", lambda o: o[1].pair.min_pet_s, unit="s", format=Format(".2f", absent="-")),
    Column(
        "required deceleration", lambda o: _format_bounded(o[1].pair.max_required_mps2, ".1f"),
        unit="m/s²",
    ),
    Column(
        "speed at contact", lambda of: kmh_of(of[1].contact_v), unit="km/h",
        format=Format(".0f", absent="-"),
    ),
]  # fmt: skip


def _readings(runs: Sequence[PlayRun]) -> list[Block]:
    """Returns a table of what was recorded beside the log in the first INLINE runs, or nothing."""
    rows = [
        [Cell(run.scenario), Cell(_outside(run)), *row]
        for run in runs[:INLINE]
        if run.folder is not None
        for row in reading_rows(run.folder)
    ]
    columns = (("scenario", ""), ("weather", ""), *READING_COLUMNS)
    which = f", the {INLINE} runs that need a look most" if len(runs) > INLINE else ""
    title = f"Readings of further sensors and functions{which}"
    return [Table(columns, rows, title)] * bool(rows)


def _crashes(played: Played, runs: Sequence[PlayRun]) -> list[Block]:
    """Returns cards of the ego's hardest crashes; empty without contacts."""
    found: list[Found] = []
    for run in runs:
        if run.contact is not None and run.folder is not None:
            log = read_log(run.folder)
            road = find_road(played.out, log.header)
            found += find_contacts(log, road, run.folder)
    return [] if not found else [contact_cards(found)]
