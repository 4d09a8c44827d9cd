"""Every reader of foreign files, with files that it reads, for tests that damage them."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import numpy as np
import yaml

from skidpad.campaign.cells.matrix import published_drivers, sweep
from skidpad.campaign.runs.stored import read_run, read_segment
from skidpad.campaign.workers.worker import Finished
from skidpad.core.weather import Weather
from support import runs
from support.faults import mutation, scenario_mutation, small_files
from support.faults.plain_mutation import mutated_json, mutated_yaml
from support.faults.table_mutation import mutated_npz, mutated_parquet
from support.toy_campaign import RECIPE as TOY
from support.toy_campaign import campaign as toy_campaign

Mutate = Callable[[random.Random, bytes], bytes]
PLAYED_S, STORY_S, STORY_DT = 0.25, 5.0, 0.2  # 5 and 26 ticks of a scenario


@dataclass(frozen=True)
class Reader:
    """read: what is given the damaged file. share: of CI's inputs, where reading takes long.

    most: inputs in all, where reading draws pictures.
    """

    file: str  # its name
    seeds: Callable[[], list[bytes]]
    read: Callable[[Path], object]
    mutations: tuple[Mutate, ...] = (mutation.mutated,)
    share: float = 1.0
    most: int | None = None


def here(jobs: Any) -> Any:
    """Runs jobs in this process."""
    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


def built_in(package: str, name: str) -> bytes:
    return resources.files(package).joinpath(name).read_bytes()


# --- YAML and JSON


def weather_files() -> list[bytes]:
    plain = {"title": "Wet", "wetness": 40.0, "precipitation": 10, "fog_density": 1e1}
    return [yaml.safe_dump(plain).encode(), b"wetness: &a 3\nprecipitation: *a\n"]


def read_weather(path: Path) -> object:
    from skidpad.physics.presets import load_weather

    return load_weather(path).values()


def run_files() -> list[bytes]:
    described = [runs.adas_run(), runs.scenario_run("ghost_cut_in"), runs.segment_run()]
    return [yaml.safe_dump(run.to_plain(), sort_keys=False).encode() for run in described]


def read_stored(path: Path) -> object:
    run = read_run(path.parent)
    return run.name, run.to_identity(), run.settings


def records() -> list[bytes]:
    from skidpad.recording.channels.drives import DriveOutcome, DriveRecord, Ending

    outcome = DriveOutcome(
        driven_s=1.0, distance_m=2.0, collisions=0, collisions_struck=0, red_lights_run=0,
        stalls=0, ended=Ending.TIME, switches=0, minimal_risk_s=0.0, route="r", seed=1,
        drive_by="arbiter", driving_s={"a": 1.0},
    )  # fmt: skip
    return [msgspec.json.encode(DriveRecord(runs.segment_run().to_plain(), outcome))]


def rules() -> list[bytes]:
    return [built_in("skidpad.evidence.channels", "hazard_rules.yaml")]


def read_rules(path: Path) -> object:
    from skidpad.evidence.channels.choices import Profile
    from skidpad.evidence.channels.hazards import load_rules

    return load_rules(Profile("practical"), path)


def thresholds() -> list[bytes]:
    return [built_in("skidpad.evidence.channels.indicators", "thresholds.yaml")]


def read_thresholds(path: Path) -> object:
    from skidpad.evidence.channels.indicators.catalogue import load_thresholds

    return load_thresholds(path)


def mappings() -> list[bytes]:
    return [
        (
            b"clock: header\nchannels:\n  a:\n    ego: {topic: /odom, length: 4.5, width: 1.8}\n"
            b"    plan: {topic: /plan, frame: ego}\n    objects: {topic: /objects}\n"
        )
    ]


def read_mapping(path: Path) -> object:
    from skidpad.recording.formats.ros_bag import load_mapping

    return load_mapping(path)


def labels() -> list[bytes]:
    return [
        (
            b"hazard,start_s,end_s,world,annotator,note,recording\n"
            b'ego_tailgated,1.0,2.5,sim,me,,a\nstuck_vehicle,3,4,channels,me,"so, so",\n'
        )
    ]


def read_labels(path: Path) -> object:
    from skidpad.evidence.channels.judging.evaluation import read_labels

    return read_labels(path)


# --- what a campaign and a run leave


@cache
def toy_files() -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        toy_campaign(2).run(Path(folder), here)
        return {p.name: p.read_bytes() for p in Path(folder).iterdir()}


def read_identity(path: Path) -> object:
    from skidpad.recording.campaign.ledger import campaign_command, common_configuration

    return campaign_command(path.parent), common_configuration(path.parent)


def identities() -> list[bytes]:
    return [toy_files()["campaign.json"], b'{"common": {"a": 1}, "command": "adas"}']


def ledgers() -> list[bytes]:
    """With its checksums, and as the first versions wrote it."""
    signed = toy_files()["ledger.jsonl"]
    return [signed, re.sub(rb',"sum":"[0-9a-f]{8}"', b"", signed)]


def read_toy_ledger(path: Path) -> object:
    from skidpad.recording.campaign.ledger import latest, read_ledger

    return latest(read_ledger(path.parent, TOY.entry))


def read_toy_results(path: Path) -> object:
    from skidpad.recording.campaign.results import read_results

    return read_results(path.parent, TOY.columns)


@cache
def run_folder() -> dict[str, bytes]:
    from skidpad.campaign.runs.run import run
    from skidpad.recording.run.log_files import write_log

    driven = run(runs.adas_run(duration=0.5, vehicles=1))
    with TemporaryDirectory() as folder:
        write_log(Path(folder), driven.log)
        return {p.name: p.read_bytes() for p in Path(folder).iterdir()}


def read_drive(path: Path) -> object:
    """The log, and what `skidpad show` makes of it."""
    from skidpad.evidence.drive.collisions import find_crashes
    from skidpad.evidence.drive.metrics import run_metrics, weather_metrics
    from skidpad.evidence.drive.prepared import prepare
    from skidpad.recording.run.log_files import log_hash, read_log
    from skidpad.roads.bundled import load_map

    for name, content in run_folder().items():
        if name != path.name:
            (path.parent / name).write_bytes(content)
    log = read_log(path.parent)
    road_map = load_map("figure8")
    with np.errstate(all="ignore"):
        found = run_metrics(log, road_map), weather_metrics(log, road_map)
        return log_hash(log), found, list(find_crashes(prepare(log, road_map)))


# --- maps, models, scenarios


def read_map(path: Path) -> object:
    from skidpad.roads.bundled import load_map
    from skidpad.roads.summary import summarise

    with np.errstate(all="ignore"):
        road_map = load_map(path)
        road_map.project(1.0, 2.0, 0.0)
        return summarise(road_map)


def read_model(path: Path) -> object:
    from skidpad.evidence.channels.identifier.model import load_model

    model = load_model(path)
    return model.identifier(), model.trained_on()


@cache
def scenarios() -> list[bytes]:
    from skidpad.scenarios.shipped import NAMES, scenario_file

    return [scenario_file(name).read_bytes() for name in sorted(NAMES)]


def beside(path: Path) -> None:
    road = path.parent / "straight.xodr"
    if not road.exists():
        road.write_bytes(built_in("skidpad.scenarios", "catalogue/straight.xodr"))


def read_scenario(path: Path) -> object:
    from skidpad.campaign.driving.course_file import check_scenario
    from skidpad.core.courses import Scenario

    beside(path)
    return check_scenario(Scenario(file=str(path))).findings


def play_scenario(path: Path) -> object:
    from skidpad.campaign.runs.run import run

    beside(path)
    with np.errstate(all="ignore"):
        return run(runs.scenario_run(path, duration=PLAYED_S)).outcome


def story_of(path: Path) -> Any:
    from skidpad.scenarios.scenario import check

    return check(path)


def tell_story(path: Path) -> object:
    """Everything as the file says, where it compiles."""
    from skidpad.scenarios.playing.stage import play_ideal

    beside(path)
    scenario = story_of(path).scenario
    with np.errstate(all="ignore"):
        return scenario and play_ideal(scenario, STORY_S, STORY_DT).csv()


# --- words of a command line


def words(path: Path) -> object:
    from skidpad.core.settings.parts import parse_assignments
    from skidpad.evidence.compare import parse_rule

    kind, _, text = path.read_bytes().decode("utf-8", "replace").partition(" ")
    readers: dict[str, Callable[[str], object]] = {
        "drivers": published_drivers,
        "sweep": lambda t: sweep([Weather()], t),
        "rule": parse_rule,
        "set": lambda t: parse_assignments([t]),
    }
    return readers.get(kind, len)(text)


def sentences() -> list[bytes]:
    return [
        b"drivers 0,1,4",
        b"sweep wetness=0:100:20",
        b"rule fatal_collisions > 0.5",
        b"set mu_ref=0.8",
    ]


BYTES_OR_ARRAYS = (mutation.mutated, mutated_npz, mutated_npz)
BYTES_OR_TABLE = (mutation.mutated, mutated_parquet, mutated_parquet)
BYTES_OR_JSON = (mutation.mutated, mutated_json, mutated_json)
BYTES_OR_YAML = (mutation.mutated, mutated_yaml, mutated_yaml)
BYTES_OR_XML = (mutation.mutated, mutation.mutated_xml)
READERS = {
    "weather": Reader("weather.yaml", weather_files, read_weather, BYTES_OR_YAML),
    "run": Reader("config.yaml", run_files, read_stored, BYTES_OR_YAML),
    "segment": Reader(
        "a.json", records, lambda p: read_segment(p.with_suffix(".mcap")), BYTES_OR_JSON),
    "rules": Reader("rules.yaml", rules, read_rules, BYTES_OR_YAML),
    "thresholds": Reader("thresholds.yaml", thresholds, read_thresholds, BYTES_OR_YAML),
    "mapping": Reader("mapping.yaml", mappings, read_mapping, BYTES_OR_YAML),
    "labels": Reader("labels.csv", labels, read_labels),
    "words": Reader("words.txt", sentences, words),
    "campaign": Reader("campaign.json", identities, read_identity, BYTES_OR_JSON),
    "ledger": Reader("ledger.jsonl", ledgers, read_toy_ledger, BYTES_OR_JSON),
    "results": Reader(
        "results.parquet", lambda: [toy_files()["results.parquet"]], read_toy_results, BYTES_OR_TABLE),
    "ticks": Reader("ticks.parquet", lambda: [run_folder()["ticks.parquet"]], read_drive, BYTES_OR_TABLE),
    "events": Reader(
        "events.jsonl", lambda: [run_folder()["events.jsonl"], small_files.events()], read_drive,
        BYTES_OR_JSON),
    "opendrive": Reader("map.xodr", small_files.maps, read_map, BYTES_OR_XML),
    "baked": Reader("map.npz", small_files.baked, read_map, BYTES_OR_ARRAYS),
    "model": Reader("model.npz", small_files.models, read_model, BYTES_OR_ARRAYS),
    "openscenario": Reader("a.xosc", scenarios, read_scenario, BYTES_OR_XML),
    "played": Reader("a.xosc", scenarios, play_scenario, (mutation.mutated_xml,), share=0.5),
    "storyboard": Reader(
        "a.xosc", scenario_mutation.seeds, tell_story, (scenario_mutation.mutated_story,)),
}  # fmt: skip
