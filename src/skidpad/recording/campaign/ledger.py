"""The ledger of a campaign: one line per finished run, appended and synced, so that nothing that
was done is done again, whatever is killed. It, and not any scheduler, is the truth.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar
from zlib import crc32

import msgspec

from skidpad.core.errors import FileError, OutputError
from skidpad.core.files.names import inside
from skidpad.core.text.told import clean
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.added_metrics import AddedMetric
from skidpad.recording.campaign.results import Timing
from skidpad.recording.files import output_error, read_json, write_bytes

LEDGER, CAMPAIGN = "ledger.jsonl", "campaign.json"
SUM = re.compile(rb',"sum":"([0-9a-f]{8})"}$')
DAMAGED = "ledger.damaged"  # lines that were set aside
RETRIED = frozenset({Outcome.CRASHED, Outcome.TIMEOUT})  # by resume (decision L-7)


class HasOutcome(Protocol):
    """Identifying columns of a row."""

    @property
    def outcome(self) -> str:
        """Returns the outcome of a run, as `core.Outcome` names it."""
        ...


K = TypeVar("K", bound=HasOutcome)
M = TypeVar("M")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry(Generic[K, M]):
    """One finished run. `run` names it within the campaign: cell and seed."""

    run: str  # name of the run within the campaign
    key: K  # columns of results.parquet that say which run
    metrics: M | None  # the other columns of results.parquet; null: it crashed or timed out
    timing: Timing  # columns of timing.parquet
    fingerprint: str  # processor features, libraries and version that drove it
    attempts: int = 1  # times that the run was begun
    error: str = ""  # one sentence, for agent_error, crashed, timeout
    added: tuple[AddedMetric, ...] = ()  # metrics of installed packages


E = TypeVar("E", bound=Entry[Any, Any])


class Ledger(Generic[E], AbstractContextManager["Ledger[E]"]):
    """The open ledger of the one process that writes a campaign; use it as a context."""

    def __init__(
        self, folder: Path, kind: type[E], identity: dict[str, Any], resume: bool = False
    ) -> None:
        """kind: what its lines are. identity: the resolved configuration, without workers and paths
        (decision M-18).

        OutputError when the folder holds another campaign, or this one and `resume` is false, or
        another process is writing it.
        """
        self.folder = folder
        self.path = folder / LEDGER
        self._check(identity, resume)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise output_error(self.path, error) from error
        try:
            _lock(self._file, folder)
            if not (folder / CAMPAIGN).exists():
                write_bytes(folder / CAMPAIGN, encode_identity(identity))
            self.entries: list[E]
            self.entries, self.damaged = _entries(self.path, kind)
            self._heal()
        except BaseException:
            self.close()
            raise

    def _check(self, identity: dict[str, Any], resume: bool) -> None:
        """Raises OutputError where the folder is not free for this campaign, to begin or to resume."""
        state = folder_state(self.folder, identity)
        if state is FolderState.OTHER:
            raise OutputError(
                f"{self.folder} holds something else than this campaign; choose another --out"
            )
        if state is FolderState.SAME and not resume:
            raise OutputError(
                f"{self.folder} holds this campaign already; pass --resume to finish it"
            )

    def _heal(self) -> None:
        """Cuts off what a kill left of a line; sets damaged lines aside, so that they are driven again."""
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole != len(content):
            os.truncate(self._file, whole)
        if not self.damaged:
            return
        lines = content[:whole].split(b"\n")[:-1]
        broken = {d.number for d in self.damaged}
        bad = [line for number, line in enumerate(lines, start=1) if number in broken]
        good = [line for number, line in enumerate(lines, start=1) if number not in broken]
        aside = self.folder / DAMAGED
        earlier = aside.read_bytes() if aside.is_file() else b""
        write_bytes(aside, earlier + b"".join(line + b"\n" for line in bad))
        write_bytes(self.path, b"".join(line + b"\n" for line in good))
        os.close(self._file)  # of the file that was replaced
        self._file = os.open(self.path, os.O_RDWR | os.O_APPEND)
        _lock(self._file, self.folder)

    def append(self, entry: E) -> None:
        """Writes a finished run; when this returns, the line is on the disk.

        OutputError where that fails; the ledger is then as before.
        """
        line = _add_checksum(msgspec.json.encode(entry)) + b"\n"
        size = os.fstat(self._file).st_size
        try:
            written = os.write(self._file, line)
            if written != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(self._file)
        except OSError as error:
            os.truncate(self._file, size)
            raise output_error(self.path, error) from error
        self.entries.append(entry)

    def completed_runs(self) -> frozenset[str]:
        """Returns the runs that need not be driven again: all but those that crashed or timed out."""
        last = latest(self.entries)
        return frozenset(e.run for e in last if Outcome(e.key.outcome) not in RETRIED)

    def close(self) -> None:
        """Releases the lock; safe to call twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def __exit__(self, *error: object) -> None:
        self.close()


@dataclass(frozen=True, slots=True)
class Damage:
    """A line of a ledger that cannot be read."""

    number: int  # from 1
    why: str


def read_ledger(folder: Path, kind: type[E]) -> list[E]:
    """Returns all entries, oldest first; [] without a ledger.

    A torn last line is passed over; any other damage is a FileError.
    """
    path = folder / LEDGER
    entries, damaged = _entries(path, kind)
    if damaged:
        first = damaged[0]
        raise FileError(
            f"{path}, line {first.number} is damaged: {first.why}; --resume sets it aside and "
            "drives its run again"
        )
    return entries


def _entries(path: Path, kind: type[E]) -> tuple[list[E], list[Damage]]:
    """Returns what can be read of a ledger, and what cannot; what follows the last newline is torn."""
    try:
        lines = path.read_bytes().split(b"\n")[:-1]
    except FileNotFoundError:
        return [], []
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror}") from error
    entries: list[E] = []
    damaged = []
    for number, line in enumerate(lines, start=1):
        try:
            entry = msgspec.json.decode(line, type=kind)
            _check_sum(line)
            Outcome(entry.key.outcome)
            inside(path.parent, entry.run)
            entries.append(entry)
        except (
            msgspec.MsgspecError,
            ValueError,
            RecursionError,
        ) as error:  # also UnicodeDecodeError
            damaged.append(Damage(number, clean(str(error), 300)))
    return entries, damaged


def _add_checksum(line: bytes) -> bytes:
    """Returns a JSON object with a checksum as its last member, so that a flipped bit is no new value."""
    return line[:-1] + b',"sum":"%08x"}' % crc32(line)


def _check_sum(line: bytes) -> None:
    """Raises ValueError for a line that is not what was written; lines of old versions have no checksum."""
    found = SUM.search(line)
    if found and crc32(line[: found.start()] + b"}") != int(found[1], 16):
        raise ValueError("its checksum is another")


def latest(entries: Iterable[E]) -> list[E]:
    """Returns the newest entry on each run, in the order of their names."""
    by_run = {e.run: e for e in entries}
    return [by_run[run] for run in sorted(by_run)]


def fingerprints(entries: Sequence[Entry[Any, Any]]) -> frozenset[str]:
    """Returns all fingerprints; of several, equal bytes are not promised (decision X-2)."""
    return frozenset(e.fingerprint for e in entries)


class FolderState(Enum):
    """What an output folder holds."""

    EMPTY = 0
    SAME = 1  # this campaign, finished or not
    OTHER = 2


def folder_state(folder: Path, identity: dict[str, Any]) -> FolderState:
    """Returns what `folder` holds, seen from the campaign with this resolved configuration."""
    if not folder.exists():
        return FolderState.EMPTY
    if not folder.is_dir():
        return FolderState.OTHER
    if all(_is_rest(f) for f in folder.iterdir()):
        return FolderState.EMPTY
    campaign = folder / CAMPAIGN
    same = campaign.is_file() and campaign.read_bytes() == encode_identity(identity)
    return FolderState.SAME if same else FolderState.OTHER


def _is_rest(file: Path) -> bool:
    """Returns whether a file is what a kill at the very beginning leaves: empty ledger, part of a file."""
    if file.name.startswith(".") and file.name.endswith(".part"):
        return True
    return file.name == LEDGER and file.is_file() and file.stat().st_size == 0


def read_identity(folder: Path) -> dict[str, Any]:
    """Returns campaign.json of a folder; {} when there is none."""
    return read_json(folder / CAMPAIGN, dict[str, Any]) or {}


def campaign_command(folder: Path) -> str:
    """Returns which command wrote a campaign's folder, "adas" where it does not say."""
    return str(read_identity(folder).get("command", "adas"))


def common_configuration(folder: Path) -> dict[str, Any]:
    """Returns what all runs of a campaign have in common; {} where it does not say."""
    common = read_identity(folder).get("common", {})
    if not isinstance(common, dict):
        raise FileError(f"{folder / CAMPAIGN} does not describe a campaign")
    return dict(common)


def encode_identity(identity: dict[str, Any]) -> bytes:
    """Returns the canonical text of a resolved configuration."""
    return msgspec.json.encode(identity, order="deterministic")


def _lock(file: int, folder: Path) -> None:
    """Locks the open file against other processes; raises OutputError where one holds it."""
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise OutputError(f"another process is writing {folder}") from error
