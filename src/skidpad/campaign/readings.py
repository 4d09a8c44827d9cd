"""Records the numbers of the further sensors that a stack asked for, where their type gives any."""

from __future__ import annotations

from math import isfinite

from skidpad.campaign.drive import Moment, Sink
from skidpad.core.sensor_types import SensorType, find_sensor_type
from skidpad.core.setup import Setup
from skidpad.recording.readings import RecordedSensor, SensorReadings, tabulate_readings


class ReadingsRecorder(Sink):
    """Reads each recorded sensor once per tick, after the driver has acted."""

    def __init__(self, setup: Setup) -> None:
        """setup: with the sensors that the stack asked for."""
        self._kinds: dict[str, SensorType] = {}
        for spec in setup.specs:
            kind = find_sensor_type(spec) if spec.id in setup.asked else None
            if kind is not None and kind.numbers is not None:
                self._kinds[spec.id] = kind
        self._rows: list[dict[str, float]] = []

    @property
    def is_needed(self) -> bool:
        """Tells whether any sensor of the run is recorded."""
        return bool(self._kinds)

    def see(self, moment: Moment) -> None:
        """Adds the row of one tick."""
        row: dict[str, float] = {"tick": moment.truth.tick}
        for id, kind in self._kinds.items():
            assert kind.numbers is not None
            for quantity, value in kind.numbers(moment.frame.extra[id]).items():
                if isfinite(value):
                    row[f"{id}.{quantity}"] = float(value)
        self._rows.append(row)

    def finish(self) -> SensorReadings:
        """Returns the table of all recorded ticks."""
        sensors = {
            id: RecordedSensor(id, kind.name, kind.title, kind.units)
            for id, kind in self._kinds.items()
        }
        return tabulate_readings(sensors, self._rows)
