"""Checkpoints as files: a run goes on from one in another process, with the hash of a run that was not cut.

A file holds the state after a tick and the place in the log, not the ticks before it: those stand in the
run's folder. What it may contain is data only (`core/objects/statefile.py`). The first line names the format,
a header says of which run, version and machine the file is, and how many bytes of which hash follow.
"""

from __future__ import annotations

import zlib
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import msgspec

from skidpad.campaign.runs.checkpoints import FIXED
from skidpad.core.courses import Scenario
from skidpad.core.errors import CheckpointError
from skidpad.core.files.reading import read_bytes
from skidpad.core.objects.statefile import Ground
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendKind
from skidpad.recording.files import write_bytes
from skidpad.recording.fingerprint import fingerprint

CHECKPOINTS = "checkpoints"  # folder below a run's
SUFFIX, REFUSED = ".state", "refused.txt"
FORMAT = 1
MAGIC = b"skidpad state\n"
LARGEST = 1 << 30  # bytes of a state; more is no state of ours
LEVEL = 1  # of compression: 6 takes three times as long for a tenth of the size


class Header(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a file says of itself.

    Attributes:
        format: of the file.
        skidpad: version that wrote it.
        fingerprint: of the process that wrote it, as in ledgers.
        run: hash of the run's description.
        begin: digest of the run's objects at its begin.
        tick: the tick that was driven last.
        state: SHA-256 of what follows.
    """

    format: int
    skidpad: str
    fingerprint: str
    run: str
    begin: str
    tick: int
    state: str


class StoredState(NamedTuple):
    """A file that was read, its header, and the packed state that follows it."""

    path: Path
    header: Header
    state: bytes


class Parts(Protocol):
    """A run on its way, as `campaign/runs/run.OpenRun` is one."""

    spec: RunSpec

    def parts(self) -> list[Any]:
        """Returns what decides how the run goes on; the last one is a list that `take_parts` reads."""
        ...

    def take_parts(self, parts: list[Any]) -> None:
        """Takes the last of the parts back."""
        ...

    @property
    def tick(self) -> int:
        """Returns the tick that was driven last."""
        ...


class StateFiles:
    """Writes and reads the state of one run. It is made when the run's first tick was driven.

    Raises:
        CheckpointError: the run is on another simulator, a person takes part, or it holds what is no data.
    """

    def __init__(self, run: Parts) -> None:
        if run.spec.backend.backend != BackendKind.EMBEDDED:
            raise CheckpointError("a checkpoint as a file needs the embedded simulator")
        if run.spec.inputs:
            raise CheckpointError("a run in which a person took part is driven from its beginning")
        self.run, self.run_hash = run, run_hash(run.spec)
        self.ground = Ground(run.parts(), FIXED)

    def write(self, path: Path) -> None:
        """Writes the present state; CheckpointError where it is no data, OutputError for the path."""
        self.ground.root[-1][:] = self.run.parts()[-1]
        state = zlib.compress(msgspec.msgpack.encode(self.ground.write()), LEVEL)
        header = Header(
            format=FORMAT,
            skidpad=fingerprint().skidpad,
            fingerprint=fingerprint().short,
            run=self.run_hash,
            begin=self.ground.digest,
            tick=self.run.tick,
            state=sha256(state).hexdigest(),
        )
        write_bytes(path, MAGIC + msgspec.json.encode(header) + b"\n" + state)

    def restore(self, stored: StoredState) -> None:
        """Puts the run to the state of a file; its log goes on with the next tick.

        Raises:
            CheckpointError: the file is of another run, or damaged.
        """
        path, header, state = stored
        if header.begin != self.ground.digest:
            raise CheckpointError(f"{path}: the run begins otherwise now than when it was written")
        if header.state != sha256(state).hexdigest():
            raise CheckpointError(f"{path} is damaged: its contents have another hash than it says")
        unpacked = zlib.decompressobj().decompress(state, LARGEST)
        self.ground.restore(msgspec.msgpack.decode(unpacked))
        self.run.take_parts(self.ground.root[-1])


def read_state(path: Path, spec: RunSpec) -> StoredState:
    """Returns the contents of a file that can be restored here into this run.

    Raises:
        CheckpointError: it says in one sentence what the file is instead.
    """
    stored = unpack_state(path)
    header, here = stored.header, fingerprint()
    for what, there, now in (
        ("format", header.format, FORMAT),
        ("Skidpad", header.skidpad, here.skidpad),
        ("fingerprint of machine and libraries", header.fingerprint, here.short),
    ):
        if there != now:
            raise CheckpointError(f"{path} was written with another {what}: {there}, here {now}")
    if header.run != run_hash(spec):
        raise CheckpointError(f"{path} is of another run")
    return stored


def find_nearest(folder: Path, spec: RunSpec, tick: int) -> StoredState | None:
    """Returns the state in a run's folder of the latest tick before this one; None where there is none.

    Raises:
        CheckpointError: that file cannot be restored here, or the run said why it has none.
    """
    found = [path for path in (folder / CHECKPOINTS).glob(f"*{SUFFIX}") if path.stem.isdigit()]
    before = [path for path in found if int(path.stem) < tick]
    refused = folder / CHECKPOINTS / REFUSED
    if not found and refused.is_file():
        raise CheckpointError(read_bytes(refused, "sentence").decode(errors="replace").strip())
    if not before:
        return None
    return read_state(max(before, key=lambda path: int(path.stem)), spec)


class CheckpointWriter:
    """Writes the state of a run to its folder, each so many ticks.

    Where the run holds what is no data, one sentence says so in the folder, and the run goes on.
    """

    def __init__(self, run: Parts, folder: Path, every: int) -> None:
        self.run, self.folder, self.every = run, folder / CHECKPOINTS, every
        self.files: StateFiles | None = None
        self.refused = False

    @property
    def left(self) -> int:
        """How many ticks may be driven before the next one that it must see."""
        if self.files is None:
            return self.every if self.refused else 1
        return self.every - self.run.tick % self.every

    def note_tick(self) -> None:
        """Takes in that a tick was driven, from the first one on."""
        try:
            if self.run.tick == 0:
                self.files = StateFiles(self.run)
            elif self.files is not None and self.run.tick % self.every == 0:
                self.files.write(self.folder / f"{self.run.tick:07d}{SUFFIX}")
        except CheckpointError as error:
            self.files, self.refused = None, True
            write_bytes(self.folder / REFUSED, f"{error}\n".encode())


def run_hash(spec: RunSpec) -> str:
    """Returns a hash of everything that decides a run; a map's file counts by its name, as it may move."""
    plain = spec.to_identity()
    if not isinstance(spec.course, Scenario):
        plain = {**plain, "course": {**plain["course"], "map": Path(spec.course.map).name}}
    return sha256(msgspec.json.encode(plain, order="deterministic")).hexdigest()[:16]


def unpack_state(path: Path) -> StoredState:
    """Returns what a file holds, whatever run it is of; CheckpointError for another kind of file."""
    magic, _, rest = read_bytes(path, "checkpoint").partition(b"\n")
    line, _, state = rest.partition(b"\n")
    try:
        if magic + b"\n" != MAGIC:
            raise msgspec.DecodeError
        return StoredState(path, msgspec.json.decode(line, type=Header), state)
    except msgspec.DecodeError:
        raise CheckpointError(
            f"{path} is no checkpoint of Skidpad, or one of another format"
        ) from None
