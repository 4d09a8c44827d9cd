"""Content-addressed blobs through fsspec: a folder, or an object store as a setting."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import fsspec

from skidpad.core.errors import FileError
from skidpad.fleet.identity import digest
from skidpad.recording.files import write_bytes

DIGITS = frozenset("0123456789abcdef")


class Blobs:
    """Bytes by the SHA-256 of themselves; what was put stays as it is."""

    def __init__(self, url: str) -> None:
        self._fs, self._root = fsspec.core.url_to_fs(url)
        protocol = self._fs.protocol
        self._local = "file" in ((protocol,) if isinstance(protocol, str) else protocol)

    def store(self, content: bytes) -> str:
        """Writes `content`, on a local disk durably, unless it is there; returns its name, the SHA-256."""
        name = digest(content)
        path = self._path(name)
        if self._fs.exists(path):
            return name
        if self._local:
            write_bytes(Path(path), content)
            _sync_folder(Path(path).parent)
        else:
            self._fs.makedirs(path.rpartition("/")[0], exist_ok=True)
            self._fs.pipe_file(path, content)
        return name

    def get(self, name: str) -> bytes:
        """Returns the whole blob; FileError when it is absent or not what its name says."""
        content = self._read(name, None, None)
        if digest(content) != name:
            raise FileError(f"blob {name} is damaged")
        return content

    def part(self, name: str, start: int, size: int) -> bytes:
        """Returns `size` bytes of a blob from `start`, whose digest is not checked; FileError if absent."""
        return self._read(name, start, start + size)

    def _read(self, name: str, start: int | None, end: int | None) -> bytes:
        """Returns the blob's bytes from `start` to `end`; None: to its own begin or end."""
        try:
            content: Any = self._fs.cat_file(self._path(name), start=start, end=end)
        except FileNotFoundError as error:
            raise FileError(f"there is no blob {name}") from error
        return bytes(content)

    def _path(self, name: str) -> str:
        """Returns where a blob is stored; raises FileError unless its name has 64 hexadecimal digits."""
        if len(name) != 64 or not DIGITS.issuperset(name):
            raise FileError("a blob's name is 64 hexadecimal digits")
        return f"{self._root}/{name[:2]}/{name}"


def _sync_folder(folder: Path) -> None:
    """Makes a rename within a folder durable, and the folder itself in its parent."""
    for each in (folder, folder.parent):
        descriptor = os.open(each, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
