"""The report of a threshold map: from results.parquet to curves, a map and verdicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import polars as pl

from skidpad.core.errors import FileError
from skidpad.core.text.wording import count_text
from skidpad.evidence.grip.threshold import JUDGED, Situation, situations
from skidpad.evidence.verdicts import Judgement, Verdict
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.threshold import THRESHOLD, ThresholdEntry
from skidpad.recording.run.surfaces import read_surfaces
from skidpad.report.elements.campaign import CampaignView
from skidpad.report.elements.page import (
    Answer,
    Answers,
    Block,
    Card,
    Cards,
    Cell,
    Figure,
    Number,
    Numbers,
    Page,
    Section,
    Text,
    write_report_page,
)
from skidpad.report.elements.replay import replay
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.elements.verdicts import least_seeds_text, seeds_text
from skidpad.report.grip.tables import share
from skidpad.report.grip.threshold_figures import curve_figures, map_figure

DRIVERS = {"acc": "ACC", "aeb": "AEB alone", "camera": "Camera"}
SHARE = Format(".0f", ".0f", "no run")
MU = Format(".2f", ".2f")
LEAD = """The ego follows a lead at a headway, and the lead brakes to a stop. Each drive is repeated with \
the same seed on less and less friction, equal for both, on a road that looks dry. The threshold is the \
friction at which half of the drives have ended in an accident, coming from dry road; its interval, 95 % by \
order statistics over seeds, is widened by the distance of the driven levels.

A situation is shown where at least 95 % are completed on dry road: only there an accident is due to \
friction. `physical`: the lead's tyres decide how hard it can brake, so that it slides as the ego does. \
`ideal`: it brakes as demanded on any road, as one with better tyres, or one that hits something."""
FINDINGS_TEXT = """The study's claims on a lead that slows down, on levels that its weathers leave by \
its own ratio; dry road stands for its original friction. Each situation is judged by itself, with p values \
adjusted within it: of many situations some would be judged wrongly by chance."""


@dataclass(frozen=True)
class ThresholdMap(CampaignView[ThresholdEntry]):
    """A campaign over levels of friction."""

    columns = THRESHOLD
    common = ("driver", "actors", "version")

    @cached_property
    def situations(self) -> list[Situation]:
        """Returns all situations that were driven."""
        return situations(self.results)

    @cached_property
    def telling(self) -> list[Situation]:
        """Returns the situations that are completed on dry road."""
        return [s for s in self.situations if s.tells]

    @cached_property
    def reached_situations(self) -> list[Situation]:
        """Returns the telling situations in which half of the drives have an accident on some level."""
        return [s for s in self.telling if s.threshold.mu is not None]


def load_threshold(folder: Path) -> ThresholdMap:
    """Returns the threshold map in a folder; FileError when it holds no results of one."""
    found = ThresholdMap(CampaignFolder(folder, ThresholdEntry))
    if "deceleration" not in found.results.columns:
        raise FileError(f"{folder} holds no threshold map")
    return found


def write_threshold_report(folder: Path) -> Path:
    """Writes report.html into a campaign's folder; returns its path."""
    return write_report_page(build_page(load_threshold(folder)), folder)


def build_page(campaign: ThresholdMap) -> Page:
    """Returns the report page of a threshold map."""
    first: list[Block] = [_answers(campaign), _headline(campaign), Text(LEAD)]
    sections = [
        Section("What happened", [*campaign.missing(), *first]),
        Section("The map", _map(campaign)),
        Section("Completion over friction", _curves(campaign)),
        Section("Findings of the source, judged", _findings(campaign)),
        Section("Accidents", _replays(campaign)),
        Section("Definitions", [campaign.definitions()]),
        Section("Configuration and versions", campaign.provenance()),
    ]
    subtitle = (
        f"{count_text(len(campaign.situations), 'situation')} on "
        f"{count_text(campaign.results['road_mu'].n_unique(), 'level')} of friction, "
        f"{count_text(campaign.results['seed'].n_unique(), 'repeat')}."
    )
    return Page("Threshold of grip", subtitle, sections, campaign.facts())


def _answers(campaign: ThresholdMap) -> Answers:
    """Returns the answers of a threshold map: whether, where and for which driver friction decides."""
    telling, reached = campaign.telling, campaign.reached_situations
    asked = (
        f"{len(telling)} of {len(campaign.situations)} situations are completed on dry road; in "
        f"{len(reached)} of these half of the drives end in an accident on some level of friction."
    )
    items = [Answer("Does friction decide?", asked)]
    if reached:
        most = max(reached, key=lambda s: s.threshold.mu or 0.0)
        items.append(Answer("Where first?", f"{title(most)}: at friction {most.threshold.text}."))
    told = [
        f"{DRIVERS.get(driver, driver)} with {actors} actors {n} of {of}"
        for (driver, actors), (n, of) in _tally(campaign).items()
    ]
    items.append(Answer("Which driver reaches a threshold?", f"{'; '.join(told)} situations."))
    seeds = campaign.results["seed"].n_unique()
    least = least_seeds_text(telling[0].judgements) if telling else ""
    items.append(Answer("How sure is that?", seeds_text(seeds) + least))
    return Answers(items)


def _tally(campaign: ThresholdMap) -> dict[tuple[str, str], tuple[int, int]]:
    """Returns (situations with a threshold, situations completed on dry road) by driver and actors."""
    found = {}
    for key in dict.fromkeys((s.driver, s.actors) for s in campaign.situations):
        mine = [s for s in campaign.telling if (s.driver, s.actors) == key]
        found[key] = (sum(s.threshold.mu is not None for s in mine), len(mine))
    return found


def _headline(campaign: ThresholdMap) -> Numbers:
    """Returns the head numbers: runs, situations completed on dry road, situations with a threshold."""
    n = len(campaign.situations)
    items = [
        Number(f"{len(campaign.results)}", "runs", f"{n} situations"),
        Number(f"{len(campaign.telling)}", "completed on dry road", "at least 95 % of drives"),
        Number(
            f"{len(campaign.reached_situations)}", "with a threshold", "half of the drives collide"
        ),
    ]
    return Numbers(items)


def title(s: Situation) -> str:
    """Returns a situation in words."""
    driver = DRIVERS.get(s.driver, s.driver)
    return f"{driver}, {s.actors} lead, {s.start}, {s.deceleration:g} m/s²"


def groups(campaign: ThresholdMap) -> dict[str, list[Situation]]:
    """Returns the situations by driver and by how the lead is moved, under a name for people."""
    found: dict[str, list[Situation]] = {}
    for s in campaign.situations:
        name = f"{DRIVERS.get(s.driver, s.driver)}, {s.actors} lead"
        found.setdefault(name, []).append(s)
    return found


def _map(campaign: ThresholdMap) -> list[Block]:
    """Returns the figure of thresholds and the table of situations completed on dry road."""
    caption = (
        "Friction at which half of the drives have ended in an accident, by headway and by what is "
        "demanded of the lead. Grey: not completed on dry road. <: no such level down to the least "
        "that was driven."
    )
    columns = (
        Column[Situation]("driver", lambda s: DRIVERS.get(s.driver, s.driver)),
        Column[Situation]("lead", lambda s: s.actors),
        Column[Situation]("start", lambda s: Cell(s.start, sort=s.gap_m)),
        Column[Situation]("deceleration", lambda s: s.deceleration, unit="m/s²"),
        Column("baseline", lambda s: share(s.baseline), "completed on dry road", "%", SHARE),
        Column("threshold", _threshold, "friction at which half have had an accident", "", MU),
        Column(
            "completed again",
            lambda s: share(s.recovered_share),
            "of the drives below their seed's critical friction; not 0: less grip can be milder",
            "%",
            SHARE,
        ),
        *(
            Column(
                f"at {mu:.2g}",
                partial(_completion_at, mu),
                "completed on this friction",
                "%",
                SHARE,
            )
            for mu in sorted(campaign.results["road_mu"].unique().to_list(), reverse=True)[1:]
        ),
    )
    rows = table(columns, campaign.telling, "Thresholds", "Small: 95 % interval.")
    return [Figure(map_figure(groups(campaign)), caption), rows]


def _threshold(s: Situation) -> Quantity:
    """Returns a situation's threshold friction with its interval; text alone where there is none."""
    found = s.threshold
    if found.mu is None:
        return Quantity(value=None, lines=(found.text,))
    return Quantity(value=found.mu, interval=found.interval, heat=found.mu)


def _completion_at(mu: float, s: Situation) -> Quantity:
    """Returns the share completed at the friction `mu` in a situation."""
    return share(s.at(mu))


def _curves(campaign: ThresholdMap) -> list[Block]:
    """Returns a figure per group of the share completed over friction."""
    caption = "{}: share completed over friction; bands are exact 95 % intervals."
    return [
        Figure(svg, caption.format(name)) for name, svg in curve_figures(groups(campaign)).items()
    ]


def _findings(campaign: ThresholdMap) -> list[Block]:
    """Returns the tallies of verdicts and their table by situation; empty where no situation tells."""
    if not campaign.telling:
        return []
    judged = [(s, {j.finding.id: j for j in s.judgements}) for s in campaign.telling]
    claims = {j.finding.id: j.finding.claim for _, js in judged for j in js.values()}
    tallies = [
        f"{id} ({claims[id]}): {_count_verdicts([js[id] for _, js in judged])}." for id in JUDGED
    ]
    columns = (
        Column[tuple[Situation, dict[str, Judgement]]]("situation", lambda row: title(row[0])),
        *(Column(id, partial(_verdict, id), claims[id]) for id in JUDGED),
    )
    return [
        Text(FINDINGS_TEXT),
        Text("\n\n".join(tallies)),
        table(columns, judged, "Verdicts by situation", "Hover for the numbers."),
    ]


def _count_verdicts(judged: Sequence[Judgement]) -> str:
    """Returns how often each verdict was given, as text."""
    counts = Counter(j.verdict for j in judged)
    return ", ".join(f"{v.value} in {counts[v]}" for v in Verdict if counts[v])


def _verdict(id: str, row: tuple[Situation, dict[str, Judgement]]) -> Cell:
    """Returns a cell with a situation's verdict on the finding `id`, coloured by it."""
    found = row[1][id]
    kinds = {Verdict.SUPPORTED: "good", Verdict.CONTRADICTED: "bad"}
    return Cell(found.verdict.value, kind=kinds.get(found.verdict, "muted"), hint=found.text)


def _replays(campaign: ThresholdMap) -> list[Block]:
    """Returns cards of the first accident of each telling situation, coming from dry road."""
    cards = []
    for s in campaign.telling:
        crashed = s.runs.filter(~pl.col("completion")).sort(
            "road_mu", "seed", descending=[True, False]
        )
        if len(crashed):
            cards += _card(campaign, s, crashed.head(1))
    return [Cards("First accident of each situation, coming from dry road", cards)] if cards else []


def _card(campaign: ThresholdMap, s: Situation, run: pl.DataFrame) -> list[Card]:
    """Returns the replay card of a situation's run, of one row; empty where the run or its log is missing."""
    (name,) = campaign.names(run)
    folder = campaign.folder.log(name)
    if folder is None:
        return []
    row, (log, road) = run.row(0, named=True), campaign.log(folder)
    facts = [("friction", f"{row['road_mu']:.2g}")]
    if row["impact_kmh"] is not None:
        facts.append(("closing speed", f"{row['impact_kmh']:.0f} km/h"))
    at = len(log) - 1
    shown = replay(log, road, at, laid=read_surfaces(folder))
    return [Card(title(s), f"{name}, at {log.t[at]:.1f} s", facts=facts, replay=shown)]
