"""A stored run driven once more with one thing changed, to be shown beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from msgspec import structs

from skidpad.campaign.runs.play import run_to
from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.source import Source
from skidpad.core.errors import ConfigError
from skidpad.core.run import AdasDriver, Function, RunSpec
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Govern
from skidpad.physics.presets import preset
from skidpad.recording.run.log_files import TICKS

FOLDER = "again"  # within the run's
DRY, WET, ICE = "clear-noon", "rain-noon", "icy_30"


class Change(NamedTuple):
    """One thing that can be changed of a run."""

    title: str
    apply: Callable[[RunSpec], RunSpec]


def _in_weather(name: str) -> Callable[[RunSpec], RunSpec]:
    """Returns the change of a run that puts it into the weather of this name."""
    return lambda run: structs.replace(run, weather=preset(name))


def _with_stability(run: RunSpec) -> RunSpec:
    """Returns the run with stability control in its vehicle."""
    world = replace(run.settings.world, esc=True)
    return structs.replace(run, settings=replace(run.settings, world=world))


def _with_emergency_braking(run: RunSpec) -> RunSpec:
    """Returns the run with emergency braking added; one whose driver is no stack of ours as it is."""
    if not isinstance(run.driver, AdasDriver):
        return run
    functions = run.driver.functions | {Function.AEB}
    return structs.replace(run, driver=structs.replace(run.driver, functions=functions))


CHANGES = {
    "dry": Change("dry", _in_weather(DRY)),
    "wet": Change("wet", _in_weather(WET)),
    "ice": Change("on ice", _in_weather(ICE)),
    "stability": Change("with stability control", _with_stability),
    "braking": Change("with emergency braking", _with_emergency_braking),
    "envelope": Change(
        "inside the speed envelope", lambda run: structs.replace(run, govern=Govern.ENVELOPE)
    ),
}


def list_changes(source: Source) -> dict[str, str]:
    """Returns word and title of each change that makes another run of a source."""
    if not isinstance(source, RecordedRun) or source.spec.inputs:
        return {}
    spec = source.spec
    return {word: one.title for word, one in CHANGES.items() if one.apply(spec) != spec}


def drive_again(source: Source, word: str) -> RecordedRun:
    """Returns the run with one thing changed, as long as the stored one; driven unless it was before.

    It is written to the folder `again` within the run's. ConfigError for a run in which a person took
    part, or a change that changes nothing.
    """
    if not isinstance(source, RecordedRun):
        raise ConfigError("a recording of channels cannot be driven again")
    if word not in list_changes(source):
        raise ConfigError(f"this run cannot be driven again {word!r}: nothing would be another")
    out: Path = source.folder / FOLDER / word
    if not (out / TICKS).is_file():
        duration = min(source.spec.duration, source.ticks * DT)
        run_to(structs.replace(CHANGES[word].apply(source.spec), duration=duration), out)
    return RecordedRun(out)
