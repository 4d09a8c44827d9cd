"""Reference trajectories as compact CSV, and how far trajectories of ours are from them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from math import hypot, inf, pi
from pathlib import Path

from skidpad.scenarios.playing.stage import PlayedScenario
from support.oracle.cases import CASES
from support.oracle.roads import ROADS

HERE = Path(__file__).parent
OWN, OTHERS = HERE / "references", HERE / "corpus"
STEP_MS = 50  # of both players
PLACE_MAX, HEADING_MAX, SPEED_MAX = 0.1, 2.0 * pi / 180.0, 0.1  # m, rad, m/s


@dataclass(frozen=True)
class State:
    """Place of the reference point, heading and speed of an entity; m, rad, m/s."""

    x: float
    y: float
    h: float
    v: float


@dataclass(frozen=True)
class Reference:
    """What esmini made of a file: states by entity and time in ms."""

    version: str
    options: str
    file_hash: str
    entities: Mapping[str, Mapping[int, State]]

    def text(self) -> str:
        """Returns the compact CSV."""
        out = io.StringIO()
        out.write(f"# {self.version}; {self.options}; sha256 {self.file_hash}\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(("time", "name", "x", "y", "h", "speed"))
        for name, states in self.entities.items():
            for ms, s in states.items():
                row = (f"{v:.3f}".replace("-0.000", "0.000") for v in (s.x, s.y, s.h, s.v))
                writer.writerow((f"{ms / 1000.0:.1f}", name, *row))
        return out.getvalue()


def read_reference(file: Path) -> Reference:
    """Returns a stored reference."""
    first, _, rest = file.read_text(encoding="utf-8").partition("\n")
    version, options, hashed = first[2:].split("; ")
    entities: dict[str, dict[int, State]] = {}
    for row in csv.DictReader(io.StringIO(rest)):
        state = State(*(float(row[k]) for k in ("x", "y", "h", "speed")))
        entities.setdefault(row["name"], {})[round(float(row["time"]) * 1000.0)] = state
    return Reference(version, options, hashed.removeprefix("sha256 "), entities)


@dataclass(frozen=True)
class Deviation:
    """The largest differences of one entity, and the first time beyond the bounds, s."""

    place: float
    heading: float
    speed: float
    since: float | None
    way: float  # m that the reference moves

    @property
    def is_within(self) -> bool:
        """Every difference is within its bound."""
        return self.since is None


def deviations(told: PlayedScenario, reference: Reference) -> dict[str, Deviation]:
    """Returns how far each entity is from its reference at equal times; inf where it is not there.

    Runs may end within one step of each other.
    """
    ours = {(r.name, round(r.time * 1000.0)): r for r in told.rows}
    last = max(ms for _, ms in ours)
    found = {}
    for name, states in reference.entities.items():
        worst, since, way, before = [0.0, 0.0, 0.0], None, 0.0, None
        for ms, s in states.items():
            row = ours.get((name, ms))
            if row is None and 0 < ms - last <= STEP_MS:
                continue
            off = [inf] * 3
            if row is not None:
                turn = abs((row.h - s.h + pi) % (2.0 * pi) - pi)
                off = [hypot(row.x - s.x, row.y - s.y), turn, abs(row.speed - s.v)]
            worst = [max(a, b) for a, b in zip(worst, off, strict=True)]
            beyond = off[0] > PLACE_MAX or off[1] > HEADING_MAX or off[2] > SPEED_MAX
            since = ms / 1000.0 if beyond and since is None else since
            way += 0.0 if before is None else hypot(s.x - before.x, s.y - before.y)
            before = s
        found[name] = Deviation(worst[0], worst[1], worst[2], since, way)
    return found


def file_hash(file: Path) -> str:
    """Returns the SHA-256 of a file's content."""
    return sha256(file.read_bytes()).hexdigest()


def write_case(name: str, folder: Path) -> Path:
    """Writes one of our own cases with its road; returns its file."""
    case = CASES[name]
    road = folder / f"{case.road}.xodr"
    road.write_text(ROADS[case.road], encoding="utf-8")
    file = folder / f"{name}.xosc"
    file.write_text(case.text(), encoding="utf-8")
    return file
