"""Records the numbers of the further sensors that a stack asked for, and of added functions."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.core.sensor_types import SensorType, find_sensor_type, read_sensor
from skidpad.core.setup import Setup
from skidpad.core.specs import AIR_SENSORS
from skidpad.envelope.govern import GovernedStack
from skidpad.envelope.govern_kernel import RECORDED
from skidpad.envelope.limits import Binding
from skidpad.recording.run.readings import (
    RecordedSensor,
    SensorReadings,
    describe_row,
    tabulate_readings,
)
from skidpad.stack.functions import AddedFunctions

ENVELOPE = "envelope"
UNITS = "m/s, m; binding: " + ", ".join(f"{b.value} {b.name.lower()}" for b in Binding)


class ReadingsRecorder(Sink):
    """Reads each recorded sensor once per tick, after the driver has acted."""

    def __init__(self, setup: Setup, stack: object = None) -> None:
        """setup: with the sensors that the stack asked for. stack: whose functions are recorded."""
        added = getattr(stack, "added", None)
        self._governed = stack if isinstance(stack, GovernedStack) else None
        self._added = added if isinstance(added, AddedFunctions) and added.kinds else None
        self._kinds: dict[str, SensorType] = {}
        for spec in setup.specs:
            kind = find_sensor_type(spec) if spec.id in setup.asked else None
            if kind is not None and kind.numbers is not None:
                self._kinds[spec.id] = kind
        self._sensors = self._describe_sensors()
        self._rows: list[dict[str, float]] = []
        # else the rows of ticks that a kernel drove follow from the envelope's record and the last row
        others = {kind.word for kind in self._kinds.values()} - AIR_SENSORS
        follows = self._governed is not None and self._added is None and not others
        self.sees_all = not follows

    @property
    def is_needed(self) -> bool:
        """Returns True when any sensor or function of the run is recorded, so that it has rows to keep."""
        return bool(self._kinds) or self._added is not None or self._governed is not None

    def see(self, moment: Moment) -> None:
        """Adds the row of one tick."""
        row: dict[str, float] = {"tick": moment.truth.tick}
        for id, kind in self._kinds.items():
            assert kind.numbers is not None
            row |= _columns(id, kind.numbers(read_sensor(moment.frame, id, kind.reading)))
        for name, numbers in {} if self._added is None else self._added.numbers().items():
            row |= _columns(name, numbers)
        if self._governed is not None and self._governed.allowed is not None:
            row |= _columns(ENVELOPE, self._governed.allowed.numbers())
        self._rows.append(row)

    def pass_ticks(self, ticks: int) -> None:
        """Adds the rows of ticks that kernels drove: the air stays as it was in the last one."""
        assert self._governed is not None, "else it sees all"
        last = self._rows[-1]
        air = {name: value for name, value in last.items() if not name.startswith(ENVELOPE + ".")}
        for row in self._governed.envelope.newest(ticks).tolist():
            air["tick"] += 1
            said = dict(zip(RECORDED, row, strict=False))
            self._rows.append(air | _columns(ENVELOPE, said))

    def finish(self) -> SensorReadings:
        """Returns the table of all recorded ticks."""
        return tabulate_readings(self._sensors, self._rows)

    @property
    def latest(self) -> list[tuple[str, str]]:
        """Returns names and numbers of the newest tick as text for people; empty before the first."""
        return describe_row(self._sensors, self._rows[-1]) if self._rows else []

    def _describe_sensors(self) -> dict[str, RecordedSensor]:
        """Returns the recorded sensors by id: further ones, added functions, and the envelope if any."""
        sensors = {
            id: RecordedSensor(id, kind.name, kind.title, kind.units)
            for id, kind in self._kinds.items()
        }
        for function in () if self._added is None else self._added.kinds:
            name, title, units = function.name, function.title, function.units
            sensors[name] = RecordedSensor(name, "function", title, units)
        if self._governed is not None:
            watches = self._governed.settings.watches
            title = "Speed envelope, watching" if watches else "Speed envelope"
            sensors[ENVELOPE] = RecordedSensor(ENVELOPE, "envelope", title, UNITS)
        return sensors


def _columns(id: str, numbers: Mapping[str, float]) -> dict[str, float]:
    """Returns the finite numbers by column, `id`.NAME."""
    return {f"{id}.{name}": float(value) for name, value in numbers.items() if isfinite(value)}
