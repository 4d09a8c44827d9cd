"""Drive a stored run again with a second driver in its shadow: same world, same frames, no influence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from msgspec import structs

from skidpad.campaign.driving.backends import keep_server
from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.stack_at_wheel import StackAtWheel, driver_of, with_sensors
from skidpad.campaign.runs.rerun import desk_of
from skidpad.campaign.runs.run import run as drive_again
from skidpad.campaign.runs.stored import read_run
from skidpad.campaign.user_files import with_kept_map
from skidpad.core.errors import ConfigError
from skidpad.core.run import ChannelCrew, DriverSpec, Passenger
from skidpad.core.vocabulary import Supervision
from skidpad.evidence.shadow import Foresight, Parting, Pedals, foresight, partings, share_apart
from skidpad.recording.run.log_files import log_hash, read_log


class Shadow(Sink):
    """A driver that is given every frame and whose commands are kept and not obeyed."""

    def __init__(self, driver: StackAtWheel) -> None:
        self.driver = driver
        self.rows: list[tuple[float, float, float, float]] = []  # throttle, brake: driver, shadow

    def see(self, moment: Moment) -> None:
        """Asks the shadow and keeps pedals of both; nan in ticks in which the supervisor drives."""
        asked = self.driver.act(moment.frame)
        given = moment.command
        row = (given.throttle, given.brake, asked.throttle, asked.brake)
        led = moment.frame.supervision is not Supervision.NONE
        self.rows.append((np.nan, np.nan, np.nan, np.nan) if led else row)


@dataclass(frozen=True, slots=True)
class Shadowed:
    """How a shadow compares with the driver of a run."""

    same: bool  # the drive is the stored one, by content hash: the shadow changed nothing
    share_apart: float
    partings: tuple[Parting, ...]
    contacts: tuple[Foresight, ...]


def ride_along(folder: Path, shadow: DriverSpec) -> Shadowed:
    """Drives the run in a folder again with `shadow` riding along; returns how the two compare.

    ConfigError for channels, passengers, and a shadow that asks for sensors of the driver's names.
    """
    spec = with_kept_map(read_run(folder), folder.resolve().parents[1])
    for driver in (spec.driver, shadow):
        if isinstance(driver, (ChannelCrew, Passenger)):
            raise ConfigError(
                f"{driver.label} drives no stack that a shadow could be compared with"
            )
    keep_server(spec.backend)
    stage = stage_of(spec)
    rider = driver_of(structs.replace(spec, driver=shadow), stage)
    stage = replace(stage, setup=with_sensors(stage.setup, rider.stack))
    sink = Shadow(rider)
    log = drive_again(spec, stage=stage, sinks=(sink,), desk=desk_of(folder, spec)).log
    rider.stack.close()
    rows = np.array(sink.rows).reshape(-1, 4)
    given, asked = Pedals(rows[:, 0], rows[:, 1]), Pedals(rows[:, 2], rows[:, 3])
    touched = np.unique([c.tick for c in log.contacts]) - log.tick[0] if log.contacts else []
    events = log.t[np.array(touched, dtype=np.int64)]
    return Shadowed(
        same=log_hash(log) == log_hash(read_log(folder)),
        share_apart=share_apart(given, asked),
        partings=tuple(partings(log.t, given, asked)),
        contacts=tuple(foresight(log.t, events, given, asked)),
    )
