"""Road files out of the user's own CARLA: an installed folder, a package, or a saved container image.

CARLA looks for `Content/Carla/Maps/OpenDrive/NAME.xodr` and then for that name anywhere below `Content`
(public source: the plugin's `OpenDrive.cpp`). So does this module: of several files of one name, one in
a folder `OpenDrive` counts. Layers of an image lie upon each other as its `manifest.json` orders them;
a file `.wh.NAME` removes NAME from those below (OCI image specification, `layer.md`).
"""

from __future__ import annotations

import re
import tarfile
import zipfile
import zlib
from dataclasses import dataclass, field
from io import BufferedReader
from lzma import LZMAError
from pathlib import Path, PurePosixPath
from typing import IO, Any, NamedTuple, cast

from skidpad.core.errors import FileError
from skidpad.core.files.reading import decode_json
from skidpad.roads.opendrive.reader import SIZE_MAX

SUFFIX, PREFERRED = ".xodr", "OpenDrive"
ZIPPED, MANIFEST = ".zip", "manifest.json"
REMOVED, EMPTIED = ".wh.", ".wh..wh..opq"  # of an image: a file or folder, all that a folder held
LAYERS = 2  # archives in an archive: an image holds its layers as archives
TOTAL_MAX, FILES_MAX = 2**30, 20_000  # bytes and number of the road files of a source
NAME = re.compile(r"\w[\w.+ -]{0,99}")  # of a map
ZSTD = b"\x28\xb5\x2f\xfd"  # the first bytes of what it compresses
BROKEN = (
    tarfile.TarError,
    zipfile.BadZipFile,
    OSError,
    EOFError,
    zlib.error,
    LZMAError,
    RuntimeError,  # encrypted, or compressed in a way that zipfile does not read
    UnicodeError,
)


class RoadFiles(NamedTuple):
    """What was found in a source."""

    contents: dict[str, bytes]  # by the name of the map, sorted
    left_out: list[str]  # a path and a reason each


def find_road_files(source: Path) -> RoadFiles:
    """Returns the OpenDRIVE files of a folder or archive.

    A file of a folder that cannot be read is left out. FileError for what is not there or neither, is
    damaged, holds none, or more than TOTAL_MAX bytes or FILES_MAX files.
    """
    search = _Search(source)
    try:
        if not source.exists():
            raise FileError(f"{source} is not there: give a CARLA folder, package or image")
        search.run()
    except BROKEN as error:
        raise FileError(f"{source} cannot be read as a CARLA folder or archive: {error}") from error
    files = search.join_layers()
    taken: dict[str, PurePosixPath] = {}
    for path in sorted(files, key=_is_preferred, reverse=True):
        name = path.stem
        first = taken.setdefault(name, path)
        if not NAME.fullmatch(name):
            search.left_out.append(f"{path}: {name!r} cannot be the name of a map")
            del taken[name]
        elif files[first] != files[path] and _is_preferred(first) == _is_preferred(path):
            search.left_out.append(f"{path}: another file of this name is {first}")
    if not taken and not search.left_out:
        raise FileError(f"{source} holds no {SUFFIX} file: give a CARLA folder, package or image")
    return RoadFiles({name: files[taken[name]] for name in sorted(taken)}, search.left_out)


def _is_preferred(path: PurePosixPath) -> bool:
    """Returns whether CARLA looks at this place first."""
    return path.parent.name == PREFERRED


@dataclass(slots=True)
class _Search:
    """The road files of a source that were found so far."""

    source: Path
    layers: dict[str, dict[PurePosixPath, bytes]] = field(default_factory=dict)
    no_archives: set[str] = field(default_factory=set)  # blobs
    manifest: bytes | None = None
    left_out: list[str] = field(default_factory=list)
    size: int = 0  # bytes taken
    number: int = 0  # files taken

    def run(self) -> None:
        """Reads the whole source once, without unpacking it anywhere."""
        if self.source.is_dir():
            for file in sorted(self.source.rglob(f"*{SUFFIX}")):
                self._take_file(file)
        elif self.source.suffix == ZIPPED:
            with zipfile.ZipFile(self.source) as archive:
                for name in archive.namelist():
                    if name.endswith(SUFFIX):
                        with archive.open(name) as packed:
                            self._take("", name, packed)
        else:
            with self.source.open("rb") as stream, self._open(stream, "") as tar:
                self._read_tar(tar, "")

    def _take_file(self, file: Path) -> None:
        """Takes what is a file of the folder; one that cannot be read is left out."""
        path = file.relative_to(self.source).as_posix()
        try:
            if file.is_file():
                with file.open("rb") as stream:
                    self._take("", path, stream)
        except OSError as error:
            self.left_out.append(f"{path}: it cannot be read: {error.strerror}")

    def join_layers(self) -> dict[PurePosixPath, bytes]:
        """Returns the contents by path, of an image with upper layers over lower ones."""
        order = self._order()
        files: dict[PurePosixPath, bytes] = {}
        for layer in sorted(self.layers, key=lambda n: order.index(n) if n in order else -1):
            for path in self.layers[layer]:
                if path.name.startswith(REMOVED):
                    hidden = path.parent / path.name.removeprefix(REMOVED)
                    hidden = path.parent if path.name == EMPTIED else hidden
                    files = {p: c for p, c in files.items() if not p.is_relative_to(hidden)}
            files |= self.layers[layer]
        return {p: c for p, c in files.items() if not p.name.startswith(REMOVED)}

    def _order(self) -> list[str]:
        """Returns the names of an image's layers, the lowest first; FileError where one cannot be read."""
        found = [name for name in self.layers if name]
        if not found and not self.no_archives:
            return []
        where = f"{self.source}: {MANIFEST}"
        images = (
            [] if self.manifest is None else decode_json(self.manifest, where, list[dict[str, Any]])
        )
        order = [str(layer) for image in images for layer in image.get("Layers") or ()]
        for name in order:
            if name in self.no_archives:
                raise FileError(f"{self.source}: its layer {name} cannot be read")
        if len(found) > 1 and not set(found) <= set(order):
            raise FileError(
                f"{where} is needed, which orders layers; save the image by `docker save`"
            )
        return order

    def _open(self, stream: IO[bytes], name: str) -> tarfile.TarFile:
        """Returns a tar archive that is read once from front to back; FileError where zstd compressed it."""
        if cast(BufferedReader, stream).peek(len(ZSTD)).startswith(ZSTD):
            what = f"its layer {name}" if name else "it"
            raise FileError(
                f"{self.source}: {what} is compressed with zstd, which is not read; unpack it"
            )
        return tarfile.open(fileobj=stream, mode="r|*")

    def _read_tar(self, archive: tarfile.TarFile, layer: str, depth: int = LAYERS) -> None:
        """Takes the road files of a tar archive and of the archives in it."""
        for member in archive:
            content = archive.extractfile(member) if member.isfile() else None
            if content is None:
                continue
            name = member.name
            if name.endswith(SUFFIX) or (layer and PurePosixPath(name).name.startswith(REMOVED)):
                self._take(layer, name, content)
            elif name == MANIFEST and not layer:
                self.manifest = content.read(SIZE_MAX)
            elif depth > 1 and (name.endswith((".tar", ".tar.gz")) or "blobs/" in name):
                try:
                    inner = self._open(content, name)
                except tarfile.ReadError:
                    self.no_archives.add(name)
                    continue
                with inner:
                    self._read_tar(inner, name, depth - 1)

    def _take(self, layer: str, name: str, stream: IO[bytes]) -> None:
        """Keeps a file's content, unless it is too large for a map."""
        path = PurePosixPath(name.replace("\\", "/"))
        content = stream.read(SIZE_MAX + 1)
        if len(content) > SIZE_MAX:
            self.left_out.append(f"{path}: more than the allowed {SIZE_MAX} bytes")
            return
        self.size += len(content)
        self.number += 1
        if self.size > TOTAL_MAX or self.number > FILES_MAX:
            raise FileError(
                f"{self.source}: its {SUFFIX} files are more than the allowed {FILES_MAX}, or have more "
                f"than {TOTAL_MAX} bytes"
            )
        self.layers.setdefault(layer, {})[path] = content
