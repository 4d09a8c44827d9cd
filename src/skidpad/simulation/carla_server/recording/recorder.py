"""The recorder's calls: a plain log of poses in --data-dir, one line per tick, and its summaries.

The format is ours (JSON lines), not CARLA's binary one: files of the two are not exchangeable.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import IO, Any

from skidpad.core.errors import FileError
from skidpad.simulation.carla_server.actors.registry import ActorTable
from skidpad.simulation.carla_server.actors.touches import touches
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.recording.recorder_text import (
    ANY,
    describe_recording,
    list_blocked,
    list_collisions,
)
from skidpad.simulation.carla_server.recording.replayer import (
    FORMAT,
    PLAYED,
    CarlaRecording,
    recording,
)
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicle, Vehicles
from skidpad.simulation.world.world import World

MAX_BYTES = 2 * 1024**3
MAX_READ = 256 * 1024**2  # a longer recording is kept, but neither summed up nor replayed


def safe_path(folder: Path | None, name: str) -> Path:
    """Returns the path of a client's file name inside the data folder; only its base name counts (K-8).

    CallError without a folder, and for what is no file name.
    """
    if folder is None:
        raise CallError("this server has no --data-dir, so it neither writes nor reads files")
    base = name.replace("\\", "/").rsplit("/", 1)[-1]
    if not base or base in (".", "..") or "\x00" in base or len(base) > 200:
        raise CallError(f"not a file name: {name!r:.80}")
    return folder / base


class Recorder:
    """Writes the ticks of an episode to a file while it is started."""

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self._file: IO[str] | None = None
        self._left = 0
        self._born: set[int] = set()  # actors that the recording describes

    def start(self, name: str, map: str, clock: Clock) -> str:
        """Starts a recording, ending one that runs, and returns the text that the client prints.

        CallError or FileError where the file cannot be written.
        """
        path = safe_path(self.folder, name)
        self.stop()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("w", encoding="utf-8")
        except OSError as error:
            raise FileError(f"recording {path.name}: {error.strerror}") from error
        self._left, self._born = MAX_BYTES, set()
        head = {
            "map": map,
            "episode": clock.episode,
            "format": FORMAT,
            "start": clock.elapsed,
        }
        self._write(json.dumps(head))
        return f"Recording to file: {path.name}"

    def stop(self) -> None:
        """Ends the recording and closes its file, if one runs."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def tick(self, clock: Clock, actors: ActorTable, moving: World, vehicles: Vehicles) -> None:
        """Writes a line: frame, time, poses of what moves, contacts, new actors, controls of vehicles.

        Does nothing without a recording; one of MAX_BYTES is ended.
        """
        if self._file is None:
            return
        poses, born = [], []
        for actor in actors:
            if actor.family not in PLAYED:
                continue
            place, turn = wire.transform(actors.pose(actor))
            poses.append([actor.id, [round(v, 3) for v in place], [round(v, 3) for v in turn]])
            if actor.id not in self._born:
                born.append([actor.id, actor.blueprint.id, actor.attributes])
                self._born.add(actor.id)
        contacts = [
            [t.actor.id, 0 if t.other is None else t.other.id] for t in touches(moving, actors)
        ]
        controls = [_control_row(vehicle, vehicles) for vehicle in vehicles]
        self._write(json.dumps([clock.frame, clock.elapsed, poses, contacts, born, controls]))

    def _write(self, line: str) -> None:
        """Writes a line to the recording; stops the recording where the size limit is passed."""
        assert self._file is not None
        self._left -= len(line) + 1
        if self._left < 0:
            self.stop()
            return
        self._file.write(line + "\n")

    def summary(self, name: str, show_all: bool = False) -> str:
        """Returns the text that `show_recorder_file_info` prints; CallError for what is no recording."""
        with _explain_failure(name):
            return describe_recording(*self._read_with_start(name), show_all)

    def collisions(self, name: str, first: str = ANY, second: str = ANY) -> str:
        """Returns what `show_recorder_collisions` prints of contacts between two kinds."""
        with _explain_failure(name):
            return list_collisions(*self._read_with_start(name), first, second)

    def describe_blocked(self, name: str, seconds: float, cm: float) -> str:
        """Returns the text that `show_recorder_actors_blocked` prints.

        seconds: shortest time; cm: least way from its place that counts as moving.
        """
        with _explain_failure(name):
            return list_blocked(*self._read_with_start(name), seconds, cm)

    def recording(self, name: str) -> CarlaRecording:
        """Returns what can be replayed of a file; CallError for what is no recording."""
        with _explain_failure(name):
            return recording(name, *self._read(name))

    def _read_with_start(self, name: str) -> tuple[dict[str, Any], list[list[Any]], float]:
        """Returns head, ticks and start time in s of a recording; 0.0 where it has no tick."""
        head, ticks = self._read(name)
        written = datetime.fromtimestamp(safe_path(self.folder, name).stat().st_mtime, timezone.utc)
        head["date"] = written.strftime("%x %X")
        return head, ticks, _start(head, ticks) if ticks else 0.0

    def _read(self, name: str) -> tuple[dict[str, Any], list[list[Any]]]:
        """Returns head and ticks of a recording; raises CallError for a missing, too large or damaged one."""
        path = safe_path(self.folder, name)
        if self._file is not None:
            self._file.flush()
        try:
            if path.stat().st_size > MAX_READ:
                raise CallError(f"{path.name} is larger than {MAX_READ} bytes")
            lines = path.read_text(encoding="utf-8").splitlines()
            head, ticks = json.loads(lines[0]), [json.loads(line) for line in lines[1:]]
        except (OSError, ValueError, IndexError) as error:
            raise CallError(f"File {path.name} not found on server, or no recording") from error
        return head, ticks


@contextmanager
def _explain_failure(name: str) -> Iterator[None]:
    """Turns whatever is wrong with a recording into a CallError of one sentence."""
    try:
        yield
    except CallError:
        raise
    except (LookupError, AttributeError, TypeError, ArithmeticError, ValueError) as error:
        raise CallError(f"{name:.80} is no recording") from error
    except (RecursionError, wire.WireError) as error:
        raise CallError(f"{name:.80} is no recording") from error


def _start(head: dict[str, Any], ticks: list[list[Any]]) -> float:
    """Returns the s of the episode when a recording began; without it in the head, of the first tick."""
    return float(head.get("start", ticks[0][1]))


def _control_row(vehicle: Vehicle, vehicles: Vehicles) -> list[float]:
    """Returns [actor id, steer, throttle, brake, handbrake, gear] of a vehicle."""
    c, row = vehicle.control, vehicles.row(vehicle.actor)
    pedals = [round(v, 4) for v in (c.steer, c.throttle, c.brake)]
    return [
        vehicle.actor,
        *pedals,
        int(c.hand_brake),
        vehicle.gear(vehicles.moving.fleet.speed(row)),
    ]
