"""The vehicle's side of updates: a pinned root, and nothing older than what it has seen."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import httpx
from tuf.api.exceptions import DownloadError, DownloadHTTPError, RepositoryError
from tuf.api.metadata import Metadata, Timestamp
from tuf.ngclient import FetcherInterface, Updater, UpdaterConfig

from skidpad.core.errors import BackendError
from skidpad.fleet.updates.payloads import PAYLOAD_MAX
from skidpad.fleet.updates.repository import SIGNED_AT
from skidpad.recording.files import write_bytes

SKEW_S = 300.0  # that a vehicle's clock may be behind the server's
PART = 65536  # bytes
METADATA, TARGETS = "/api/v1/updates/metadata/", "/api/v1/updates/targets/"
Stream = Callable[[str], AbstractContextManager[Any]]  # an answer as httpx streams it


class UpdateRefused(BackendError):
    """An update that is not what it should be; nothing of it was installed."""


class _Fetcher(FetcherInterface):
    """Gives a download in parts as they come, so that a reader stops at the length that it may have."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream

    def _fetch(self, url: str) -> Iterator[bytes]:
        """Yields a download in parts as sent; raises DownloadError where the server does not give it."""
        try:
            with self._stream(url) as answer:
                if answer.status_code != 200:
                    raise DownloadHTTPError(f"{url}: {answer.status_code}", answer.status_code)
                yield from answer.iter_raw(PART)  # as sent: nothing is unpacked
        except httpx.HTTPError as error:
            raise DownloadError(f"{url}: {error}") from error


class UpdateClient:
    """Fetches updates into a folder of the vehicle."""

    def __init__(
        self, folder: Path, root: bytes, stream: Stream, clock: Callable[[], float] = time.time
    ) -> None:
        self.folder, self.root, self.stream, self.clock = folder, root, stream, clock
        for part in ("metadata", "targets"):
            (folder / part).mkdir(parents=True, exist_ok=True)

    def fetch(self, name: str) -> Path:
        """Downloads the update of that name, checks it and returns its path; UpdateRefused otherwise."""
        self._check_clock()
        config = UpdaterConfig(
            timestamp_max_length=65536, snapshot_max_length=1024 * 1024,
            targets_max_length=16 * 1024 * 1024, root_max_length=1024 * 1024,
        )  # fmt: skip
        try:
            updater = Updater(
                str(self.folder / "metadata"), METADATA, str(self.folder / "targets"), TARGETS,
                _Fetcher(self.stream), config, bootstrap=self.root,
            )  # fmt: skip
            updater.refresh()
            self._note_time()
            target = updater.get_targetinfo(name)
            if target is None or target.length > PAYLOAD_MAX:
                raise UpdateRefused(f"no update {name!r} was signed")
            return Path(updater.find_cached_target(target) or updater.download_target(target))
        except (RepositoryError, DownloadError, ValueError) as error:
            raise UpdateRefused(
                f"the update is refused: {type(error).__name__}: {error}"
            ) from error

    @property
    def _trusted_time(self) -> Path:
        """Returns the file that keeps the latest signed time that the vehicle has seen."""
        return self.folder / "trusted_time"

    def _check_clock(self) -> None:
        """Raises UpdateRefused when the clock is more than SKEW_S behind the latest signed time it saw.

        A clock set back would let expired metadata pass.
        """
        trusted = float(self._trusted_time.read_text()) if self._trusted_time.exists() else 0.0
        if self.clock() + SKEW_S < trusted:
            raise UpdateRefused(
                f"the clock is {trusted - self.clock():.0f} s behind the last signed time it saw"
            )

    def _note_time(self) -> None:
        """Keeps the signed time of the timestamp, unless a later one is known, and checks the clock."""
        stamp: Metadata[Timestamp] = Metadata.from_bytes(
            (self.folder / "metadata" / "timestamp.json").read_bytes()
        )
        signed = float(stamp.signed.unrecognized_fields.get(SIGNED_AT, 0.0))
        before = float(self._trusted_time.read_text()) if self._trusted_time.exists() else 0.0
        write_bytes(self._trusted_time, repr(max(before, signed)).encode())
        self._check_clock()
