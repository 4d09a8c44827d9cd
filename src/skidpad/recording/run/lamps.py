"""Lamps that a scenario file switches: one row per change, and what is lit at a time (`lamps.csv`)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from skidpad.recording.files import csv_text, read_rows, write_bytes

FILE = "lamps.csv"
COLUMNS = {
    "time": "s, since the start",
    "entity": "name of the vehicle",
    "lamp": "which lamp, in the words of OpenSCENARIO",
    "mode": "on, off or flashing",
    "on": "s, that a flash lasts",
    "off": "s, between two flashes",
}
FLASH = 0.5  # s on, and off, where a file does not say it; the standard's default
ROUNDING = 1e-9  # s


class Lamp(str, Enum):
    """A lamp of a vehicle, by the words of OpenSCENARIO XML 1.3 (`VehicleLightType`)."""

    DAYTIME = "daytimeRunningLights"
    LOW_BEAM = "lowBeam"
    HIGH_BEAM = "highBeam"
    FOG = "fogLights"
    FOG_FRONT = "fogLightsFront"
    FOG_REAR = "fogLightsRear"
    BRAKE = "brakeLights"
    WARNING = "warningLights"
    LEFT = "indicatorLeft"
    RIGHT = "indicatorRight"
    REVERSING = "reversingLights"
    PLATE = "licensePlateIllumination"
    SPECIAL = "specialPurposeLights"


class LampMode(str, Enum):
    """What a lamp is switched to."""

    ON = "on"
    OFF = "off"
    FLASHING = "flashing"


@dataclass(frozen=True, slots=True)
class LampChange:
    """A lamp is switched at time t, s; on, off: s of flashing."""

    t: float
    entity: str
    lamp: Lamp
    mode: LampMode
    on: float = FLASH
    off: float = FLASH

    def is_lit(self, t: float) -> bool:
        """Returns whether it shines at time t."""
        if self.mode is LampMode.FLASHING:
            return (t - self.t + ROUNDING) % (self.on + self.off) < self.on
        return self.mode is LampMode.ON


def newest(changes: Iterable[LampChange], t: float) -> Mapping[tuple[str, Lamp], LampChange]:
    """Returns the last change of each lamp up to time t, by entity and lamp."""
    return {(c.entity, c.lamp): c for c in changes if c.t <= t + ROUNDING}


def lamps_of(changes: Iterable[LampChange], t: float, entity: str) -> Mapping[Lamp, LampChange]:
    """Returns the last change of each lamp of one entity up to time t."""
    return {lamp: c for (name, lamp), c in newest(changes, t).items() if name == entity}


def write_lamps(folder: Path, changes: Sequence[LampChange]) -> None:
    """Writes the lamp changes of a run to `lamps.csv` in its folder; no file where there are none."""
    if not changes:
        return
    rows = (
        (f"{c.t:.3f}", c.entity, c.lamp.value, c.mode.value, f"{c.on:g}", f"{c.off:g}")
        for c in changes
    )
    write_bytes(folder / FILE, csv_text(COLUMNS, rows).encode())


def read_lamps(folder: Path) -> tuple[LampChange, ...]:
    """Returns the changes of a run's folder; none where the file of the run switches no lamp."""
    return tuple(read_rows(folder / FILE, _change))


def _change(row: Mapping[str, str]) -> LampChange:
    """Returns the change of a lamp in a row of CSV; raises ValueError where it does not fit."""
    on, off = float(row["on"]), float(row["off"])
    if not on + off > 0.0:
        raise ValueError(f"on and off must be positive, got {on:g} and {off:g}")
    return LampChange(
        float(row["time"]), row["entity"], Lamp(row["lamp"]), LampMode(row["mode"]), on, off
    )
