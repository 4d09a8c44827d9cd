"""Road files out of somebody's own CARLA: an installed folder, a package, or a saved container image.

CARLA looks for `Content/Carla/Maps/OpenDrive/NAME.xodr` and then for that name anywhere below `Content`
(public source: the plugin's `OpenDrive.cpp`). So does this module: of several files of one name, one in
a folder `OpenDrive` counts.
"""

from __future__ import annotations

import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO

from skidpad.core.errors import FileError
from skidpad.roads.opendrive.document import SIZE_MAX

SUFFIX, PREFERRED = ".xodr", "OpenDrive"
ZIPPED = ".zip"
LAYERS = 2  # archives in an archive: an image holds its layers as archives
BROKEN = (tarfile.TarError, zipfile.BadZipFile, OSError, EOFError, zlib.error)


def find_road_files(source: Path) -> dict[str, bytes]:
    """Returns the OpenDRIVE files of a folder or archive by the name of their map, sorted.

    FileError for what is neither, holds none, or holds one of more than SIZE_MAX bytes.
    """
    found: dict[str, tuple[bool, bytes]] = {}
    try:
        for path, content in _files(source):
            if len(content) > SIZE_MAX:
                raise FileError(f"{source}: {path} has more than the allowed {SIZE_MAX} bytes")
            known, preferred = found.get(path.stem), path.parent.name == PREFERRED
            if known is None or preferred > known[0]:
                found[path.stem] = preferred, content
    except BROKEN as error:
        raise FileError(f"{source} cannot be read as a CARLA folder or archive: {error}") from error
    if not found:
        raise FileError(f"{source} holds no {SUFFIX} file: give a CARLA folder, package or image")
    return {name: found[name][1] for name in sorted(found)}


def _files(source: Path) -> Iterator[tuple[PurePosixPath, bytes]]:
    """Yields path and content of every road file, at most one byte more than SIZE_MAX of each."""
    if source.is_dir():
        for file in sorted(source.rglob(f"*{SUFFIX}")):
            with file.open("rb") as stream:
                yield PurePosixPath(file.relative_to(source).as_posix()), _head(stream)
    elif source.suffix == ZIPPED:
        with zipfile.ZipFile(source) as archive:
            for name in archive.namelist():
                if name.endswith(SUFFIX):
                    with archive.open(name) as stream:
                        yield PurePosixPath(name), _head(stream)
    else:
        with source.open("rb") as stream:
            yield from _read_archive(stream, LAYERS)


def _read_archive(stream: IO[bytes], depth: int) -> Iterator[tuple[PurePosixPath, bytes]]:
    """Yields the road files of a tar archive and of the archives in it, read once from front to back."""
    with tarfile.open(fileobj=stream, mode="r|*") as archive:
        for member in archive:
            content = archive.extractfile(member) if member.isfile() else None
            if content is None:
                continue
            if member.name.endswith(SUFFIX):
                yield PurePosixPath(member.name), _head(content)
            elif depth > 1 and _may_be_layer(member.name):
                try:
                    yield from _read_archive(content, depth - 1)
                except tarfile.ReadError:  # a blob of an image that is no layer
                    continue


def _may_be_layer(name: str) -> bool:
    """Returns whether a file of a container image may hold a layer."""
    return name.endswith((".tar", ".tar.gz")) or "blobs/" in name


def _head(stream: IO[bytes]) -> bytes:
    """Returns the content of a file, at most one byte more than SIZE_MAX."""
    return stream.read(SIZE_MAX + 1)
