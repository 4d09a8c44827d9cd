"""Files of others as plain values: one reader per kind, limits before work, one sentence for what is wrong.

What a file holds is checked before it is expanded: bytes, nesting, aliases, sizes of arrays.
"""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zlib import error as zlib_error

import msgspec
import numpy as np
import yaml
from numpy.lib import format as npy
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.text.told import clean, on_a_line

TEXT_MAX = 16 * 1024**2  # bytes of a YAML or JSON file
DEPTH_MAX = 60  # of nested collections
NODES_MAX = 200_000  # of a YAML file, its aliases counted as what they stand for
ARRAYS_MAX = 2 * 1024**3  # bytes of all arrays of an .npz file
MEMBERS_MAX = 10_000
LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# what libraries raise for content that they cannot use
UNUSABLE = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    ArithmeticError,
    RuntimeError,  # nested too deeply; zipfile: compressed or encrypted in a way that it cannot undo
    MemoryError,
    EOFError,
    StopIteration,
    msgspec.MsgspecError,
    yaml.YAMLError,
    zipfile.BadZipFile,
)


def is_file(path: Path) -> bool:
    """Returns whether there is such a file; False also for what no file can be called."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_bytes(path: Path, what: str, limit: int = TEXT_MAX) -> bytes:
    """Returns the content of a file; FileError when it cannot be read or is larger than `limit` bytes.

    what: the kind of file, for the error.
    """
    try:
        with path.open("rb") as file:
            content = file.read(limit + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FileError(f"{what} {clean(str(path))}: cannot be read: {why}") from None
    if len(content) > limit:
        raise FileError(f"{what} {path}: is larger than {limit} bytes")
    return content


def unusable(where: str, kind: str, error: BaseException) -> FileError:
    """Returns a FileError, one sentence, for content that is not what it should be; `where` begins it."""
    return FileError(f"{where} is not {kind}: {on_a_line(error)}")


def decode_yaml(data: bytes, where: str, kind: Any = None) -> Any:
    """Returns the value of a YAML text, of type `kind` if given.

    FileError when it is no YAML or too much of it, ConfigError when its values do not fit.
    """
    try:
        measure_yaml(data, where)
        plain = yaml.load(data, LOADER)
    except FileError:
        raise
    except UNUSABLE as error:
        raise unusable(where, "YAML", error) from None
    return plain if kind is None else convert_plain(plain, kind, where)


def convert_plain(plain: Any, kind: Any, where: str) -> Any:
    """Returns plain data as a value of type `kind`; ConfigError that says what does not fit."""
    try:
        return msgspec.convert(plain, kind)
    except UNUSABLE as error:
        raise ConfigError(f"{where}: {on_a_line(error)}") from None


def measure_yaml(data: bytes, where: str) -> None:
    """Raises FileError for a text that nests or repeats itself beyond DEPTH_MAX or NODES_MAX."""
    sizes: list[int] = []  # of the collections that are open
    names: list[str | None] = []
    anchors: dict[str, int] = {}
    total = 0
    for event in yaml.parse(data, LOADER):
        if isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            sizes.append(1)
            names.append(event.anchor)
            if len(sizes) > DEPTH_MAX:
                raise FileError(f"{where} nests deeper than {DEPTH_MAX}")
            continue
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in anchors:
                raise FileError(f"{where}: {event.anchor!r:.100} stands for itself or for nothing")
            size, name = anchors[event.anchor], None
        elif isinstance(event, yaml.ScalarEvent):
            size, name = 1, event.anchor
        elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
            size, name = sizes.pop(), names.pop()
        else:
            continue
        if name is not None:
            anchors[name] = size
        if sizes:
            sizes[-1] += size
        total = max(total, size, *sizes[-1:])
        if total > NODES_MAX:
            raise FileError(f"{where} holds more than {NODES_MAX} values")


def decode_json(data: bytes | str, where: str, kind: Any = Any) -> Any:
    """Returns the value of a JSON text, of type `kind`; FileError for anything else."""
    try:
        return msgspec.json.decode(data, type=kind)
    except UNUSABLE as error:
        raise FileError(f"{where} is damaged: {on_a_line(error)}") from None


def read_arrays(data: bytes, where: str, kind: str = "an .npz file") -> dict[str, NDArray[Any]]:
    """Returns the arrays of an .npz file by name; FileError for anything else.

    Sizes are checked before memory is taken for it.
    """
    try:
        with zipfile.ZipFile(BytesIO(data)) as packed:
            members = packed.infolist()
            if len(members) > MEMBERS_MAX:
                raise FileError(f"{where} holds more than {MEMBERS_MAX} arrays")
            if sum(m.file_size for m in members) > ARRAYS_MAX:
                raise FileError(f"{where} unpacks to more than {ARRAYS_MAX} bytes")
            return {m.filename.removesuffix(".npy"): _array(packed, m, where) for m in members}
    except FileError:
        raise
    except (*UNUSABLE, OSError, zlib_error, SyntaxError, TokenError) as error:
        raise unusable(where, kind, error) from None


def _array(packed: zipfile.ZipFile, member: zipfile.ZipInfo, where: str) -> NDArray[Any]:
    """Returns the array of one .npy member; raises FileError for objects or a size beyond its content."""
    with packed.open(member) as stream:
        version = npy.read_magic(stream)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, by_columns, kind = read(stream)
        if kind.hasobject:
            raise FileError(f"{where}: {member.filename} holds objects, not numbers")
        if (
            int(np.prod(shape, dtype=object)) * kind.itemsize > member.file_size
            or min(shape, default=0) < 0
        ):
            raise FileError(f"{where}: {member.filename} says that it is larger than its content")
        content = bytearray(stream.read())  # not bytes, so that the array can be written
    values: NDArray[Any] = np.ndarray(shape, kind, content, order="F" if by_columns else "C")
    return values
