"""The tick log of a run as a sink of its loop."""

from __future__ import annotations

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.driving.outdoors import FileChanges
from skidpad.campaign.driving.run_setup import Stage
from skidpad.campaign.takeover.desk import Desk
from skidpad.core.environment.surface import present_patches
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendKind
from skidpad.core.states import ActorTable
from skidpad.evidence.drive.background import UNSEEN
from skidpad.recording.run.events import NoticeSource, Relocation
from skidpad.recording.run.log import LogHeader
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.recording.run.ticks import TickLog

DESK_ROOM = 12_000  # ticks of a log at first, as nobody knows how long a person drives


class Log(Sink):
    """The tick log of a run as a sink. changes: of a file that may change the weather."""

    changes: FileChanges | None = None
    sees_all = False

    def __init__(self, header: LogHeader, weather: str, ticks: int) -> None:
        self.header, self.weather, self.ticks = header, weather, ticks
        self.laid: list[LaidSurface] = []  # by events of a file

    def begin(self, table: ActorTable) -> None:
        """Makes room for as many ticks as the run may have."""
        self.log = TickLog(table, self.header, self.weather, self.ticks)

    def see(self, moment: Moment) -> None:
        """Appends the moment and the notices, relocation and weather that came with it (A-194)."""
        frame, truth, action = moment.frame, moment.truth, moment.action
        if self.changes is not None and self.changes.done:
            self.log.set_weather(self.changes.weather.name)
            self._note_surface(truth.tick, self.changes)
        self.log.append(truth, frame, moment.command, moment.report, frame.supervision)
        for text in truth.notices:
            self.log.notice(truth.tick, NoticeSource.TRAFFIC, text)
        for text in () if self.changes is None else self.changes.new_notices():
            self.log.notice(truth.tick, NoticeSource.SCENARIO, text)
        if action.notice:
            self.log.notice(truth.tick, NoticeSource.SUPERVISOR, action.notice)
        if action.relocate is not None and action.relocate.moved is not None:
            m = action.relocate.moved
            self.log.relocated(Relocation(truth.tick, m.reason, m.shift, m.old, m.new))

    def pass_ticks(self, ticks: int) -> None:
        """Takes in rows that a kernel has written."""
        self.log.add(ticks)

    def _note_surface(self, tick: int, changes: FileChanges) -> None:
        """Notes what the events of a file have laid on the road since the tick before."""
        patches, last = changes.outside.patches, self.laid[-1].surface if self.laid else None
        if not changes.serves_surface or patches is None:
            return
        there = present_patches(patches, changes.weather.air_temperature_c)
        if there != last:
            self.laid.append(LaidSurface(tick, there))


class DeskLog(Log):
    """A log whose weather a person may change."""

    sees_all = True

    def __init__(self, header: LogHeader, weather: str, ticks: int, desk: Desk) -> None:
        super().__init__(header, weather, ticks)
        self.desk = desk

    def see(self, moment: Moment) -> None:
        """Writes down the moment; a change of weather counts from the next moment on."""
        super().see(moment)
        if self.desk.changed:
            self.log.set_weather(self.desk.outside.weather.name)


def log_of(spec: RunSpec, stage: Stage, desk: Desk | None = None) -> Log:
    """Returns an empty log with what holds for the whole run."""
    about = {
        "config": spec.driver.label,
        "weather": spec.weather.name,
        "seed": str(spec.seed),
        "profile": spec.settings.profile,
        "sensors": spec.sensors.value,
    }
    if spec.backend.backend == BackendKind.CARLA:  # it tells contacts of the ego alone
        about["traffic"] = UNSEEN
    dt = stage.setup.dt
    header = LogHeader(map=stage.map.name, map_hash=stage.map.content_hash, dt=dt, about=about)
    room = round(spec.duration / dt) + 1
    if desk is None:
        return Log(header, spec.weather.name, room)
    return DeskLog(header, spec.weather.name, min(room, DESK_ROOM), desk)
