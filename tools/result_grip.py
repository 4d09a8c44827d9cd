"""Tables of friction campaigns, from what lies in docs/results alone."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from result_texts import limits, markdown, verdict_rows
from skidpad.evidence.grip import study
from skidpad.evidence.grip.findings import FINDINGS
from skidpad.evidence.grip.rain import CELLS, four_cells
from skidpad.evidence.grip.study import Pair, Share
from skidpad.evidence.verdicts import judge
from skidpad.recording.campaign.results import read_results
from skidpad.report.grip.data import PAIRED, load_grip, scenario_title
from skidpad.report.grip.threshold import load_threshold

DELAYS = "delays.parquet"


def keep_delays(campaign: Path, kept: Path) -> None:
    """The delays of pairs, which are found in series that are not kept."""
    table = load_grip(campaign).with_delays()
    if "delay_s" in table.columns:
        table.select(*PAIRED, "delay_s").drop_nulls().write_parquet(kept / DELAYS)


def completion(folder: Path) -> str:
    """Completion in percent, by weather, scenario and friction, and what reduced friction changes."""
    campaign = load_grip(folder)
    head = ["weather"]
    for scenario in campaign.scenarios:
        head += [f"{scenario_title(scenario)}, original", "reduced"]
    weathers = dict.fromkeys(weather for _, weather in campaign.pairs)

    def cells(pair: Pair | None) -> list[str]:
        if pair is None:
            return ["no run", "no run"]
        return [percent(study.completion(pair.original)), percent(study.completion(pair.reduced))]

    rows = [
        [w, *(c for s in campaign.scenarios for c in cells(campaign.pairs.get((s, w))))]
        for w in weathers
    ]
    return markdown(head, rows)


def percent(share: Share) -> str:
    """`97 [91, 99]`."""
    if share.value is None:
        return "no run"
    low, high = (100.0 * end for end in share.interval)
    return f"{100.0 * share.value:.0f} [{low:.0f}, {high:.0f}]"


def claims(folder: Path) -> str:
    """Every claim of the study, with the delays that were kept."""
    table = load_grip(folder).plain
    if (folder / DELAYS).is_file():
        table = table.join(pl.read_parquet(folder / DELAYS), on=PAIRED, how="left")
    return verdict_rows(judge(FINDINGS, [table] * len(FINDINGS)))


def thresholds(folder: Path) -> str:
    """The friction at which half of the drives have ended in an accident."""
    found = load_threshold(folder).situations
    braking = sorted({s.deceleration for s in found})
    by_row: dict[tuple[str, str, str], dict[float, str]] = {}
    for s in found:
        text = s.threshold.text if s.tells else "not on dry road"
        by_row.setdefault((s.driver, s.actors, s.start), {})[s.deceleration] = text
    head = ["driver", "lead", "start", *(f"{b:g} m/s²" for b in braking)]
    return markdown(
        head, [[*key, *(row.get(b, "no run") for b in braking)] for key, row in by_row.items()]
    )


def threshold_verdicts(folder: Path) -> str:
    """How often each claim was judged how, over the situations that are completed on dry road."""
    telling = load_threshold(folder).telling
    counts: dict[str, dict[str, int]] = {}
    for situation in telling:
        for j in situation.judgements:
            row = counts.setdefault(f"{j.finding.id}: {j.finding.claim}", {})
            row[j.verdict.value] = row.get(j.verdict.value, 0) + 1
    verdicts = sorted({v for row in counts.values() for v in row})
    head = [f"claim, in {len(telling)} situations", *verdicts]
    return markdown(
        head, [[c, *(str(row.get(v, 0)) for v in verdicts)] for c, row in counts.items()]
    )


def rain_parted(folder: Path) -> str:
    """Completion, least distance and steering in the four cells, and the effects of lens and road."""
    table = read_results(folder)
    head = ["quantity", "scenario", "weather", "seeds", *CELLS, "lens", "road", "beyond their sum"]
    rows = []
    for quantity in ("completion", "min_cvip_m", "steer_std"):
        for cell in four_cells(table, quantity):
            effects = (cell.visual, cell.physical, cell.interaction)
            rows.append(
                [
                    quantity, scenario_title(cell.scenario), cell.weather, str(cell.n),
                    *(f"{cell.means[name]:.3g}" for name in CELLS),
                    *(f"{e.mean:+.3g} {limits(e.interval)}" for e in effects),
                ]
            )  # fmt: skip
    return markdown(head, rows)
