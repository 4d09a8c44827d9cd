"""The recorder's calls: a file in CARLA's own layout in --data-dir, and its summaries."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import monotonic, time
from typing import IO

from skidpad.core.errors import FileError
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.episode import Episode
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.recording.frames import FrameWriter
from skidpad.simulation.carla_server.recording.packets import (
    DURATION_AT,
    LogFrame,
    LogHead,
    pack_duration,
    pack_head,
    read_log,
)
from skidpad.simulation.carla_server.recording.recorder_text import (
    ANY,
    describe_recording,
    list_blocked,
    list_collisions,
)
from skidpad.simulation.carla_server.recording.replayer import CarlaRecording, recording

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
        self._file: IO[bytes] | None = None
        self._left = 0
        self._frame_at = 0  # byte at which the last frame begins; 0: there is none
        self._elapsed = 0.0  # s since the first frame
        self._began = 0.0  # s of the machine's clock
        self._frames = FrameWriter()

    def start(self, name: str, map: str, additional: bool = False) -> str:
        """Starts a recording, ending one that runs, and returns the name of its file.

        additional: also velocities, boxes and the machine's time. CallError or FileError where the
        file cannot be written.
        """
        path = safe_path(self.folder, name)
        self.stop()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb")
        except OSError as error:
            raise FileError(f"recording {path.name}: {error.strerror}") from error
        self._left, self._frame_at, self._elapsed = MAX_BYTES, 0, 0.0
        self._began = monotonic()
        self._frames = FrameWriter(additional)
        self._write(pack_head(map, int(time())))
        return path.name

    def stop(self) -> None:
        """Ends the recording and closes its file, if one runs."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def tick(self, clock: Clock, episode: Episode) -> None:
        """Writes a frame, the first at 0 s; nothing without a recording, and one of MAX_BYTES is ended."""
        if self._file is None:
            return
        if self._frame_at:
            self._elapsed += clock.step
            self._file.seek(self._frame_at + DURATION_AT)
            self._file.write(pack_duration(clock.step))
            self._file.seek(0, 2)
        self._frame_at = self._file.tell()
        self._write(self._frames.pack_frame(episode, self._elapsed, monotonic() - self._began))

    def _write(self, data: bytes) -> None:
        """Writes to the recording; stops the recording where the size limit is passed."""
        assert self._file is not None
        self._left -= len(data)
        if self._left < 0:
            self.stop()
            return
        self._file.write(data)

    def summary(self, name: str, show_all: bool = False) -> str:
        """Returns the text that `show_recorder_file_info` prints; CallError for what is no recording."""
        return describe_recording(*self._read(name), show_all)

    def collisions(self, name: str, first: str = ANY, second: str = ANY) -> str:
        """Returns what `show_recorder_collisions` prints of contacts between two kinds."""
        return list_collisions(*self._read(name), first, second)

    def describe_blocked(self, name: str, seconds: float, cm: float) -> str:
        """Returns the text that `show_recorder_actors_blocked` prints.

        seconds: shortest time; cm: least way from its place that counts as moving.
        """
        return list_blocked(*self._read(name), seconds, cm)

    def recording(self, name: str) -> CarlaRecording:
        """Returns what can be replayed of a file; CallError for what is no recording."""
        return recording(safe_path(self.folder, name).name, *self._read(name))

    def _read(self, name: str) -> tuple[LogHead, Iterator[LogFrame]]:
        """Returns header and frames of a recording; raises CallError for a missing or too large one."""
        path = safe_path(self.folder, name)
        if self._file is not None:
            self._file.flush()
        try:
            if path.stat().st_size > MAX_READ:
                raise CallError(f"{path.name} is larger than {MAX_READ} bytes")
            data = path.read_bytes()
        except OSError as error:
            raise CallError(f"File {path.name} not found on server") from error
        return read_log(path.name, data)
