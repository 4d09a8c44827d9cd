"""What a reader of the matrix asks first: which functions, what the weather changes, what comes next."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import polars as pl

from skidpad.core.text.wording import capitalize_first, count_text, list_text
from skidpad.evidence.statistics import UNITS_FROM, Interval, Rate, seeds_for_verdict
from skidpad.evidence.statistics_text import p_text
from skidpad.evidence.verdicts import Judgement
from skidpad.report.crashes.cards import Found
from skidpad.report.elements.figures import POINTS_REACH, Series, cut_note, points_with_intervals
from skidpad.report.elements.page import Answer, Answers, Figure
from skidpad.report.matrix.comparisons.contrasts import Contrast, by_configuration, by_weather
from skidpad.report.matrix.crashes import Cell
from skidpad.report.matrix.data import (
    EVENT,
    EVENTS,
    REFERENCE,
    Matrix,
    WeatherGroup,
    config_list,
    config_title,
    functions_list,
    rate_by_seed,
)
from skidpad.report.matrix.next import look_next

MEANS = (("mean_speed_kmh", "mean speed", "km/h"), ("dropout_pct", "dropout", "%"))
COLOURS = {"clear sky": 1, "heavy rain": 0}  # of the palette
MARKERS = "ovsD^P*X"


def answers(
    matrix: Matrix, judged: Sequence[Judgement], crashes: dict[Cell, list[Found]]
) -> Answers:
    """Returns the three answers at the head of the report, each with its picture; one without runs."""
    if not len(matrix.finished):
        return Answers([Answer("What happened?", "No run was finished.")])
    return Answers([_functions(matrix), _weather(matrix), look_next(matrix, judged, crashes)])


def terminal_answer(matrix: Matrix) -> list[str]:
    """Returns the first two answers as lines and a last line `Next: <command>`.

    One line alone where no run was finished.
    """
    if not len(matrix.finished):
        return ["No run was finished."]
    functions, weather = _functions(matrix), _weather(matrix)
    return [functions.sentence, *functions.lines, weather.sentence, _next_command(matrix)]


def _next_command(matrix: Matrix) -> str:
    """Returns the line with the command that shows the run with the most crashes of those that were kept.

    Of the compared configurations; without a log that was kept, the command that compares campaigns.
    """
    runs = matrix.finished.filter(pl.col("config").is_in(matrix.comparison_configs))
    runs = runs.sort(EVENTS, "config", "weather", "seed", descending=[True, *[False] * 3])
    for name, crashes in zip(matrix.names(runs), runs[EVENTS], strict=True):
        folder = matrix.folder.log(name)
        if folder is not None:
            with_crashes = f"the run with {count_text(crashes or 0, EVENT, EVENTS)}"
            told = with_crashes if crashes else f"a run without a {EVENT}"
            return f"Next: skidpad show {folder} tells of {told}"
    return f"Next: skidpad compare {matrix.folder.path} OTHER says what another campaign changes"


# --- which functions


def _functions(matrix: Matrix) -> Answer:
    """Returns the answer on the functions with the fewest crashes in each weather, and how sure it is.

    The reference driver is a model of a human and has no functions, so it is told beside them.
    """
    differences = by_configuration(matrix, matrix.climates)
    rates = {g: _rates(matrix, g) for g in matrix.climates}
    judged = {g: {c: r[c] for c in r if c != REFERENCE} or r for g, r in rates.items()}
    best = {g: min(r, key=lambda c: r[c].rate) for g, r in judged.items() if r}
    without = _without_crashes(judged)
    least = seeds_for_verdict(len(differences))
    several = len(matrix.comparison_configs) > 1
    sure = {g for (g, _, _), d in differences.items() if d.is_sure and matrix.seeds >= least}
    named = {g: c for g, c in best.items() if g in sure or not several}
    unsure = {g: judged[g] for g in best if g not in named}
    if without:
        first = without[0]
    else:  # a name where nothing is sure would read as a rank
        parts = [_fewest(g, judged[g], judged[g][c].rate) for g, c in named.items()]
        told = [f"Of the configurations, fewest {EVENTS}: {'; '.join(parts)}."] if parts else []
        first = " ".join([*told, *_range_sentences(unsure)])
    sentence = f"{first}{_beside_reference(rates, judged)}"
    if not several:
        lines = without[1:]
    elif matrix.seeds < least:
        lines = [*without[1:], _too_few_seeds(matrix.seeds, least)]
    elif without:
        lines = without[1:]
    else:
        if not named:
            sentence = (
                f"{count_text(matrix.seeds, 'seed')} are too few to rank the configurations: every "
                f"difference between two of them may be chance. {sentence}"
            )
        told = [_sureness(g, c, differences, judged[g][c]) for g, c in named.items()]
        if named:
            told += [
                f"{capitalize_first(g.name)}: every difference between two configurations may be chance."
                for g in unsure
            ]
        lines = [line for line in told if line]
    return Answer(
        "Which functions crash least, in which weather, and how sure is that?",
        sentence,
        lines,
        _rate_figure(matrix, rates),
    )


def _without_crashes(judged: dict[WeatherGroup, dict[str, Rate]]) -> list[str]:
    """Returns two sentences where no configuration had a crash, with what that still allows; else nothing."""
    rates = [rate for by_config in judged.values() for rate in by_config.values()]
    if not rates or any(rate.events for rate in rates):
        return []
    configs = list(dict.fromkeys(c for by_config in judged.values() for c in by_config))
    weathers = " or ".join(group.name for group in judged)
    fewest = min(rate.runs for rate in rates)
    allowed = _allow("one", rates)
    return [
        f"{capitalize_first(config_list(configs))} had no {EVENT} in {weathers}.",
        f"No {EVENT} in {count_text(fewest, 'seed')} {allowed} (95 % confidence).",
    ]


def _fewest(group: WeatherGroup, rates: dict[str, Rate], least: float) -> str:
    """Returns a clause on all configurations that share the least rate of a group of weathers.

    Where all share it, without their functions. least: events per run.
    """
    found = [c for c, rate in rates.items() if rate.rate == least]
    all_alike = len(found) == len(rates) > 1
    named = f"{config_list(found)} alike" if all_alike else functions_list(found)
    return f"in {group.name} {named} with {least:.2f} per run"


def _range_sentences(judged: dict[WeatherGroup, dict[str, Rate]]) -> list[str]:
    """Returns sentences with the least and the largest rate in each weather, without a name."""
    alike, spread = [], []
    for group, rates in judged.items():
        low, *rest = sorted({f"{rate.rate:.2f}" for rate in rates.values()}, key=float)
        if rest:
            spread.append(f"{low} to {rest[-1]} in {group.name}")
        else:
            alike.append(f"{low} {EVENTS} per run in {group.name}")
    told = [f"All configurations had {list_text(alike)}."] if alike else []
    if spread:
        told.append(f"All configurations lie within these {EVENTS} per run: {'; '.join(spread)}.")
    return told


def _beside_reference(
    rates: dict[WeatherGroup, dict[str, Rate]], judged: dict[WeatherGroup, dict[str, Rate]]
) -> str:
    """Returns a sentence with the rates of the reference driver where it is not judged; "" otherwise."""
    found = {
        g: r[REFERENCE] for g, r in rates.items() if REFERENCE in r and REFERENCE not in judged[g]
    }
    if not found:
        return ""
    told = list_text([f"{rate.rate:.2f} in {group.name}" for group, rate in found.items()])
    if not any(rate.events for rate in found.values()):
        told += f", which {_allow(f'a {EVENT}', found.values())}"
    return f" The reference driver, a model of a careful human, had {told}."


def _allow(what: str, rates: Iterable[Rate]) -> str:
    """Returns what rates without an event still allow, at 95 % confidence, of the widest of them."""
    share = 100 * max(rate.most_runs for rate in rates)
    return f"still allows {what} in up to {share:.0f} % of seeds"


def _too_few_seeds(seeds: int, least: int) -> str:
    """Returns the sentence that says why so few seeds show no differences; least: seeds it takes."""
    return (
        f"{count_text(seeds, 'seed')} per cell cannot tell two configurations apart: what differs "
        f"may be chance. It takes at least {least} (`--seeds {least}`)."
    )


def _rates(matrix: Matrix, group: WeatherGroup) -> dict[str, Rate]:
    """Returns the event rate by configuration in a group of weathers; unknown ones are left out."""
    found = {c: rate_by_seed(matrix.within(c, group), EVENTS) for c in matrix.comparison_configs}
    return {c: rate for c, rate in found.items() if rate is not None}


def _sureness(
    group: WeatherGroup,
    best: str,
    differences: dict[tuple[WeatherGroup, str, str], Contrast],
    rate: Rate,
) -> str:
    """Returns a sentence on which others the best one of a group surely beats, or may by chance.

    "" where there is nothing to say. Where chance may explain all, a sentence before says so.
    """
    others = {
        (a if b == best else b): c
        for (g, a, b), c in differences.items()
        if g == group and best in (a, b)
    }
    sure = [c for c, d in others.items() if d.is_sure]
    same = [c for c, d in others.items() if d.identical]
    open_ = [c for c in others if c not in sure and c not in same]
    told = []
    if sure:
        largest = max(others[c].p for c in sure)
        told.append(f"it has surely fewer {EVENTS} than {config_list(sure)} ({_at_most(largest)})")
    if open_:
        told.append(f"its difference from {config_list(open_)} may be chance")
    if same:
        told.append(f"it drove exactly as {config_list(same)}")
    if not rate.events:
        told.append(
            f"none of its {count_text(rate.runs, 'seed')} had a {EVENT}, which {_allow('one', [rate])} "
            "(95 % confidence)"
        )
    return (
        f"{capitalize_first(group.name)}, {config_list([best])}: {'; '.join(told)}." if told else ""
    )


def _at_most(p: float) -> str:
    """Returns "p at most" with two digits, or the usual text of p where it is below 0.001."""
    return p_text(p) if p < 0.001 else f"p at most {p:.2g}"


def weather_series(group: WeatherGroup, k: int, **values: Sequence[float | None]) -> Series:
    """Returns a series in the colour and with the mark of its weather; k: its place in the figure."""
    colour = COLOURS.get(group.name, 2 + k)
    return Series(group.name, colour=colour, marker=MARKERS[k % len(MARKERS)], **values)


def _rate_figure(matrix: Matrix, rates: dict[WeatherGroup, dict[str, Rate]]) -> Figure:
    """Returns the figure of events per run by configuration, a series per group of weathers."""
    series = []
    for k, (group, by_config) in enumerate(rates.items()):
        found = [by_config.get(c) for c in matrix.comparison_configs]
        limits = [ends(r.interval if r else None) for r in found]
        low, high = zip(*limits, strict=True)
        values = [r.rate if r else None for r in found]
        series.append(weather_series(group, k, values=values, low=low, high=high))
    rows = [config_title(c) for c in matrix.comparison_configs]
    caption = (
        f"{EVENTS.capitalize()} per run of {matrix.duration:g} s; a run goes on after one. Lines are "
        f"95 % intervals. A hollow point has none: "
    )
    if matrix.seeds < UNITS_FROM:
        caption += f"an interval takes {UNITS_FROM} seeds."
    else:
        caption += f"at most one seed had a {EVENT}, and one seed does not say how others vary."
    caption += cut_note(series, POINTS_REACH)
    return Figure(points_with_intervals(rows, series, f"{EVENTS} per run"), caption)


def ends(interval: Interval | None) -> tuple[float | None, float | None]:
    """Returns the ends of an interval, None for infinite ones and for no interval."""
    if interval is None:
        return None, None
    low, high = (None if abs(end) == float("inf") else end for end in interval)
    return low, high


# --- what the weather changes


def _weather(matrix: Matrix) -> Answer:
    """Returns the answer on what weather changes: every climate against the first, by configuration."""
    question = "What does the weather change?"
    first, *rest = matrix.climates
    if not rest:
        return Answer(question, f"Only {first.name} was driven.", _times_of_day(matrix))
    changes = by_weather(matrix)
    least = seeds_for_verdict(len(changes))
    told = [_changes(matrix, group, changes) for group in rest]
    if matrix.seeds < least:
        told = [_too_few_seeds(matrix.seeds, least).replace("configurations", "weathers")]
    lines = [_levels(matrix, c) for c in matrix.comparison_configs]
    return Answer(
        question,
        " ".join(told),
        [*_meaning(matrix), *lines, *_times_of_day(matrix)],
        _change_figure(matrix, rest, changes) if matrix.seeds > 1 else None,
    )


def _changes(
    matrix: Matrix, group: WeatherGroup, changes: dict[tuple[str, WeatherGroup], Contrast]
) -> str:
    """Returns a sentence: for which configurations a climate surely changes the crashes."""
    mine = {c: changes[c, group] for c in matrix.comparison_configs if (c, group) in changes}
    more = [c for c, d in mine.items() if d.is_sure and d.mean > 0.0]
    fewer = [c for c, d in mine.items() if d.is_sure and d.mean < 0.0]
    same = [c for c, d in mine.items() if d.identical]
    open_ = [c for c in mine if c not in (*more, *fewer, *same)]
    parts = [
        f"{word} {config_list(configs)}"
        for word, configs in (
            (f"more {EVENTS} with", more),
            (f"fewer {EVENTS} with", fewer),
            ("the very same drives with", same),
            (f"chance may explain every change of {EVENTS} with", open_),
        )
        if configs
    ]
    base = matrix.climates[0].name
    return f"{capitalize_first(group.name)} against {base}: {'; '.join(parts)}."


def _levels(matrix: Matrix, config: str) -> str:
    """Returns a line on a configuration in every climate: crashes per run, speed, dropout."""
    groups = {g: matrix.within(config, g) for g in matrix.climates}
    rates = {g: rate for g, r in groups.items() if (rate := rate_by_seed(r, EVENTS)) is not None}
    between = " → " if len(groups) == 2 else ", "
    if len(rates) == len(groups) == 2:
        told = between.join(f"{rate.rate:.2f}" for rate in rates.values())
    else:
        told = ", ".join(f"{rate.rate:.2f} in {g.name}" for g, rate in rates.items())
    parts = [f"{EVENTS} per run {told}"]
    for column, title, unit in MEANS:
        values = [runs[column].drop_nulls() for runs in groups.values()]
        if all(len(v) for v in values):
            parts.append(
                f"{title} {between.join(f'{float(v.to_numpy().mean()):.1f}' for v in values)} {unit}"
            )
    return f"{config_title(config)}: {'; '.join(parts)}."


def _meaning(matrix: Matrix) -> list[str]:
    """Returns what the arrows and the word dropout mean as one line; empty where neither is used."""
    told = []
    if len(matrix.climates) == 2:
        first, second = matrix.climates
        told.append(f"Read each arrow as {first.name} → {second.name}.")
    if matrix.finished["dropout_pct"].count():
        told.append("Dropout is the share of time without a current measurement of the car ahead.")
    return [" ".join(told)] if told else []


def _times_of_day(matrix: Matrix) -> list[str]:
    """Returns a line on weathers that every configuration drove alike; empty without any."""
    groups = [g for g in matrix.weather_groups if len(g.weathers) > 1]
    if not groups:
        return []
    names = list_text([f"“{g.title}”" for g in groups])
    return [f"In {names} each seed gave the same drive, so these count once."]


def _change_figure(
    matrix: Matrix,
    groups: Sequence[WeatherGroup],
    changes: dict[tuple[str, WeatherGroup], Contrast],
) -> Figure:
    """Returns the figure of events per run that each weather adds to the first one, by configuration."""
    series = []
    for k, group in enumerate(groups, start=1):
        found = [changes.get((c, group)) for c in matrix.comparison_configs]
        low, high = zip(*(ends(d.interval if d else None) for d in found), strict=True)
        values = [d.mean if d else None for d in found]
        series.append(weather_series(group, k, values=values, low=low, high=high))
    rows = [config_title(c) for c in matrix.comparison_configs]
    base = matrix.climates[0].name
    label = f"{EVENTS} per run, minus those in {base}"
    caption = (
        f"What each weather adds to the {EVENTS} per run in {base}, paired by seed; to the right of "
        "the rule is worse. Lines are 95 % intervals of each difference by itself."
    )
    if matrix.seeds >= seeds_for_verdict(len(changes)):
        caption += f" The sentence above is corrected for judging {len(changes)} of them at once."
    caption += cut_note(series, POINTS_REACH)
    return Figure(points_with_intervals(rows, series, label, origin=0.0), caption)
