"""What a reader of the matrix asks first, each in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from skidpad.evidence.contrasts import paired_runs, per_seed
from skidpad.evidence.statistics import Rate, compare_pairs, interval_text, p_text
from skidpad.evidence.verdicts import Judgement
from skidpad.report.figures import POINTS, Chart, Curve, curves
from skidpad.report.matrix_data import Matrix, config_title, rate_by_seed, weather_title
from skidpad.report.page import Answers, Figure
from skidpad.report.verdicts import least_seeds_text, seeds_text, tally_text

FATAL = "fatal_collisions"
ALPHA = 0.05


def answers(matrix: Matrix, judged: Sequence[Judgement]) -> Answers:
    """Which functions, which weather, how sure."""
    configs = {c: rate for c in matrix.configs if (rate := matrix.rate(FATAL, c)) is not None}
    weathers = {w: rate for w in matrix.weathers if (rate := _in_weather(matrix, w)) is not None}
    seeds = matrix.results["seed"].n_unique()
    return Answers(
        [
            (
                "Which functions crash least?",
                _extremes(matrix, "config", configs, {c: config_title(c) for c in configs}),
            ),
            (
                "Which weather is the worst?",
                _extremes(matrix, "weather", weathers, {w: weather_title(w) for w in weathers}),
            ),
            ("How sure is that?", _sure(seeds, judged)),
        ]
    )


def _sure(seeds: int, judged: Sequence[Judgement]) -> str:
    return f"{seeds_text(seeds)} {tally_text(judged)}{least_seeds_text(judged)}"


def _in_weather(matrix: Matrix, weather: str) -> Rate | None:
    return rate_by_seed(matrix.finished.filter(pl.col("weather") == weather), FATAL)


def _extremes(matrix: Matrix, factor: str, rates: dict[str, Rate], titles: dict[str, str]) -> str:
    """The level of a factor with the fewest fatal collisions against that with the most."""
    if not rates:
        return "No run was finished."
    least, most = (choose(rates, key=lambda v: rates[v].rate) for choose in (min, max))
    if len(rates) == 1:
        return f"Only {titles[least]} was driven: {_rate(rates[least])}."
    text = f"{titles[most]} has the most fatal collisions, {_rate(rates[most])}; "
    text += f"{titles[least]} the fewest, {_rate(rates[least])}."
    by = [name for name in ("config", "weather", "seed") if name != factor]
    more, less = (pl.col(factor) == level for level in (most, least))
    pairs, same = paired_runs(matrix.finished, more, less, by, FATAL)
    if not len(pairs) or same:
        return text + " Both are the same drives."
    values = per_seed(pairs, pl.col("difference"))
    p = compare_pairs(values).p
    told = "differ beyond chance" if p < ALPHA else "cannot be told apart"
    return f"{text} Paired by seed the two {told} ({p_text(p)}, {len(values)} seeds)."


def _rate(rate: Rate) -> str:
    return f"{rate.rate:.2f} per run ({interval_text(rate.interval)})"


def speed_figure(matrix: Matrix) -> Figure:
    """Fatal collisions against mean speed, one point per configuration and weather."""
    clouds = []
    for config in matrix.configs:
        cells = [
            (speed, rate.rate)
            for weather in matrix.weathers
            if (rate := matrix.rate(FATAL, config, weather)) is not None
            and (speed := matrix.mean("mean_speed_kmh", config, weather)) is not None
        ]
        if cells:
            x, y = zip(*cells, strict=True)
            clouds.append(Curve(config_title(config), x, y, style=POINTS))
    chart = Chart(clouds, "mean speed, km/h", "fatal collisions per run")
    caption = (
        "Fatal collisions against mean speed, one point per configuration and weather; what "
        "merely drives slower moves to the left as it moves down."
    )
    return Figure(curves([chart], height=3.6), caption)
