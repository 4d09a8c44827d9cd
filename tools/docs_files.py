"""The reference page of files: what each command writes, and every column with unit, type and meaning.

It is made from the declarations in the code (docs_fields), so it cannot be out of date.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from docs_fields import Field, class_fields, clean, dict_fields, said_fields, words_of
from skidpad.campaign import dataset
from skidpad.core.setup import DT
from skidpad.core.states import ActorTable, StackReport
from skidpad.evidence.channels import timing
from skidpad.evidence.pairs import Pair
from skidpad.recording.campaign import grip, ledger, risks, searches
from skidpad.recording.campaign.added_metrics import METRICS_FILE, AddedMetric
from skidpad.recording.campaign.matrix import MATRIX
from skidpad.recording.campaign.results import FINGERPRINT, Columns, Timing, schema
from skidpad.recording.campaign.threshold import THRESHOLD
from skidpad.recording.channels import drives, indicators, mcap_files
from skidpad.recording.hazards import records
from skidpad.recording.run import lamps, log, readings, staging, tilts
from skidpad.recording.run.events import KINDS
from skidpad.recording.run.log_files import GROUPS, tick_table
from skidpad.recording.run.ticks import TickLog
from skidpad.report.play import runs as played
from skidpad.scenarios.playing import results, stage

INTRO = """\
# Files and columns

What the commands leave in their folders. Quantities are SI unless the name ends in another unit.
World axes are those of ISO 8855: x and y in the map's frame, z up, angles counter-clockwise. Null means that
there was none. Tables are read by `polars.read_parquet(path)`; polars comes with Skidpad.
"""
ADDED = "<id>.<quantity>"


@dataclass(frozen=True, slots=True)
class FileEntry:
    """One kind of file: where it stands, what it holds, and its columns."""

    place: str
    holds: str
    fields: Sequence[Field]


def tick_fields() -> list[Field]:
    """Returns the columns of the log of a drive, with the types of a log without ticks."""
    reals, codes = np.zeros(0), np.zeros(0, np.uint8)
    nobody = ActorTable((), (), codes, reals, reals, reals, codes.reshape(0, 3))
    table = tick_table(TickLog(nobody, log.LogHeader(map="", map_hash="", dt=DT)).finish())
    series = {"ego_": log.EgoSeries, "applied_": log.CommandSeries, "requested_": log.CommandSeries}
    meanings = {f.name: f.meaning for f in class_fields(log.RunLog)}
    for prefix, _ in GROUPS:
        meanings |= {
            f.name: f.meaning for f in class_fields(series.get(prefix, StackReport), prefix)
        }
    meanings["supervision"] += words_of("Supervision")
    meanings |= {
        f.name: f"{f.meaning}; an array, the ego first" for f in class_fields(log.ActorSeries)
    }
    return [Field(n, str(t).split("(")[0], meanings.get(n, "")) for n, t in table.schema.items()]


def results_entries(kind: Columns[Any, Any], who: str) -> list[FileEntry]:
    """Returns the tables that every campaign of one kind ends with."""
    types = {n: str(t) for n, t in schema(kind.key, kind.metrics, Timing).items()}
    key, metrics = class_fields(kind.key), class_fields(kind.metrics)
    about = Field(
        FINGERPRINT, "String", "processor features, libraries and version that drove the row"
    )
    wall = [f for f in key if f.name in kind.sort] + class_fields(Timing)

    def typed(found: Iterable[Field]) -> list[Field]:
        return [Field(f.name, types.get(f.name, f.dtype), f.meaning) for f in found]

    return [
        FileEntry(
            f"OUT/results.parquet of {who}",
            "One row per run, sorted.",
            typed([*key, *metrics, about]),
        ),
        FileEntry(
            f"OUT/timing.parquet of {who}",
            "How long each run took; outside every hash.",
            typed(wall),
        ),
    ]


def run_entries() -> list[FileEntry]:
    """Returns the files of the folder of a run."""
    said = "number that a sensor or function reports, its unit in the name; null: not measured"
    places = [Field("tick", "Int64", "number of the tick"), Field(ADDED, "Float64", said)]
    return [
        FileEntry(
            "RUN/ticks.parquet",
            "One row per tick of a drive. Its footer names the actors.",
            tick_fields(),
        ),
        *(
            FileEntry(
                f'RUN/events.jsonl, "event": "{name}"',
                clean(inspect.getdoc(kind) or "") + ".",
                class_fields(kind),
            )
            for name, kind in KINDS.items()
        ),
        FileEntry(
            f"RUN/{readings.READINGS}",
            "Numbers of further sensors and functions per tick; its footer describes them.",
            places,
        ),
        FileEntry(
            f"RUN/{METRICS_FILE}",
            "Metrics of installed packages, a list.",
            class_fields(AddedMetric),
        ),
        FileEntry(
            "RUN/pairs.csv",
            "How close any two came, of `skidpad play` and `grip`.",
            class_fields(Pair),
        ),
        FileEntry(
            f"RUN/{results.TRAJECTORIES}",
            "Places of a scenario's entities over time.",
            class_fields(stage.Row),
        ),
        FileEntry(
            f"RUN/{results.STORY}",
            "What happened in the storyboard.",
            said_fields(results.STORY_COLUMNS, "String"),
        ),
        FileEntry(
            f"RUN/{lamps.FILE}",
            "Lamps that a scenario switches; no file where it switches none.",
            said_fields(lamps.COLUMNS, "String"),
        ),
        FileEntry(
            f"RUN/{tilts.FILE}",
            "Pitch and roll that trajectories of a scenario give; no file where the road alone tilts.",
            said_fields(tilts.COLUMNS, "String"),
        ),
        FileEntry(
            f"RUN/{staging.STAGING}", "What a scenario file stages.", class_fields(staging.Staging)
        ),
    ]


def campaign_entries() -> list[FileEntry]:
    """Returns the files of the folder of a campaign."""
    words = dict.fromkeys(("weather", "model"), "String")
    stops = said_fields(
        grip.STOPPING_COLUMNS, dict.fromkeys(grip.STOPPING_COLUMNS, "Float64") | words
    )
    return [
        *results_entries(MATRIX, "`skidpad adas`"),
        *results_entries(grip.GRIP, "`skidpad grip`, and `skidpad play` of a folder"),
        FileEntry(
            "OUT/series/CELL/SEED.parquet",
            "The ego of `skidpad grip` over time, a row per tick.",
            said_fields(grip.COLUMNS, "Float32"),
        ),
        FileEntry(f"OUT/{grip.STOPPING}", "Full stops of `skidpad grip` in each weather.", stops),
        *results_entries(THRESHOLD, "`skidpad grip --threshold`"),
        FileEntry(
            f"OUT/{played.CSV}",
            "Verdicts of `skidpad play`, a row per run and other actor; of a folder, its metrics follow.",
            said_fields(played.COLUMNS, ""),
        ),
        FileEntry(
            f"OUT/{staging.JUDGING}",
            "How the runs of `skidpad play` were judged.",
            class_fields(staging.Judging),
        ),
        FileEntry(
            f"OUT/{ledger.LEDGER}", "One line per run that ended.", class_fields(ledger.Entry)
        ),
    ]


def channel_entries() -> list[FileEntry]:
    """Returns the files of channels: drives and their monitoring."""
    topics = {
        f"{mcap_files.CHANNEL_TOPIC}NAME": "what a channel perceived and plans",
        mcap_files.TRUTH_TOPIC: "where all actors truly were",
        mcap_files.DECISION_TOPIC: "which channel drove",
        mcap_files.CONTEXT_TOPIC: "map and weather of the drive",
    }
    beside = {
        "cycles": "number of cycles in its record",
        "offset": "where its record begins in hazards.txt, in bytes",
        "bytes": "how long its record is",
    }
    hazards = [f for f in class_fields(records.HazardRecord) if f.name != "worlds"]
    return [
        *results_entries(drives.DRIVES, "`skidpad channels drive`"),
        FileEntry(
            "OUT/ROUTE/NAME.mcap",
            "A recorded segment; the messages are those of channels.proto, which the file holds.",
            said_fields(topics, "message"),
        ),
        FileEntry(
            "OUT/ROUTE/NAME.json, outcome",
            "What became of a segment; `plan` beside it is the run value.",
            class_fields(drives.DriveOutcome),
        ),
        FileEntry(
            f"OUT/{indicators.FILE}",
            "Values of `skidpad monitor`, a row per cycle, subject and indicator.",
            dict_fields(indicators, "TYPES", indicators.TYPES),
        ),
        FileEntry(
            "OUT/timing.parquet of `skidpad monitor --timing`",
            "Times of the parts of a cycle, a row per cycle.",
            dict_fields(timing, "TIMES", timing.TIMES),
        ),
        FileEntry(
            "OUT/timing.parquet of a watched drive",
            "What is added when the monitor watches a drive as it happens.",
            dict_fields(timing, "LIVE_TIMES", timing.LIVE_TIMES),
        ),
        FileEntry(
            f"OUT/{records.INDEX_FILE}",
            "One line per hazard; the worlds around it are in hazards.txt.",
            [*hazards, *said_fields(beside, "Int64")],
        ),
    ]


def search_entries() -> list[FileEntry]:
    """Returns the files of `skidpad search` and `skidpad risk`, and of data sets."""
    types = {"tick": "Int64", **{n: str(t) for n, t in dataset.REALS.items()}}
    return [
        FileEntry(
            f"OUT/{searches.SEARCH}",
            "What `skidpad search` was asked.",
            class_fields(searches.Search),
        ),
        FileEntry(
            f"OUT/{searches.TRIALS}, OUT/{risks.RISK_RUNS}",
            "One line per run of `skidpad search` or `skidpad risk`.",
            class_fields(searches.Trial),
        ),
        FileEntry(
            f"OUT/{searches.FOUND}, groups",
            "Avoidable failures of a search by kind.",
            class_fields(searches.Group),
        ),
        FileEntry(
            f"OUT/{searches.HAZARD}",
            "The hazard that a search began from.",
            class_fields(searches.Hazard),
        ),
        FileEntry(f"OUT/{risks.RISK}", "What `skidpad risk` was asked.", class_fields(risks.Risk)),
        FileEntry(f"OUT/{risks.RISK_FOUND}", "What came of it.", class_fields(risks.RiskFound)),
        FileEntry(
            f"OUT/RUN/{dataset.FRAMES}",
            "Labels of `skidpad dataset`, a row per tick with images.",
            said_fields(dataset.COLUMNS, types),
        ),
    ]


DOCUMENTS = {
    "config.yaml": "of a run: the whole run value, to drive it again",
    "error.txt": "of a run: the traceback of a stack that failed",
    "inputs.jsonl": "of a run in the cockpit: what the person did, by tick",
    "snapshots/*.png": "of a run: pictures at a contact",
    "campaign.json": "of a campaign: what all runs have in common, and what varies",
    "report.html": "the page of the result; it needs no server",
    "maps/": "of a campaign or run: road networks that came from files of yours",
    "monitor.json": "of a monitored drive: claims, thresholds, violations, and what was not evaluated",
    "hazards.txt": "of a monitored drive: the worlds around each hazard as text",
    "alarms.jsonl": "of a drive that is watched as it happens: alarms, one line each",
    "link.json": "of a drive that is watched as it happens: what became of the link",
    "failures.xosc": "of a search: all avoidable failures as parameter values",
    "failures/": "of a search: the first failures of each kind, a folder of a run each",
    "dataset.json": "of a data set: what columns and cameras are",
}
PARTS = {
    "A run": ("Each run that is kept has a folder RUN, such as OUT/runs/CELL-SEED.", run_entries),
    "A campaign": ("With `--csv` both tables of `skidpad adas` stand there as CSV, too.", campaign_entries),
    "Channels": ("Drives by several channels, and what the monitor says of them.", channel_entries),
    "Search, risk and data sets": ("Lines of JSON unless the name says otherwise.", search_entries),
}  # fmt: skip


def files_page() -> str:
    """Returns the reference page as Markdown."""
    lines = [INTRO]
    for title, (text, entries) in PARTS.items():
        lines += [f"## {title}", "", text, ""]
        for entry in entries():
            lines += [f"### {entry.place}", "", entry.holds, ""]
            lines += ["| column | unit | type | meaning |", "|---|---|---|---|"]
            lines += [
                f"| `{f.name}` | {f.unit} | {_cell(f.dtype)} | {_cell(f.sentence)} |"
                for f in entry.fields
            ]
            lines += [""]
    lines += ["## Other files", "", "| file | what it is |", "|---|---|"]
    lines += [f"| `{name}` | {text} |" for name, text in DOCUMENTS.items()]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def on_files(files: Any, config: Any) -> Any:
    """Adds the page to the site's files."""
    from mkdocs.structure.files import File

    files.append(File.generated(config, "reference/files.md", content=files_page()))
    return files
