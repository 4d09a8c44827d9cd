"""From a path to what is replayed: a run's folder, a recording of channels, or a hazard."""

from __future__ import annotations

from pathlib import Path

from skidpad.campaign.runs.play import run_to
from skidpad.cockpit.channel_source import ChannelSource, weather_of
from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.source import Source
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.files.names import path_part
from skidpad.core.run import Passenger, RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.hazards.records import TEXT_FILE, HazardRecord, read_hazards
from skidpad.recording.run.log_files import TICKS
from skidpad.scenarios.export.hazard_export import export_hazard
from skidpad.scenarios.export.version import OscVersion

RECORDING = ".mcap"
REPLAYS, SCENARIOS = "replays", "scenarios"  # folders within that of the hazards


def open_source(path: Path, hazard: str | None = None) -> Source:
    """Returns what lies at a path: recording of channels, run, or hazard, which may be driven first.

    hazard: its id, in a folder of hazards; ConfigError for an unknown one.
    """
    if (path / TEXT_FILE).is_file():
        return RecordedRun(play_hazard(path, hazard))
    if hazard is not None:
        raise ConfigError(f"--id names a hazard, and {path} is no folder of hazards")
    return ChannelSource(path) if path.suffix == RECORDING else RecordedRun(path)


def play_hazard(folder: Path, id: str | None) -> Path:
    """Returns the folder of a run that plays a hazard's scenario; it is driven if it is not there yet.

    id: None where the folder holds one hazard. ConfigError for an unknown one.
    """
    records = {record.id: record for record in read_hazards(folder)}
    if id is None and len(records) == 1:
        id = next(iter(records))
    if id not in records:
        known = ", ".join(records) or "none"
        asked = "choose one by --id" if id is None else f"there is no hazard {id!r}"
        raise ConfigError(f"{folder}: {asked}; there are: {known}")
    record = records[id]
    out = folder / REPLAYS / path_part(f"{record.id}-{record.type.value}")
    if not (out / TICKS).is_file():
        run_to(run_of(record, folder / SCENARIOS), out)
    return out


def run_of(record: HazardRecord, folder: Path) -> RunSpec:
    """Writes a hazard's scenario and returns a run that moves all actors as one channel saw them.

    That is the driving channel, else the first.
    """
    scenario, _ = export_hazard(record, folder, OscVersion.V1_0)
    course = Scenario(file=str(scenario.resolve()), actors=ActorMode.IDEAL)
    return RunSpec(
        driver=Passenger(),
        course=course,
        weather=weather_of(record.context),
        sensors=SensorLevel.OBJECTS,
        duration=60.0,
    )
